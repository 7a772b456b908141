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
  std::vector<vtkIdType> SampleIds; // [input points] by which random samples are drawn, the same
                                    // in every part of a cloud; empty: the input's ids
  vtkIdType NonFinite = 0;          // points dropped: a coordinate is NaN, infinite or absurd
  vtkIdType Duplicates = 0;         // points dropped: same position as one with a lower id

  int Size() const { return static_cast<int>(this->InputIds.size()); }
  vtkIdType SampleId(int i) const
  {
    return this->SampleIds.empty() ? this->InputIds[i] : this->SampleIds[this->InputIds[i]];
  }
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

/// Bounds of the points that GatherCloud keeps, relative to their origin. @return their number
vtkIdType FindBounds(vtkPoints* points, double lower[3], double upper[3]);

/// Origin by the rule of the data contract, for points (relative to inputOrigin) within bounds.
void ChooseOrigin(
  const double lower[3], const double upper[3], const double inputOrigin[3], double origin[3]);

/// Positions of all points about an origin; NaN for those that GatherCloud drops as not finite.
void PlaceAbout(vtkPoints* points, const double inputOrigin[3], const double origin[3],
  std::vector<float>& positions);

/// Positions of all points about the origin that GatherCloud chooses; NaN for those that it drops
/// as not finite, which are counted. @return their number
vtkIdType PlacePoints(
  vtkPoints* points, const double inputOrigin[3], double origin[3], std::vector<float>& positions);
}
