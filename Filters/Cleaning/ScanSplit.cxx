// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Cleaning/ScanSplit.h"

#include "Filters/Cleaning/CleaningProblem.h"
#include "Filters/Cleaning/LocalQuadric.h"
#include "Filters/Common/Median.h"
#include "Filters/Common/ParallelFor.h"
#include "Filters/Neighbors/NeighborSearch.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

namespace SurfelGeometry
{
namespace
{
/// Neighbours whose surface tells whether there is one sheet or more, and those whose sheets are
/// told apart, as in Smoothing.cxx.
constexpr int FlatNeighbors = 16;
constexpr int SheetNeighbors = 64;

/// Two scans are looked for if the quadric through the nearest points fits at fewer samples.
constexpr double LargestCleanShare = 0.9;

/// Contrasts of samples whose colours are unknown, and of those with one clean sheet.
constexpr float UnknownContrast = -1.0f;
constexpr float CleanContrast = -2.0f;

/// Ids between those that the samples know, whose own neighbourhoods are then asked.
constexpr double MostBetween = 4096.0;

/// Ids do not fit into the floats that processes share: two of them hold one up to 2^36.
constexpr double HighPart = 4096.0;

/// One id at which the squared correlations of the samples change.
struct SplitChange
{
  double Id;
  float Change;
  bool operator<(const SplitChange& b) const
  {
    return this->Id < b.Id || (this->Id == b.Id && this->Change < b.Change);
  }
};

/// Each thread reuses one. Queries for one number of neighbours share searches of the tree.
struct SplitScratch
{
  Neighbors Few, Many;
  LocalQuadric Quadric;
};

class SplitSearch
{
public:
  SplitSearch(const CleaningProblem& problem, const SampledColors& colors)
    : Cloud(problem.Cloud())
    , Tree(*problem.Searched.Tree)
    , Colors(colors)
  {
  }

  /// Contrast of the colours of the two sides of the surface about a sample; where that is not
  /// clean, appends how well the order of the points tells the sides apart.
  float Measure(int i, SplitScratch& scratch, std::vector<SplitChange>& changes) const;

private:
  void PutChanges(int i, const Neighbors& neighbors, const std::vector<char>& sides,
    std::vector<SplitChange>& changes) const;

  const LocalCloud& Cloud;
  const NeighborSearch& Tree;
  const SampledColors& Colors;
};

float SplitSearch::Measure(int i, SplitScratch& scratch, std::vector<SplitChange>& changes) const
{
  auto& [few, neighbors, quadric] = scratch;
  this->Tree.FindNearest(i, FlatNeighbors, few);
  if (few.Count() < FlatNeighbors)
  {
    return CleanContrast;
  }
  quadric.Fit(this->Cloud, i, few);
  if (!quadric.IsValid() || quadric.Deviation(SpacingOf(few)) < CleanResidual)
  {
    return CleanContrast;
  }
  this->Tree.FindNearest(i, SheetNeighbors, neighbors);
  quadric.Fit(this->Cloud, i, neighbors);
  if (!quadric.IsValid())
  {
    return CleanContrast;
  }
  std::vector<char> sides;
  quadric.FindSides(sides);
  this->PutChanges(i, neighbors, sides, changes);
  return this->Colors.Array ? static_cast<float>(quadric.ColorContrast(i, neighbors, this->Colors))
                            : UnknownContrast;
}

void SplitSearch::PutChanges(int i, const Neighbors& neighbors, const std::vector<char>& sides,
  std::vector<SplitChange>& changes) const
{
  std::vector<std::pair<vtkIdType, char>> order;
  for (size_t k = 0; k < sides.size(); ++k)
  {
    order.emplace_back(this->Cloud.SampleId(k == 0 ? i : neighbors.Ids[k - 1]), sides[k]);
  }
  std::sort(order.begin(), order.end());
  const double count = static_cast<double>(order.size());
  const double above = static_cast<double>(std::count(sides.begin(), sides.end(), char{ 1 }));
  double before = 0.0, aboveBefore = 0.0, last = 0.0;
  for (const auto& [id, side] : order)
  {
    ++before;
    aboveBefore += side;
    const double variances = before * (count - before) * above * (count - above);
    const double covariance = aboveBefore * count - before * above;
    const double explained = variances > 0.0 ? covariance * covariance / variances : 0.0;
    changes.push_back({ static_cast<double>(id), static_cast<float>(explained - last) });
    last = explained;
  }
}

/// Collective: what samples say.
struct SplitEvidence
{
  std::vector<SplitChange> Changes; // of all processes, in an order that does not depend on them
  bool IsNoisy = false;             // many samples are not clean, and their sheets have one colour
  double Samples = 0.0;             // that are not clean

