// SPDX-License-Identifier: BSD-3-Clause
/**
 * The stored neighbours of a cloud, which several steps use: one query serves them all.
 */
#pragma once

#include <cstddef>
#include <vector>

namespace SurfelGeometry
{
/// Number of neighbours stored for each point, and number of these that are edges of the graph for
/// sign propagation.
constexpr int KeptNeighbors = 20;
constexpr int GraphDegree = 12;

/// The stored neighbours of all points, nearest first.
struct NeighborGraph
{
  std::vector<int> Ids;    // [KeptNeighbors * n], -1 where a point has fewer
  bool AreNearest = false; // rows have the nearest points; else those within a radius

  const int* Row(size_t i) const { return this->Ids.data() + KeptNeighbors * i; }
  int* Row(size_t i) { return this->Ids.data() + KeptNeighbors * i; }
};

/// What the estimation knows about the points of its output.
struct SurfelNeighbors
{
  NeighborGraph Graph;    // empty: unknown
  std::vector<int> Order; // [n] index in the graph of each point of the output
};
}
