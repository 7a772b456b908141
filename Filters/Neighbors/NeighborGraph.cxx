// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Neighbors/NeighborGraph.h"

#include "Filters/Common/ParallelFor.h"
#include "Filters/Neighbors/NeighborSearch.h"

#include <algorithm>
#include <cstdint>

#ifdef __linux__
#include <sys/mman.h>
#include <unistd.h>
#endif

namespace SurfelGeometry
{
namespace
{
constexpr int Dropped = -1;

/// Index of each point among those that are left, or Dropped.
std::vector<int> RankKept(const std::vector<unsigned char>& dropped)
{
  std::vector<int> ranks(dropped.size(), Dropped);
  int next = 0;
  for (size_t i = 0; i < dropped.size(); ++i)
  {
    if (!dropped[i])
    {
      ranks[i] = next++;
    }
  }
  return ranks;
}

void DropPoints(const std::vector<int>& ranks, LocalCloud& cloud)
{
  size_t kept = 0;
  for (size_t i = 0; i < ranks.size(); ++i)
  {
    if (ranks[i] != Dropped)
    {
      cloud.InputIds[kept] = cloud.InputIds[i];
      std::copy_n(cloud.Positions.begin() + 3 * i, 3, cloud.Positions.begin() + 3 * kept);
      ++kept;
    }
  }
  cloud.InputIds.resize(kept);
  cloud.Positions.resize(3 * kept);
}

/// Returns the rows, by their new indices, that had dropped points.
std::vector<int> DropRows(const std::vector<int>& ranks, NeighborGraph& graph)
{
  std::vector<int> broken;
  for (size_t i = 0; i < ranks.size(); ++i)
  {
    if (ranks[i] == Dropped)
    {
      continue;
    }
    const int* from = graph.Row(i);
    int* to = graph.Row(ranks[i]); // at or before `from`
    bool isWhole = true;
    for (int k = 0; k < KeptNeighbors; ++k)
    {
      const int neighbor = from[k] >= 0 ? ranks[from[k]] : -1;
      isWhole = isWhole && (from[k] < 0 || neighbor != Dropped);
      to[k] = neighbor;
    }
    if (!isWhole)
    {
      broken.push_back(ranks[i]);
    }
  }
  return broken;
}
}

void NeighborGraph::Keep(size_t i, const Neighbors& neighbors)
{
  const int count = std::min(KeptNeighbors, neighbors.Count());
  int* row = this->Row(i);
  std::copy_n(neighbors.Ids.begin(), count, row);
  std::fill(row + count, row + KeptNeighbors, -1);
}

void NeighborGraph::Release(size_t begin, size_t end)
{
#ifdef __linux__
  const auto page = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
  const auto first = reinterpret_cast<std::uintptr_t>(this->Row(begin));
  const auto last = reinterpret_cast<std::uintptr_t>(this->Row(end)) / page * page;
  // The page that two calls share goes with the second one; the very first may be others' too.
  const std::uintptr_t from = (begin > 0 ? first : first + page - 1) / page * page;
  if (from < last)
  {
    madvise(reinterpret_cast<void*>(from), last - from, MADV_DONTNEED);
  }
#else
  static_cast<void>(begin);
  static_cast<void>(end);
#endif
}

void NeighborGraph::Get(const LocalCloud& cloud, int i, int count, Neighbors& neighbors) const
{
  const int* row = this->Row(i);
  const int found = CountIds(row, std::min(count, KeptNeighbors));
  neighbors.Ids.assign(row, row + found);
  neighbors.SquaredDistances.resize(found);
  const float* p = cloud.Position(i);
  for (int k = 0; k < found; ++k)
  {
    const float* q = cloud.Position(row[k]);
    const float x = q[0] - p[0], y = q[1] - p[1], z = q[2] - p[2];
    neighbors.SquaredDistances[k] = x * x + y * y + z * z;
  }
}

SearchedCloud::SearchedCloud() = default;
SearchedCloud::~SearchedCloud() = default;
SearchedCloud::SearchedCloud(SearchedCloud&& other) noexcept = default;
SearchedCloud& SearchedCloud::operator=(SearchedCloud&& other) noexcept = default;

void SearchedCloud::Index()
{
  this->Tree = std::make_unique<NeighborSearch>(this->Cloud.Positions.data(), this->Cloud.Size());
}

void SearchedCloud::ReleaseTree()
{
  this->Tree.reset();
}

void SearchedCloud::Find(int i, int count, Neighbors& neighbors) const
{
  if (!this->Graph.Ids.empty() && count <= KeptNeighbors)
  {
    this->Graph.Get(this->Cloud, i, count, neighbors);
  }
  else
  {
    this->Tree->FindNearest(i, count, neighbors);
  }
}

const int* SearchedCloud::FindIds(int i, int count, Neighbors& neighbors, int& found) const
{
  if (!this->Graph.Ids.empty() && count <= KeptNeighbors)
  {
    const int* row = this->Graph.Row(static_cast<size_t>(i));
    found = CountIds(row, count);
    return row;
  }
  this->Tree->FindNearest(i, count, neighbors);
  found = neighbors.Count();
  return neighbors.Ids.data();
}

bool SearchedCloud::FindNeighbors(const StageProgress& progress)
{
  this->Graph.Ids.resize(KeptNeighbors * static_cast<size_t>(this->Cloud.Size()));
  this->Graph.AreNearest = true;
  return ParallelFor(this->Cloud.Size(), progress, [this](vtkIdType begin, vtkIdType end) {
    Neighbors neighbors;
    for (vtkIdType i = begin; i < end; ++i)
    {
      this->Tree->FindNearest(static_cast<int>(i), KeptNeighbors, neighbors);
      this->Graph.Keep(i, neighbors);
    }
  });
}

void SearchedCloud::FindAround(
  const std::function<Vector3(int)>& placeOf, const std::function<double(int)>& limitOf)
{
  ParallelFor(0, this->Cloud.Size(), [&](vtkIdType begin, vtkIdType end) {
    Neighbors found;
    for (int i = static_cast<int>(begin); i < end; ++i)
    {
      const Vector3 place = placeOf(i), way = place - Load(this->Cloud.Position(i));
      const double limit = limitOf(i);
      if (!(Dot(way, way) > limit * limit))
      {
        continue;
      }
      pcl::PointXYZ at;
      Store(place, at.data);
      this->Tree->nearestKSearch(at, KeptNeighbors + 1, found.Ids, found.SquaredDistances);
      found.Ids.erase(std::remove(found.Ids.begin(), found.Ids.end(), i), found.Ids.end());
      this->Graph.Keep(static_cast<size_t>(i), found);
    }
  });
}

void SearchedCloud::Drop(const std::vector<unsigned char>& dropped)
{
  const std::vector<int> ranks = RankKept(dropped);
  DropPoints(ranks, this->Cloud);
  this->Index();
  if (this->Graph.Ids.empty())
  {
    return;
  }
  const std::vector<int> broken = DropRows(ranks, this->Graph);
  this->Graph.Ids.resize(KeptNeighbors * static_cast<size_t>(this->Cloud.Size()));
  ParallelFor(0, static_cast<vtkIdType>(broken.size()), [&](vtkIdType begin, vtkIdType end) {
    Neighbors neighbors;
    for (vtkIdType k = begin; k < end; ++k)
    {
      this->Tree->FindNearest(broken[k], KeptNeighbors, neighbors);
      this->Graph.Keep(broken[k], neighbors);
    }
  });
}

RawVector<int> SurfelNeighbors::InputRanks() const
{
  RawVector<int> ranks(this->Order.size());
  ParallelFor(0, static_cast<vtkIdType>(ranks.size()), [&](vtkIdType id, vtkIdType end) {
    for (; id < end; ++id)
    {
      ranks[this->Order[id]] = static_cast<int>(id);
    }
  });
  return ranks;
}
}
