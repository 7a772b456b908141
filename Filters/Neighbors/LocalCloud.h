// SPDX-License-Identifier: BSD-3-Clause
/**
 * The points that the filters use: finite and distinct, relative to a local origin, in an order
 * that keeps neighbours in space near each other in memory.
 */
#pragma once

#include "Filters/Common/IdType.h"
#include "Filters/Common/RawVector.h"

#include <cstddef>
#include <vector>

class vtkPoints;

namespace SurfelGeometry
{
/// Points relative to a local origin, in Morton order. `n` below is Size().
struct LocalCloud
{
  double Origin[3] = { 0.0, 0.0, 0.0 }; // world units; float values, unless the input's own
  RawVector<float> Positions;           // [3n] relative to Origin
  RawVector<int> InputIds;              // [n]
  std::vector<vtkIdType> SampleIds;     // [input points] seeds of random samples, the same in every
                                        // part of a cloud; empty: the input's ids
  vtkIdType NonFinite = 0;  // points dropped: a coordinate is NaN, infinite or too large
  vtkIdType Duplicates = 0; // points dropped: same position as one with a lower id

  int Size() const { return static_cast<int>(this->InputIds.size()); }
  vtkIdType SampleId(int i) const
  {
    return this->SampleIds.empty() ? this->InputIds[i] : this->SampleIds[this->InputIds[i]];
  }
  const float* Position(int i) const { return this->Positions.data() + 3 * static_cast<size_t>(i); }
};

/// Points with a coordinate beyond this are dropped like infinite ones: the neighbour search sums
/// squares in float, which would overflow.
constexpr double CoordinateLimit = 1e17;

/// A cloud is moved to a local origin if its largest coordinate exceeds this many diagonals of its
/// bounding box (Documentation/DataContract.md).
constexpr double LocalOriginRatio = 4.0;

/// Fills `cloud` from points that are relative to `inputOrigin`.
void GatherCloud(vtkPoints* points, const double inputOrigin[3], LocalCloud& cloud);

/// Bounds of the points that GatherCloud keeps, relative to their origin. @return their number
vtkIdType FindBounds(vtkPoints* points, double lower[3], double upper[3]);

/// Chooses the origin by the data contract's rule, from the bounds of points relative to
/// inputOrigin.
void ChooseOrigin(
  const double lower[3], const double upper[3], const double inputOrigin[3], double origin[3]);

/// Positions of all points relative to an origin; NaN for those that GatherCloud drops as
/// non-finite.
void PlaceAbout(vtkPoints* points, const double inputOrigin[3], const double origin[3],
  std::vector<float>& positions);

/// The same relative to the origin that GatherCloud chooses. @return the number of NaN points
vtkIdType PlacePoints(
  vtkPoints* points, const double inputOrigin[3], double origin[3], std::vector<float>& positions);

/// A random sample, the same in every run and in every part of a cloud.
/// @param share of the points, about; from 1 on all of them
std::vector<int> SamplePoints(const LocalCloud& cloud, double share);

/// For the kept points of the input, one after another: their index in the cloud.
/// @param kept [input points] 1: the point is in the cloud
std::vector<int> OrderOfInput(const LocalCloud& cloud, const std::vector<char>& kept);
}
