// SPDX-License-Identifier: BSD-3-Clause
/**
 * The points that take part: finite, distinct, about a local origin, in an order that keeps
 * neighbours in space near each other in memory.
 */
#pragma once

#include "vtkType.h"

#include <cstddef>
#include <vector>

class vtkPoints;

namespace SurfelGeometry
{
/// Points about a local origin along a Morton curve. `n` below is Size().
struct LocalCloud
{
  double Origin[3] = { 0.0, 0.0, 0.0 }; // world units; float values, unless the input's own
  std::vector<float> Positions;         // [3n] relative to Origin
  std::vector<vtkIdType> InputIds;      // [n]
  vtkIdType NonFinite = 0;              // points dropped: a coordinate is NaN, infinite or absurd
  vtkIdType Duplicates = 0;             // points dropped: same position as one with a lower id

  int Size() const { return static_cast<int>(this->InputIds.size()); }
  const float* Position(int i) const { return this->Positions.data() + 3 * static_cast<size_t>(i); }
};

/// Coordinates beyond this are dropped with the infinite ones: their squares, which the
/// neighbour search sums in float, would overflow.
constexpr double LargestCoordinate = 1e17;

/// A cloud is moved to a local origin where its largest coordinate exceeds this many diagonals
/// of its bounding box (Documentation/DataContract.md).
constexpr double LocalOriginRatio = 4.0;

/// Fills `cloud` from points that are relative to `inputOrigin`.
void GatherCloud(vtkPoints* points, const double inputOrigin[3], LocalCloud& cloud);

/// Positions of all points about the origin that GatherCloud chooses; NaN for those that it drops
/// as not finite, which are counted. @return their number
vtkIdType PlacePoints(
  vtkPoints* points, const double inputOrigin[3], double origin[3], std::vector<float>& positions);
}
