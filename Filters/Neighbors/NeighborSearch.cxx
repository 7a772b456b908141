// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Neighbors/NeighborSearch.h"

#include "Filters/Common/ParallelFor.h"

#include <flann/algorithms/dist.h>
#include <flann/algorithms/kdtree_single_index.h>
#include <pcl/search/impl/search.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace SurfelGeometry
{
namespace
{
/// FLANN's tree, less its pointers to the points, of which it has copies: 8 of its 29 bytes a
/// point.
class Index : public flann::KDTreeSingleIndex<flann::L2_3D<float>>
{
public:
  using KDTreeSingleIndex::KDTreeSingleIndex;

  void Build()
  {
    this->buildIndex();
    using Base = flann::NNIndex<flann::L2_3D<float>>;
    std::vector<float*>().swap(this->Base::points_);
  }
};

/// Points per leaf of the tree: the fastest of 8, 15, 24 and 32.
constexpr int LeafSize = 24;

constexpr float Unbounded = std::numeric_limits<float>::max();

/// FLANN builds a tree with one thread. So a cloud has several: of this many points at least, in
/// their order, so that points of one tree are near each other; and at most so many.
constexpr int LeastPerTree = 1 << 17;
constexpr int MostTrees = 8;

/// Number of points that a search within a radius asks for first.
constexpr int FirstWanted = 64;

/// One query of the tree serves so many points that follow each other, as long as they are in a
/// ball of this many usual reaches: the fastest of 8, 16 and 24, and of 0.6 and 0.8.
constexpr int GroupSize = 16;
constexpr float GroupRadius = 0.8f;

/// The usual reach is a running mean: that of a single point of a random sampling varies by a
/// tenth. This is the share of the last point.
constexpr float LastShare = 0.2f;

/// The reach of the next points, over the usual one, for which such a query suffices; and for which
/// no second attempt is needed.
constexpr float ReachGrowth = 1.25f, LikelyGrowth = 1.1f;

/// Such a query gives up at this many times the wanted points: the density has changed.
constexpr std::size_t MostNearby = 16;

void CopyFound(const std::vector<std::uint64_t>& found, int count, pcl::Indices& ids,
  std::vector<float>& squaredDistances)
{
  ids.resize(count);
  squaredDistances.resize(count);
  std::transform(found.begin(), found.begin() + count, ids.begin(), IdOf);
  std::transform(found.begin(), found.begin() + count, squaredDistances.begin(), SquaredDistanceOf);
}
}

/// The points from First to Last, and a box about them.
struct NeighborSearch::Tree
{
  int First, Last;
  float Lower[3], Upper[3];
  std::unique_ptr<Index> Search;

  void Build(const float* positions)
  {
    const float* begin = positions + 3 * static_cast<size_t>(this->First);
    for (int c = 0; c < 3; ++c)
    {
      this->Lower[c] = this->Upper[c] = begin[c];
      for (size_t i = c; i < 3 * static_cast<size_t>(this->Last - this->First); i += 3)
      {
        this->Lower[c] = std::min(this->Lower[c], begin[i]);
        this->Upper[c] = std::max(this->Upper[c], begin[i]);
      }
    }
    const flann::Matrix<float> points(const_cast<float*>(begin), this->Last - this->First, 3);
    this->Search.reset(new Index(points, flann::KDTreeSingleIndexParams(LeafSize)));
    this->Search->Build(); // only reads the points
  }

  /// A lower bound on the squared distance from a place, with rounding errors allowed for.
  float SquaredDistance(const float* place) const
  {
    float sum = 0.0f;
    for (int c = 0; c < 3; ++c)
    {
      const float d = std::max({ 0.0f, this->Lower[c] - place[c], place[c] - this->Upper[c] });
      sum += d * d;
    }
    return 0.9999f * sum;
  }
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

  /// The id of the first point of the tree that is searched next.
  void SetFirst(int first) { this->First = first; }

  bool full() const override { return this->Number == this->Wanted; }

  float worstDist() const override { return this->Reach; }

  void addPoint(float squaredDistance, size_t id) override
  {
    const std::uint64_t key = KeyOf(squaredDistance, this->First + static_cast<int>(id));
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
      // FLANN leaves out points at the reach: those as far as the last one may have lower ids. So
      // the reach is the next larger float.
      const std::uint64_t next = found[this->Wanted - 1] + (std::uint64_t{ 1 } << 32);
      this->Reach = std::min(this->Reach, SquaredDistanceOf(next));
    }
  }

private:
  std::vector<std::uint64_t>& Found;
  int Wanted;
  int Number = 0;
  int First = 0;
  float Reach;
};

