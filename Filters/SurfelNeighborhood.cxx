// SPDX-License-Identifier: BSD-3-Clause
#include "SurfelNeighborhood.h"

#include <pcl/kdtree/kdtree_flann.h>
#include <pcl/point_types.h>

#include <algorithm>

namespace SurfelSplatting
{
struct SurfelNeighborhood::Tree
{
  pcl::PointCloud<pcl::PointXYZ>::Ptr Cloud;
  pcl::KdTreeFLANN<pcl::PointXYZ> Index;
};

namespace
{
/// Takes point i out of the answer to its own query, and at most `count` of the others.
void DropSelf(int i, int count, Neighbors& neighbors)
{
  const auto self = std::find(neighbors.Ids.begin(), neighbors.Ids.end(), i);
  if (self != neighbors.Ids.end())
  {
    const auto position = self - neighbors.Ids.begin();
    neighbors.Ids.erase(self);
    neighbors.SquaredDistances.erase(neighbors.SquaredDistances.begin() + position);
  }
  if (neighbors.Count() > count)
  {
    neighbors.Ids.resize(count);
    neighbors.SquaredDistances.resize(count);
  }
}
}

SurfelNeighborhood::SurfelNeighborhood(const float* positions, int count)
  : Implementation(new Tree)
{
  this->Implementation->Cloud.reset(new pcl::PointCloud<pcl::PointXYZ>);
  auto& points = this->Implementation->Cloud->points;
  points.resize(count);
  for (int i = 0; i < count; ++i)
  {
    const float* p = positions + 3 * static_cast<size_t>(i);
    points[i] = pcl::PointXYZ(p[0], p[1], p[2]);
  }
  this->Implementation->Cloud->width = static_cast<std::uint32_t>(count);
  this->Implementation->Cloud->height = 1;
  if (count > 0)
  {
    this->Implementation->Index.setInputCloud(this->Implementation->Cloud);
  }
}

SurfelNeighborhood::~SurfelNeighborhood() = default;

int SurfelNeighborhood::Size() const
{
  return static_cast<int>(this->Implementation->Cloud->size());
}

void SurfelNeighborhood::FindNearest(int i, int count, Neighbors& neighbors) const
{
  const int wanted = std::min(count + 1, this->Size());
  this->Implementation->Index.nearestKSearch(
    this->Implementation->Cloud->points[i], wanted, neighbors.Ids, neighbors.SquaredDistances);
  DropSelf(i, count, neighbors);
}

void SurfelNeighborhood::FindWithin(int i, double radius, int limit, Neighbors& neighbors) const
{
  // A bound on the count keeps dense clusters from answering with the whole cloud.
  const int wanted = std::min(limit + 1, this->Size());
  this->Implementation->Index.radiusSearch(this->Implementation->Cloud->points[i], radius,
    neighbors.Ids, neighbors.SquaredDistances, static_cast<unsigned int>(wanted));
  DropSelf(i, limit, neighbors);
}
}
