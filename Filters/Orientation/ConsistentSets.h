// SPDX-License-Identifier: BSD-3-Clause
/**
 * Sets of points whose normals have consistent signs: patches, and the components made of them.
 */
#pragma once

#include "Filters/Orientation/OrientationGraph.h"

#include <vector>

namespace SurfelGeometry
{
/// The sets of a union-find, numbered by their first points.
struct ConsistentSets
{
  std::vector<int> Ids;    // [n] points, one set after another, ascending in each
  std::vector<int> Starts; // [Count() + 1] in Ids

  int Count() const { return static_cast<int>(this->Starts.size()) - 1; }
  int Size(int set) const { return this->Starts[set + 1] - this->Starts[set]; }
  const int* Begin(int set) const { return this->Ids.data() + this->Starts[set]; }
};

/// @param count of points
/// @param signs flattened
ConsistentSets CollectSets(int count, ParityUnionFind& signs);

/// Share of the votes within a set that contradict its signs; 1 if there are none.
double ConflictOf(const NeighborGraph& graph, const EdgeVotes& edges, const ParityUnionFind& signs,
  const int* ids, int count);
}