/// All points within a reach.
class NeighborSearch::Collection final : public flann::ResultSet<float>
{
public:
  Collection(NearbyPoints& points, const float* positions, float reach, std::size_t most)
    : Points(points)
    , Positions(positions)
    , SquaredReach(reach * reach)
    , Most(most)
  {
  }

  void SetFirst(int first) { this->First = first; }

  bool full() const override { return true; }

  float worstDist() const override { return this->SquaredReach; }

  void addPoint(float /*squaredDistance*/, size_t id) override
  {
    if (this->Points.Size() < this->Most)
    {
      const std::size_t point = this->First + id;
      this->Points.Add(static_cast<int>(point), this->Positions + 3 * point);
    }
    else
    {
      this->Points.Forget();
      this->SquaredReach = 0.0f; // ends the search
    }
  }

private:
  NearbyPoints& Points;
  const float* Positions;
  float SquaredReach;
  std::size_t Most;
  std::size_t First = 0;
};

NeighborSearch::NeighborSearch(const float* positions, int count)
  : Search("FLANN", true)
  , Positions(positions)
  , Count(count)
  , Trees(count > 0 ? std::clamp(count / LeastPerTree, 1, MostTrees) : 0)
{
  const auto trees = static_cast<vtkIdType>(this->Trees.size());
  ParallelFor(0, trees, 1, [&](vtkIdType k, vtkIdType end) {
    for (; k < end; ++k)
    {
      Tree& tree = this->Trees[k];
      tree.First = static_cast<int>(k * count / trees);
      tree.Last = static_cast<int>((k + 1) * count / trees);
      tree.Build(positions);
    }
  });
}

NeighborSearch::~NeighborSearch() = default;

/// Returns the number of points found; they stay in neighbors.Found.
/// @param first the tree that is searched first, best the one that has the nearest points
int NeighborSearch::Query(
  const float* place, size_t first, int wanted, float squaredReach, Neighbors& neighbors) const
{
  Result result(neighbors.Found, wanted, squaredReach);
  this->SearchTrees(place, first, result);
  return result.Count();
}

template <typename Results>
void NeighborSearch::SearchTrees(const float* place, size_t first, Results& results) const
{
  const flann::SearchParams exact(flann::FLANN_CHECKS_UNLIMITED, 0.0f);
  const size_t trees = this->Trees.size();
  for (size_t k = 0; k < trees; ++k)
  {
    const Tree& tree = this->Trees[(first + k) % trees];
    if (tree.SquaredDistance(place) <= results.worstDist())
    {
      results.SetFirst(tree.First);
      tree.Search->findNeighbors(results, place, exact);
    }
  }
}

std::size_t NeighborSearch::NearestTree(const float* place) const
{
  const auto nearer = [place](const Tree& a, const Tree& b) {
    return a.SquaredDistance(place) < b.SquaredDistance(place);
  };
  return static_cast<size_t>(
    std::min_element(this->Trees.begin(), this->Trees.end(), nearer) - this->Trees.begin());
}

std::size_t NeighborSearch::TreeOf(int i) const
{
  const auto isBefore = [](int id, const Tree& tree) { return id < tree.Last; };
  const auto own = std::upper_bound(this->Trees.begin(), this->Trees.end(), i, isBefore);
  return static_cast<size_t>(own - this->Trees.begin());
}

void NeighborSearch::QueryPoint(int i, int wanted, float squaredReach, Neighbors& neighbors) const
{
  const float* place = this->Positions + 3 * static_cast<size_t>(i);
  Take(i, wanted, this->Query(place, this->TreeOf(i), wanted, squaredReach, neighbors), neighbors);
}

