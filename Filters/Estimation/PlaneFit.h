// SPDX-License-Identifier: BSD-3-Clause
/**
 * Tangent plane, spacing and tangential extent of every point from its neighbours.
 */
#pragma once

#include "Filters/Common/StageProgress.h"
#include "Filters/Common/VectorMath.h"

#include <cstddef>
#include <vector>

namespace SurfelGeometry
{
struct LocalCloud;
class NeighborSearch;

struct FitSettings
{
  bool UseRadius = false; // neighbours within Radius instead of the nearest ones
  int NumberOfNeighbors = 16;
  double Radius = 0.0;                // world units
  int MaximumNumberOfNeighbors = 128; // bounds UseRadius
  double IsolationFactor = 6.0;
};

/// What the neighbours of one point say. Lengths in world units.
struct PlaneFit
{
  Float3 Normal;           // unit; its sign means nothing yet
  Float3 AxisU;            // unit, tangential: direction of the larger variance
  float VarianceU = 0.0f;  // of the neighbours along AxisU, scaled so that
  float VarianceV = 0.0f;  // sqrt(VarianceU VarianceV) = Spacing^2
  float Spacing = 0.0f;    // square root of the area per point
  float Reach = 0.0f;      // distance to the neighbour of rank ReachRank
  float Flatness = 0.0f;   // variance along the normal over the smaller tangential one; 0 = plane
  bool Degenerate = false; // too few neighbours, or all on a line
  bool Isolated = false;
  bool Given = false; // the normal was given, not fitted
};

/// Neighbours per point that are kept, nearest first, and how many of them make the graph over
/// which signs are propagated.
constexpr int KeptNeighbors = 20;
constexpr int GraphDegree = 12;

/// [KeptNeighbors * n] ids, -1 where there are fewer.
struct NeighborGraph
{
  std::vector<int> Ids;
  bool AreNearest = false; ///< a row holds the KeptNeighbors nearest ones, or all there are

  const int* Row(size_t i) const { return this->Ids.data() + KeptNeighbors * i; }
  int* Row(size_t i) { return this->Ids.data() + KeptNeighbors * i; }
};

/// The neighbour whose distance tells whether a point is far from everything.
constexpr int ReachRank = 6;

/// Whether two points whose difference is d can be of one sheet: normals that agree (up to sign
/// where eitherTwoSided), and an edge that does not climb out of the tangent plane.
bool AreOfOneSheet(const PlaneFit& a, const PlaneFit& b, bool eitherTwoSided, const Vector3& d);

/// Fits all points. `given`: [3n] normals, (0, 0, 0) where a point has none; empty = none at all.
/// Returns false if stopped.
bool FitSurfels(const LocalCloud& cloud, const NeighborSearch& tree, const FitSettings& settings,
  const std::vector<float>& given, const StageProgress& monitor, std::vector<PlaneFit>& fits,
  NeighborGraph& graph);

/// Measures spacing and extent again, from neighbours on the same sheet only, where the normals
/// (now known, and turned) say that the neighbours are of more than one: both sides of a thin
/// plate, or where surfaces cross. Without it the points of the other sheet count as density.
/// Returns false if stopped.
bool RefineExtents(const LocalCloud& cloud, const NeighborSearch& tree, const FitSettings& settings,
  const std::vector<unsigned char>& twoSided, const NeighborGraph& graph,
  const StageProgress& monitor, std::vector<PlaneFit>& fits);
}
