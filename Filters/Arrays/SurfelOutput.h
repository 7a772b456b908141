// SPDX-License-Identifier: BSD-3-Clause
/**
 * The arrays of new surfels, and the point data that they take over from their points.
 */
#pragma once

#include "Core/Surfels/SurfelArrays.h"

#include "vtkSmartPointer.h"
#include "vtkType.h"

#include <vector>

class vtkFloatArray;
class vtkPointSet;
class vtkPolyData;
class vtkUnsignedCharArray;

namespace SurfelGeometry
{
/// Arrays to fill, as Documentation/DataContract.md defines them.
struct SurfelOutput
{
  /// The point arrays.
  static constexpr const char* Names[] = { SurfelSplatting::Arrays::Covariance,
    SurfelSplatting::Arrays::AreaVector, SurfelSplatting::Arrays::TwoSided,
    SurfelSplatting::Arrays::Overlap };

  explicit SurfelOutput(vtkIdType count);

  /// Adds the surfels to `output`: points, their cell, the point arrays and the origin. If its
  /// field data are those of a hierarchy, they become those of surfels.
  void Write(const double origin[3], vtkPolyData* output) const;

  vtkSmartPointer<vtkFloatArray> Positions, Covariances, AreaVectors;
  vtkSmartPointer<vtkUnsignedCharArray> TwoSided;
  vtkSmartPointer<vtkUnsignedCharArray> Overlaps; ///< 0 until the surfels are normalized
};

/// Whether surfels have a point array of this name, which takes the place of their points' own.
bool IsOfSurfels(const char* name);

/// Removes what a hierarchy has in the field data of its surfels.
void RemoveHierarchy(vtkPolyData* surfels);

/// Passes the point data of those input points that are kept, and the field data.
/// @param kept [input points] 1: the point is kept
void PassPointData(vtkPointSet* input, const std::vector<char>& kept, vtkPolyData* output);
}
