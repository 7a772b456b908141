// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Common/NeighborSearch.h"

#include <flann/algorithms/dist.h>
#include <flann/algorithms/kdtree_single_index.h>
#include <pcl/search/impl/search.hpp> // an instance of ours: pcl_search would bring FLANN again

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace SurfelGeometry
{
namespace
{
using Index = flann::KDTreeSingleIndex<flann::L2_3D<float>>;

/// Points per leaf of the tree: the fastest of 8, 15, 24 and 32.
constexpr int LeafSize = 24;

constexpr float Unbounded = std::numeric_limits<float>::max();

/// Number of points that a search within a radius asks for first.
constexpr int FirstWanted = 64;

/// Distances are not negative: as integers, their bits are in the same order.
std::uint64_t KeyOf(float squaredDistance, int id)
{
  std::uint32_t bits;
  std::memcpy(&bits, &squaredDistance, sizeof bits);
  return static_cast<std::uint64_t>(bits) << 32 | static_cast<std::uint32_t>(id);
}

int IdOf(std::uint64_t key)
{
  return static_cast<int>(key & 0xffffffffu);
}

float SquaredDistanceOf(std::uint64_t key)
{
  const auto bits = static_cast<std::uint32_t>(key >> 32);
  float result;
  std::memcpy(&result, &bits, sizeof result);
  return result;
}

void CopyFound(const std::vector<std::uint64_t>& found, int count, pcl::Indices& ids,
  std::vector<float>& squaredDistances)
{
  ids.resize(count);
  squaredDistances.resize(count);
  std::transform(found.begin(), found.begin() + count, ids.begin(), IdOf);
  std::transform(found.begin(), found.begin() + count, squaredDistances.begin(), SquaredDistanceOf);
}
}

struct NeighborSearch::Tree
{
  const float* Positions;
  int Count;
  std::unique_ptr<Index> Search; // null: no points
};

/// The nearest points within a reach, sorted by insertion.
class NeighborSearch::Result final : public flann::ResultSet<float>
{
public:
  Result(std::vector<std::uint64_t>& found, int wanted, float squaredReach)
    : Found(found)
    , Wanted(wanted)
    , Reach(squaredReach)
  {
    found.resize(wanted);
  }

  int Count() const { return this->Number; }

  bool full() const override { return this->Number == this->Wanted; }

  float worstDist() const override { return this->Reach; }

  void addPoint(float squaredDistance, size_t id) override
  {
    const std::uint64_t key = KeyOf(squaredDistance, static_cast<int>(id));
    std::uint64_t* found = this->Found.data();
    if (this->full() && key >= found[this->Wanted - 1])
    {
      return; // FLANN reads the reach once per leaf, before its points
    }
    int k = this->Number < this->Wanted ? this->Number++ : this->Wanted - 1;
    for (; k > 0 && found[k - 1] > key; --k)
    {
      found[k] = found[k - 1];
    }
    found[k] = key;
    if (this->full())
    {
      this->Reach = std::min(this->Reach, SquaredDistanceOf(found[this->Wanted - 1]));
    }
  }

private:
  std::vector<std::uint64_t>& Found;
  int Wanted;
  int Number = 0;
  float Reach;
};

NeighborSearch::NeighborSearch(const float* positions, int count)
  : Search("FLANN", true)
  , Implementation(new Tree{ positions, count, nullptr })
{
  if (count > 0)
  {
    const flann::Matrix<float> points(const_cast<float*>(positions), count, 3); // only read
    this->Implementation->Search.reset(new Index(points, flann::KDTreeSingleIndexParams(LeafSize)));
    this->Implementation->Search->buildIndex();
  }
}

NeighborSearch::~NeighborSearch() = default;

int NeighborSearch::Size() const
{
  return this->Implementation->Count;
}

/// Returns the number of points found; they stay in neighbors.Found.
int NeighborSearch::Query(
  const float* place, int wanted, float squaredReach, Neighbors& neighbors) const
{
  Result result(neighbors.Found, wanted, squaredReach);
  const flann::SearchParams exact(flann::FLANN_CHECKS_UNLIMITED, 0.0f);
  this->Implementation->Search->findNeighbors(result, place, exact);
  return result.Count();
}

void NeighborSearch::QueryPoint(int i, int wanted, float squaredReach, Neighbors& neighbors) const
{
  const float* place = this->Implementation->Positions + 3 * static_cast<size_t>(i);
  const int found = this->Query(place, wanted, squaredReach, neighbors);
  neighbors.Ids.resize(wanted);
  neighbors.SquaredDistances.resize(wanted);
  int count = 0;
  for (int k = 0; k < found; ++k)
  {
    const int id = IdOf(neighbors.Found[k]);
    neighbors.Ids[count] = id;
    neighbors.SquaredDistances[count] = SquaredDistanceOf(neighbors.Found[k]);
    count += id != i ? 1 : 0;
  }
  // Other points at squared distance 0 may have displaced i.
  count = std::min(count, wanted - 1);
  neighbors.Ids.resize(count);
  neighbors.SquaredDistances.resize(count);
}

/// An upper bound on the squared reach of a query: the last query's reach plus the distance from
/// its point to this one. Points that follow each other in the cloud are near each other.
float NeighborSearch::BoundOf(int i, int wanted, const Neighbors& neighbors) const
{
  if (neighbors.Last < 0 || wanted > neighbors.LastWanted)
  {
    return Unbounded;
  }
  const float* from = this->Implementation->Positions + 3 * static_cast<size_t>(neighbors.Last);
  const float* to = this->Implementation->Positions + 3 * static_cast<size_t>(i);
  const float x = to[0] - from[0], y = to[1] - from[1], z = to[2] - from[2];
  const float reach = neighbors.LastReach + std::sqrt(x * x + y * y + z * z);
  return 1.0001f * reach * reach; // for rounding errors
}

void NeighborSearch::FindNearest(int i, int count, Neighbors& neighbors) const
{
  const int wanted = std::min(count + 1, this->Size());
  const float bound = this->BoundOf(i, wanted, neighbors);
  this->QueryPoint(i, wanted, bound, neighbors);
  if (neighbors.Count() + 1 < wanted && bound < Unbounded)
  {
    this->QueryPoint(i, wanted, Unbounded, neighbors); // distances overflowed or underflowed
  }
  neighbors.Last = i;
  neighbors.LastWanted = neighbors.Count() + 1;
  neighbors.LastReach = neighbors.Count() > 0 ? std::sqrt(neighbors.SquaredDistances.back()) : 0.0f;
}

void NeighborSearch::FindWithin(int i, double radius, int limit, Neighbors& neighbors) const
{
  // The limit keeps a query in a dense cluster from returning the whole cloud.
  const int wanted = std::min(limit + 1, this->Size());
  this->QueryPoint(i, wanted, static_cast<float>(radius * radius), neighbors);
}

int NeighborSearch::nearestKSearch(const pcl::PointXYZ& place, int count, pcl::Indices& ids,
  std::vector<float>& squaredDistances) const
{
  Neighbors neighbors;
  const int wanted = std::min(count, this->Size());
  const int found = wanted > 0 ? this->Query(place.data, wanted, Unbounded, neighbors) : 0;
  CopyFound(neighbors.Found, found, ids, squaredDistances);
  return found;
}

int NeighborSearch::radiusSearch(const pcl::PointXYZ& place, double radius, pcl::Indices& ids,
  std::vector<float>& squaredDistances, unsigned int limit) const
{
  const int size = this->Size();
  const int most =
    limit > 0 && limit < static_cast<unsigned int>(size) ? static_cast<int>(limit) : size;
  const auto squaredReach = static_cast<float>(radius * radius);
  Neighbors neighbors;
  // The number is not known before: more are asked for until some place is left.
  int wanted = std::min(most, FirstWanted);
  int found = wanted > 0 ? this->Query(place.data, wanted, squaredReach, neighbors) : 0;
  while (found == wanted && wanted < most)
  {
    wanted = wanted < most / 4 ? 4 * wanted : most;
    found = this->Query(place.data, wanted, squaredReach, neighbors);
  }
  CopyFound(neighbors.Found, found, ids, squaredDistances);
  return found;
}
}