  /// Returns false if a process was stopped.
  bool Gather(const CleaningProblem& problem, const SplitSearch& search,
    const std::vector<int>& samples, bool running);

private:
  void Judge(std::vector<float>& contrasts);
  bool Share(const CleaningProblem& problem, const std::vector<std::vector<SplitChange>>& changes);
};

bool SplitEvidence::Gather(const CleaningProblem& problem, const SplitSearch& search,
  const std::vector<int>& samples, bool running)
{
  std::vector<float> contrasts(samples.size());
  std::vector<std::vector<SplitChange>> changes(samples.size());
  ParallelFor(0, static_cast<vtkIdType>(samples.size()), [&](vtkIdType k, vtkIdType end) {
    SplitScratch scratch;
    for (; k < end; ++k)
    {
      contrasts[k] = search.Measure(samples[k], scratch, changes[k]);
    }
  });
  if (!problem.Gather(running, contrasts))
  {
    return false;
  }
  this->Judge(contrasts);
  return !this->IsNoisy || this->Share(problem, changes);
}

void SplitEvidence::Judge(std::vector<float>& contrasts)
{
  const auto drop = [&contrasts](float value) {
    contrasts.erase(std::remove(contrasts.begin(), contrasts.end(), value), contrasts.end());
    return static_cast<double>(contrasts.size());
  };
  const double all = static_cast<double>(contrasts.size());
  this->Samples = drop(CleanContrast);
  const bool isColored = drop(UnknownContrast) > 0.0;
  this->IsNoisy = this->Samples > (1.0 - LargestCleanShare) * all &&
    (!isColored || Median(contrasts) < SameColors);
}

bool SplitEvidence::Share(
  const CleaningProblem& problem, const std::vector<std::vector<SplitChange>>& changes)
{
  std::vector<float> packed;
  for (const std::vector<SplitChange>& some : changes)
  {
    for (const SplitChange& c : some)
    {
      const double high = std::floor(c.Id / HighPart);
      packed.insert(packed.end(),
        { static_cast<float>(high), static_cast<float>(c.Id - HighPart * high), c.Change });
    }
  }
  if (!problem.Gather(true, packed))
  {
    return false;
  }
  for (size_t at = 0; at < packed.size(); at += 3)
  {
    this->Changes.push_back({ HighPart * packed[at] + packed[at + 1], packed[at + 2] });
  }
  std::sort(this->Changes.begin(), this->Changes.end());
  return true;
}

/// Points of this process with ids between two others, at most about `limit` of all processes.
std::vector<int> PointsBetween(
  const CleaningProblem& problem, double low, double high, double limit)
{
  std::vector<int> found;
  for (const int i : problem.Samples(std::min(1.0, limit / (high - low))))
  {
    const auto id = static_cast<double>(problem.Cloud().SampleId(i));
    if (id > low && id < high)
    {
      found.push_back(i);
    }
  }
  return found;
}
}

bool FindScanSplit(const CleaningProblem& problem, const std::vector<int>& samples,
  const SampledColors& colors, bool running, ScanSplit& split)
{
  const SplitSearch search(problem, colors);
  SplitEvidence evidence;
  if (!evidence.Gather(problem, search, samples, running))
  {
    return false;
  }
  // The samples know the ids of their neighbours only: between two of these is the scan's first.
  double sum = 0.0, best = 0.0, low = 0.0, high = 0.0;
  for (const SplitChange& change : evidence.Changes)
  {
    high = low == high ? change.Id : high;
    sum += change.Change;
    if (sum > best)
    {
      best = sum;
      low = high = change.Id;
    }
  }
  if (best == 0.0)
  {
    return true;
  }
  split = { static_cast<vtkIdType>(low) + 1, best / evidence.Samples };
  SplitEvidence near;
  if (!near.Gather(problem, search, PointsBetween(problem, low, high, MostBetween), true))
  {
    return false;
  }
  sum = best = 0.0;
  for (const SplitChange& change : near.Changes)
  {
    sum += change.Id > low && change.Id < high ? change.Change : 0.0;
    if (sum > best)
    {
      best = sum;
      split.First = static_cast<vtkIdType>(change.Id) + 1;
    }
  }
  return true;
}
}
