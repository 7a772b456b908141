// SPDX-License-Identifier: BSD-3-Clause
/**
 * Collects Gaussians from independent parts of an input, and makes the output of them.
 */
#pragma once

#include "Filters/Common/StageProgress.h"

#include "vtkType.h"

#include <functional>
#include <string>
#include <vector>

class vtkPolyData;

namespace SurfelVolumes
{
/// As Documentation/DataContract.md defines them: points relative to an origin, world units.
struct Gaussian
{
  float Position[3];
  float Covariance[6]; // XX YY ZZ XY YZ XZ
  float Extinction;    // at the centre, per world unit
  unsigned char Color[3];
};

/// Gaussians of a part of an input.
struct GaussianPart
{
  std::vector<Gaussian> Gaussians;
  std::vector<float> Normals; // [n][3] of them, mean, length 0..1; or empty
};

/// 0..1 to 0..255.
unsigned char ColorByte(double value);

class GaussianCollection
{
public:
  /// @param hasNormals whether all Gaussians have normals
  explicit GaussianCollection(bool hasNormals)
    : HasNormals(hasNormals)
  {
  }

  bool NeedsNormals() const { return this->HasNormals; }

  /// Calls fill(i, part) for the parts 0 to count - 1 in parallel. Their order in the
  /// output is that of the parts, whatever the threads. Returns false if stopped by the user, or if
  /// the memory does not suffice: then Error() says so.
  bool Collect(vtkIdType count, const SurfelGeometry::StageProgress& progress,
    const std::function<void(vtkIdType, GaussianPart&)>& fill);

  /// Empty unless Collect() ended for want of memory: what is wrong and what to do.
  const std::string& Error() const { return this->Problem; }

  /// Makes points, their cell, arrays and origin, and gives the memory of the parts back.
  void Write(const double origin[3], vtkPolyData* output);

private:
  bool HasNormals;
  std::vector<GaussianPart> Parts;
  std::string Problem;
};
}
