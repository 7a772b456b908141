// SPDX-License-Identifier: BSD-3-Clause
/**
 * Nearest neighbours in a cloud by FLANN's k-d tree, whose headers only the source file includes.
 * It is the tree inside PCL's KdTreeFLANN, without PCL's two copies of the points and its
 * allocations for each query (Documentation/Performance.md).
 */
#pragma once

#include <cstdint>
#include <memory>
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
};

/// Queries are const and may run in parallel; their results do not depend on the threads.
class NeighborSearch
{
public:
  /// positions: [3 count], finite; they must outlive this object.
  NeighborSearch(const float* positions, int count);
  ~NeighborSearch();
  NeighborSearch(const NeighborSearch&) = delete;
  NeighborSearch& operator=(const NeighborSearch&) = delete;

  int Size() const;

  /// The `count` points nearest to point i, without i itself; fewer if the cloud is smaller.
  void FindNearest(int i, int count, Neighbors& neighbors) const;

  /// The points within `radius` of point i, without i itself; at most the `limit` nearest.
  void FindWithin(int i, double radius, int limit, Neighbors& neighbors) const;

private:
  struct Tree;
  class Result;

  void Search(int i, int wanted, float squaredReach, Neighbors& neighbors) const;
  float BoundOf(int i, int wanted, const Neighbors& neighbors) const;

  std::unique_ptr<Tree> Implementation;
};
}
