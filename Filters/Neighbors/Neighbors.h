// SPDX-License-Identifier: BSD-3-Clause
/**
 * What NeighborSearch finds: the neighbours of a point. For those that need only these, the headers
 * of PCL, whose base class the search has, would take most of the time of the compiler.
 */
#pragma once

#include "Filters/Neighbors/NearbyPoints.h"

#include <cstdint>
#include <vector>

namespace SurfelGeometry
{
/// Result of a query, nearest first; points at equal distance by id. Each thread reuses one.
struct Neighbors
{
  std::vector<int> Ids;
  std::vector<float> SquaredDistances; // world units squared

  int Count() const { return static_cast<int>(this->Ids.size()); }

private:
  friend class NeighborSearch;
  std::vector<std::uint64_t> Found; // (squared distance, id)
  int Last = -1;                    // point of the last query for the nearest ones, or -1
  int LastWanted = 0;
  float LastReach = 0.0f;
  float UsualReach = 0.0f; // of the points so far
  NearbyPoints Nearby;     // of the points before NearbyEnd
  int NearbyEnd = -1;
};
}
