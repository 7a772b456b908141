// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Cleaning/SurfaceDensity.h"

#include "Filters/Cleaning/CleaningProblem.h"
#include "Filters/Common/Median.h"
#include "Filters/Common/ParallelFor.h"
#include "Filters/Neighbors/NeighborSearch.h"

#include <algorithm>
#include <cstddef>
#include <iterator>

namespace SurfelGeometry
{
namespace
{
/// Points are near each other, and far from the others, if the distance of a neighbour is this many
/// times that of the one before; of at least this many.
constexpr double ApartFactor = 1.7;
constexpr size_t LeastApart = 3;

/// About this many points tell what is usual in the cloud. Those of them whose neighbours are in a
/// plane, as are most neighbours' own, tell how dense surfaces are about a place.
constexpr double DensitySamples = 1 << 15;
constexpr int SurfaceNeighbors = 9;

/// Whether a point and some of its neighbours are near each other, and far from the others: these
/// make their set look flat, whatever it is. On surfaces the distances of neighbours grow as the
/// root of their rank, on wires in proportion to it.
/// @param neighbors the nearest first
bool AreApart(const Neighbors& neighbors)
{
  const auto& squared = neighbors.SquaredDistances;
  for (size_t k = LeastApart; k < squared.size(); ++k)
  {
    if (squared[k] > ApartFactor * ApartFactor * squared[k - 1])
    {
      return true;
    }
  }
  return false;
}
}

bool IsFlat(const SearchedCloud& searched, int i, Neighbors& neighbors, NearCloud& near)
{
  searched.Find(i, StrayNeighbors, neighbors);
  LoadNear(searched.Cloud, i, neighbors, near);
  return !AreApart(neighbors) && !FillsSpaceAround(VariancesOf(near));
}

FlatPoints::FlatPoints(const SearchedCloud& searched)
  : Searched(searched)
  , Known(static_cast<size_t>(searched.Cloud.Size()))
{
}

bool FlatPoints::IsOnSurface(int i)
{
  if (!this->IsFlat(i))
  {
    return false;
  }
  Neighbors neighbors;
  this->Searched.Find(i, StrayNeighbors, neighbors);
  const std::vector<int>& ids = neighbors.Ids;
  const auto flat =
    std::count_if(ids.begin(), ids.end(), [this](int j) { return this->IsFlat(j); });
  NearCloud near;
  LoadNear(this->Searched.Cloud, i, neighbors, near);
  return 2 * flat > static_cast<std::ptrdiff_t>(ids.size()) && !IsBeside(SpreadOf(near));
}

bool FlatPoints::IsFlat(int i)
{
  std::atomic<unsigned char>& known = this->Known[static_cast<size_t>(i)];
  if (known.load(std::memory_order_relaxed) == Unknown)
  {
    Neighbors neighbors; // threads that ask at the same time find the same
    NearCloud near;
    const bool isFlat = SurfelGeometry::IsFlat(this->Searched, i, neighbors, near);
    known.store(isFlat ? Flat : Thick, std::memory_order_relaxed);
  }
  return known.load(std::memory_order_relaxed) == Flat;
}

SurfaceDensity::SurfaceDensity() = default;
SurfaceDensity::~SurfaceDensity() = default;

std::vector<int> SurfaceDensity::Samples(const CleaningProblem& problem)
{
  return problem.Samples(DensitySamples / static_cast<double>(problem.Total()));
}

bool SurfaceDensity::Find(const CleaningProblem& problem, const std::vector<float>& distances,
  bool running, FlatPoints& flat, const std::function<bool(int i)>& counts)
{
  const std::vector<int> samples = Samples(problem);
  std::vector<char> areOnSurface(samples.size());
  ParallelFor(0, static_cast<vtkIdType>(samples.size()), [&](vtkIdType k, vtkIdType end) {
    for (; k < end; ++k)
    {
      areOnSurface[k] = flat.IsOnSurface(samples[k]) && counts(samples[k]) ? 1 : 0;
    }
  });
  std::vector<float> values;
  for (size_t k = 0; k < samples.size(); ++k)
  {
    if (areOnSurface[k])
    {
      problem.PutPosition(samples[k], values);
      values.push_back(distances[samples[k]]);
    }
  }
  if (!problem.Gather(running, values))
  {
    return false;
  }
  for (size_t at = 0; at < values.size(); at += 4)
  {
    this->Positions.insert(this->Positions.end(), &values[at], &values[at] + 3);
    this->Distances.push_back(values[at + 3]);
  }
  this->Tree = std::make_unique<NeighborSearch>(
    this->Positions.data(), static_cast<int>(this->Distances.size()));
  return true;
}

double SurfaceDensity::UsualDistance(const Float3& place) const
{
  pcl::Indices ids;
  std::vector<float> values;
  this->Tree->nearestKSearch(
    pcl::PointXYZ(place.X, place.Y, place.Z), SurfaceNeighbors, ids, values);
  std::transform(
    ids.begin(), ids.end(), values.begin(), [this](int k) { return this->Distances[k]; });
  return Median(values);
}
}
