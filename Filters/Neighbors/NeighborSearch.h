// SPDX-License-Identifier: BSD-3-Clause
/**
 * Nearest neighbours in a cloud by FLANN's k-d tree, whose headers only the source file includes.
 * It is the tree inside pcl::KdTreeFLANN, without PCL's two copies of the points and its
 * allocations for each query (Documentation/Performance.md), and with answers that do not depend on
 * the order of ties. PCL's filters and features take it as their search method.
 */
#pragma once

#include "Filters/Neighbors/Neighbors.h"

#include <pcl/point_types.h>
#include <pcl/search/search.h>

#include <cstddef>
#include <vector>

namespace SurfelGeometry
{
/// Queries are const and may run in parallel; their results do not depend on the threads.
class NeighborSearch : public pcl::search::Search<pcl::PointXYZ>
{
public:
  /// positions: [3 count], finite; they must outlive this object.
  NeighborSearch(const float* positions, int count);
  ~NeighborSearch() override;
  NeighborSearch(const NeighborSearch&) = delete;
  NeighborSearch& operator=(const NeighborSearch&) = delete;

  int Size() const { return this->Count; }

  /// The `count` points nearest to point i, without i itself; fewer if the cloud is smaller.
  void FindNearest(int i, int count, Neighbors& neighbors) const;

  /// The points within `radius` of point i, without i itself; at most the `limit` nearest.
  void FindWithin(int i, double radius, int limit, Neighbors& neighbors) const;

  ///@{
  /// PCL's queries, for any place and for a point of the cloud. An answer contains that point, and
  /// is sorted. The cloud that PCL sets must have the same points in the same order.
  using Search::nearestKSearch;
  using Search::radiusSearch;
  int nearestKSearch(const pcl::PointXYZ& place, int count, pcl::Indices& ids,
    std::vector<float>& squaredDistances) const override;
  int radiusSearch(const pcl::PointXYZ& place, double radius, pcl::Indices& ids,
    std::vector<float>& squaredDistances, unsigned int limit = 0) const override;
  ///@}

private:
  struct Tree;
  class Result;
  class Collection;

  int Query(const float* place, std::size_t first, int wanted, float squaredReach,
    Neighbors& neighbors) const;
  std::size_t NearestTree(const float* place) const;
  template <typename Results>
  void SearchTrees(const float* place, std::size_t first, Results& results) const;
  std::size_t TreeOf(int i) const;
  void QueryPoint(int i, int wanted, float squaredReach, Neighbors& neighbors) const;
  void GatherNearby(int i, int wanted, Neighbors& neighbors) const;
  bool FindNearby(int i, int wanted, Neighbors& neighbors) const;
  static void Take(int i, int wanted, int found, Neighbors& neighbors);
  float BoundOf(int i, int wanted, const Neighbors& neighbors) const;

  const float* Positions;
  int Count;
  std::vector<Tree> Trees;
};
}
