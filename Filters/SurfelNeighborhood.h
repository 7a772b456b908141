// SPDX-License-Identifier: BSD-3-Clause
/**
 * Nearest neighbours in a cloud: PCL's KdTreeFLANN behind a wall, so that its headers stay in
 * one source file.
 */
#pragma once

#include <memory>
#include <vector>

namespace SurfelSplatting
{
/// Answer of a query, nearest first. One per thread, reused.
struct Neighbors
{
  std::vector<int> Ids;
  std::vector<float> SquaredDistances; // world units squared

  int Count() const { return static_cast<int>(this->Ids.size()); }
};

/// Queries are const and may run in parallel; their answers do not depend on the threads.
class SurfelNeighborhood
{
public:
  /// positions: [3 count], finite, kept by the caller as long as this object.
  SurfelNeighborhood(const float* positions, int count);
  ~SurfelNeighborhood();
  SurfelNeighborhood(const SurfelNeighborhood&) = delete;
  SurfelNeighborhood& operator=(const SurfelNeighborhood&) = delete;

  int Size() const;

  /// The `count` points nearest to point i, without i itself; fewer if there are not as many.
  void FindNearest(int i, int count, Neighbors& neighbors) const;

  /// The points within `radius` of point i, without i itself, at most the `limit` nearest.
  void FindWithin(int i, double radius, int limit, Neighbors& neighbors) const;

private:
  struct Tree;
  std::unique_ptr<Tree> Implementation;
};
}
