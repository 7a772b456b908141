// SPDX-License-Identifier: BSD-3-Clause
/**
 * Cuts a few points in two by their heights along a direction, for several directions at once: most
 * of the time of ThinPlates where points fill space.
 */
#pragma once

#include "Filters/Common/VectorMath.h"
#include "Filters/Neighbors/NeighborGraph.h"

#include <array>
#include <limits>

namespace SurfelGeometry
{
/// Smallest number of points on either side of a cut.
constexpr int MinOnSheet = 4;

/// A point and its neighbours, relative to it; 2 MinOnSheet or more.
struct PlatePoints
{
  std::array<Vector3, KeptNeighbors + 1> At;
  int Count = 0;
};

/// Points cut in two by their heights along a direction.
struct Split
{
  double Within = std::numeric_limits<double>::infinity(); // variance of the heights in the parts
  double Gap = 0.0;                                        // distance of the parts' means
  double Limit = 0.0;                                      // height of the cut
};

/// The number of directions that take as long as one of them.
constexpr int CutLanes = 8;

/// The cuts that leave the least variance (k-means of two clusters in one dimension, exact).
/// @param count number of directions and splits, up to CutLanes
void CutHeights(const PlatePoints& points, const Vector3* directions, int count, Split* splits);
}
