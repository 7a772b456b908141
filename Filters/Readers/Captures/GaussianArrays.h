// SPDX-License-Identifier: BSD-3-Clause
/**
 * Turns the Gaussians of a capture into points and the point arrays of
 * Documentation/DataContract.md, "Gaussians in space".
 */
#pragma once

#include "Filters/Readers/Captures/GaussianLayout.h"
#include "Filters/Readers/Points/FieldCloud.h"

#include "vtkNew.h"
#include "vtkType.h"

#include <cstdint>
#include <string>
#include <vector>

class vtkDataArray;
class vtkFloatArray;
class vtkPoints;
class vtkPolyData;
class vtkUnsignedCharArray;

namespace PointCloud
{
/// An error message if so many Gaussians with so many harmonics, and other bytes for each, do not
/// fit into memory; empty if they do.
std::string CheckMemory(vtkIdType gaussians, int harmonics, double otherBytes);

class GaussianArrays
{
public:
  /// Allocates the arrays; throws std::bad_alloc.
  GaussianArrays(const GaussianLayout& layout, vtkIdType count);
  ~GaussianArrays();

  /// Decodes Gaussians that follow those of the calls before.
  void Append(const FieldCloud& gaussians);

  /// Leaves out Gaussians of which a value is not finite. Returns their number.
  vtkIdType RemoveInvalid();

  void MoveTo(vtkPolyData* output);

private:
  bool Decode(const std::uint8_t* gaussian, vtkIdType id);
  std::vector<vtkDataArray*> All();

  const GaussianLayout Layout;
  vtkIdType Appended = 0;
  std::vector<std::uint8_t> IsValid;
  vtkNew<vtkPoints> Points;
  vtkNew<vtkFloatArray> Covariance, Opacity, Harmonics;
  vtkNew<vtkUnsignedCharArray> Colors;
};
}