/// Copies the points that were found, without i.
void NeighborSearch::Take(int i, int wanted, int found, Neighbors& neighbors)
{
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

/// Finds the points about point i and those that follow it.
void NeighborSearch::GatherNearby(int i, int wanted, Neighbors& neighbors) const
{
  const float* position = this->Positions + 3 * static_cast<size_t>(i);
  float lower[3], upper[3], center[3];
  std::copy_n(position, 3, lower);
  std::copy_n(position, 3, upper);
  float radius = 0.0f;
  int end = i + 1;
  for (; end < std::min(i + GroupSize, this->Count); ++end)
  {
    const float* next = this->Positions + 3 * static_cast<size_t>(end);
    float squared = 0.0f;
    for (int c = 0; c < 3; ++c)
    {
      const float extent = std::max(upper[c], next[c]) - std::min(lower[c], next[c]);
      squared += 0.25f * extent * extent;
    }
    if (squared > GroupRadius * GroupRadius * neighbors.UsualReach * neighbors.UsualReach)
    {
      break;
    }
    radius = std::sqrt(squared);
    for (int c = 0; c < 3; ++c)
    {
      lower[c] = std::min(lower[c], next[c]);
      upper[c] = std::max(upper[c], next[c]);
    }
  }
  for (int c = 0; c < 3; ++c)
  {
    center[c] = 0.5f * (lower[c] + upper[c]);
  }
  const float reach = ReachGrowth * neighbors.UsualReach + radius;
  neighbors.Nearby.Begin(center, reach);
  Collection points(neighbors.Nearby, this->Positions, reach, MostNearby * wanted);
  this->SearchTrees(center, this->TreeOf(i), points);
  neighbors.NearbyEnd = end;
}

/// Tries to answer a query by the points about one before it.
bool NeighborSearch::FindNearby(int i, int wanted, Neighbors& neighbors) const
{
  // Only for points in their order, some of which may be left out, and after one query that tells
  // the reach.
  if (neighbors.Last < 0 || i <= neighbors.Last || i > neighbors.Last + GroupSize ||
    wanted != neighbors.LastWanted)
  {
    neighbors.NearbyEnd = -1;
    return false;
  }
  if (i >= neighbors.NearbyEnd)
  {
    this->GatherNearby(i, wanted, neighbors);
  }
  const float* place = this->Positions + 3 * static_cast<size_t>(i);
  const float likely = LikelyGrowth * neighbors.UsualReach;
  if (!neighbors.Nearby.FindNearest(place, wanted, likely * likely, neighbors.Found))
  {
    return false;
  }
  Take(i, wanted, wanted, neighbors);
  return true;
}

/// An upper bound on the squared reach of a query: the last query's reach plus the distance from
/// its point to this one. Points that follow each other in the cloud are near each other.
float NeighborSearch::BoundOf(int i, int wanted, const Neighbors& neighbors) const
{
  if (neighbors.Last < 0 || wanted > neighbors.LastWanted)
  {
    return Unbounded;
  }
  const float* from = this->Positions + 3 * static_cast<size_t>(neighbors.Last);
  const float* to = this->Positions + 3 * static_cast<size_t>(i);
  const float x = to[0] - from[0], y = to[1] - from[1], z = to[2] - from[2];
  const float reach = neighbors.LastReach + std::sqrt(x * x + y * y + z * z);
  return 1.0001f * reach * reach; // for rounding errors
}

void NeighborSearch::FindNearest(int i, int count, Neighbors& neighbors) const
{
  const int wanted = std::min(count + 1, this->Size());
  if (!this->FindNearby(i, wanted, neighbors))
  {
    const float bound = this->BoundOf(i, wanted, neighbors);
    this->QueryPoint(i, wanted, bound, neighbors);
    if (neighbors.Count() + 1 < wanted && bound < Unbounded)
    {
      this->QueryPoint(i, wanted, Unbounded, neighbors); // distances overflowed or underflowed
    }
  }
  const bool isFirst = neighbors.Last < 0;
  neighbors.Last = i;
  neighbors.LastWanted = neighbors.Count() + 1;
  neighbors.LastReach = neighbors.Count() > 0 ? std::sqrt(neighbors.SquaredDistances.back()) : 0.0f;
  neighbors.UsualReach = isFirst
    ? neighbors.LastReach
    : neighbors.UsualReach + LastShare * (neighbors.LastReach - neighbors.UsualReach);
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
  const int found = wanted > 0
    ? this->Query(place.data, this->NearestTree(place.data), wanted, Unbounded, neighbors)
    : 0;
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
  int found = wanted > 0 ? this->Query(place.data, 0, wanted, squaredReach, neighbors) : 0;
  while (found == wanted && wanted < most)
  {
    wanted = wanted < most / 4 ? 4 * wanted : most;
    found = this->Query(place.data, 0, wanted, squaredReach, neighbors);
  }
  CopyFound(neighbors.Found, found, ids, squaredDistances);
  return found;
}
}
