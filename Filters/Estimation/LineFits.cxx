// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Estimation/LineFits.h"

#include "Filters/Common/Median.h"
#include "Filters/Common/ParallelFor.h"
#include "Filters/Estimation/PlaneFitter.h"
#include "Filters/Estimation/ScannerView.h"
#include "Filters/Neighbors/LocalCloud.h"

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <iterator>
#include <limits>
#include <vector>

namespace SurfelGeometry
{
namespace
{
/// What is beside a rod, which has so many of its points, is at most so many times as large.
constexpr std::size_t FewestOnRod = 3;
constexpr float MostPerRodSpacing = 1.5f;

/// Scanners that turn have measured a cloud if so many of a sample have a spacing so many times
/// larger among more neighbours. Where lines are four steps apart, 21 to 33 % have, from eight on
/// about 50 %; of random points 6 %, of chain link and of grass 5 to 7 %.
constexpr double JudgedPoints = 2048.0, UnevenShare = 0.12;
constexpr float UnevenSpacing = 1.3f;

/// Tells which of the points on lines may be those of rods. Returns false if stopped.
bool JudgeLines(const FitInput& input, const ScanLines& lines, const NeighborGraph& graph,
  const PlaneFits& fits, const StageProgress& progress, std::vector<LineKind>& kinds)
{
  const std::vector<int>& points = lines.Points();
  return ParallelFor(
    static_cast<vtkIdType>(points.size()), progress, [&](vtkIdType k, vtkIdType end) {
      PlaneFitter fitter(input.Cloud, input.Tree, input.Settings);
      ScannerView view(input.Cloud, input.ToScanner);
      ScanLines::Query query;
      Neighbors neighbors;
      for (; k < end; ++k)
      {
        const int i = points[static_cast<size_t>(k)];
        if (!lines.IsAmongStrips(i, graph))
        {
          continue;
        }
        const bool isOfSurface = lines.IsOfSurface(i, query);
        if (!isOfSurface || lines.MayBeAlone(i))
        {
          kinds[i] = isOfSurface && fitter.HasLinesBeside(i, fits[i], neighbors) ? LineKind::Other
            : fitter.IsWithinSurface(i, neighbors)               ? LineKind::WithinSurface
            : fitter.IsBetweenLines(i, fits[i], view, neighbors) ? LineKind::BetweenLines
            : isOfSurface                                        ? LineKind::Alone
                                                                 : LineKind::Rod;
        }
      }
    });
}

/// Tells rods from the edges of surfaces among lines that are alone. Returns false if stopped.
bool JudgeAlone(const FitInput& input, const ScanLines& lines, const PlaneFits& fits,
  const StageProgress& progress, std::vector<LineKind>& kinds)
{
  std::vector<int> alone;
  std::copy_if(lines.Points().begin(), lines.Points().end(), std::back_inserter(alone),
    [&kinds](int i) { return kinds[i] == LineKind::Alone; });
  std::vector<LineKind> found(alone.size());
  const auto count = static_cast<vtkIdType>(alone.size());
  const bool done = ParallelFor(count, progress, [&](vtkIdType k, vtkIdType end) {
    PlaneFitter fitter(input.Cloud, input.Tree, input.Settings);
    Neighbors neighbors;
    for (; k < end; ++k)
    {
      const int i = alone[static_cast<size_t>(k)];
      found[k] =
        fitter.IsEdge(i, fits[i], lines, kinds, neighbors) ? LineKind::Other : LineKind::Rod;
    }
  });
  for (size_t k = 0; k < alone.size(); ++k)
  {
    kinds[alone[k]] = found[k];
  }
  return done;
}

/// Marks the points on rods, and fits those on lines of surfaces again. Returns false if stopped.
bool FitScanLines(const FitInput& input, const ScanLines& lines, const std::vector<LineKind>& kinds,
  const NeighborGraph& graph, const StageProgress& progress, PlaneFits& fits)
{
  const std::vector<int>& points = lines.Points();
  return ParallelFor(
    static_cast<vtkIdType>(points.size()), progress, [&](vtkIdType k, vtkIdType end) {
      PlaneFitter fitter(input.Cloud, input.Tree, input.Settings);
      Neighbors neighbors;
      for (; k < end; ++k)
      {
        const int i = points[static_cast<size_t>(k)];
        fits[i].OnRod = IsOnRod(i, kinds, graph);
        if (!fits[i].OnRod && lines.IsLine(i))
        {
          fitter.FitToLines(i, input.GivenNormal(i), neighbors, fits[i]);
        }
      }
    });
}

/// Marks the ends of rods, and fits them. Returns false if stopped.
/// @param points beside rods
bool FitEnds(const FitInput& input, const std::vector<int>& points, const StageProgress& progress,
  PlaneFits& fits)
{
  const auto count = static_cast<vtkIdType>(points.size());
  return ParallelFor(count, progress, [&](vtkIdType k, vtkIdType end) {
    PlaneFitter fitter(input.Cloud, input.Tree, input.Settings);
    ScannerView view(input.Cloud, input.ToScanner);
    Neighbors neighbors;
    for (; k < end; ++k)
    {
      const int i = points[static_cast<size_t>(k)];
      const PlaneFit before = fits[i];
      fitter.FitToRod(i, input.GivenNormal(i), neighbors, fits[i]);
      if (fits[i].OnRod)
      {
        fitter.FindLines(i, neighbors);
        fits[i] = fitter.IsBetweenLines(i, fits[i], view, neighbors) ? before : fits[i];
      }
    }
  });
}

/// The most that point i may have as its spacing, if some neighbours are on rods: a stray point
/// beside a rod is on a line, or in a plane, with the rod's points. Infinite for others.
float LargestBesideRods(int i, const PlaneFits& fits, const NeighborGraph& graph)
{
  const int* ids = graph.Row(i);
  std::vector<float> spacings;
  for (int k = 0; k < CountIds(ids, KeptNeighbors); ++k)
  {
    if (fits[ids[k]].OnRod)
    {
      spacings.push_back(fits[ids[k]].Spacing);
    }
  }
  return spacings.size() >= FewestOnRod ? MostPerRodSpacing * Median(spacings)
                                        : std::numeric_limits<float>::infinity();
}

/// Points of rods, and stray points beside them, are no larger than the rods' points around.
/// @param points on rods and beside them
void BoundBesideRods(const LocalCloud& cloud, const std::vector<int>& points,
  const NeighborGraph& graph, PlaneFits& fits)
{
  std::vector<float> bounds(points.size()); // first all of them, then all changes
  std::transform(points.begin(), points.end(), bounds.begin(),
    [&](int i) { return LargestBesideRods(i, fits, graph); });
  for (size_t k = 0; k < points.size(); ++k)
  {
    const int i = points[k];
    PlaneFit& fit = fits[i];
    const Vector3 way = Load(cloud.Position(graph.Row(i)[0])) - Load(cloud.Position(i));
    if (fit.Spacing > bounds[k] && (fit.OnRod || Norm(way) > bounds[k]))
    {
      fit.OnRod = true;
      fit.MakeRound(bounds[k]);
    }
  }
}

/// Whether scanners that turn have measured the cloud: where points are on lines, those of a wider
/// neighbourhood are sparser.
bool IsOfLines(const FitInput& input, const Spreads& spreads, const PlaneFits& fits)
{
  const LocalCloud& cloud = input.Cloud;
  const std::vector<int> sample = SamplePoints(cloud, JudgedPoints / cloud.Size());
  std::atomic<vtkIdType> uneven{ 0 };
  const auto count = static_cast<vtkIdType>(sample.size());
  ParallelFor(0, count, [&](vtkIdType k, vtkIdType end) {
    PlaneFitter fitter(cloud, input.Tree, input.Settings);
    EvenNeighbors neighbors;
    for (; k < end; ++k)
    {
      const int i = sample[static_cast<size_t>(k)];
      PlaneFit even = fits[i];
      fitter.FitEvenly(i, input.GivenNormal(i), spreads[i], neighbors, even);
      uneven += even.OnScanLines && even.Spacing > UnevenSpacing * fits[i].Spacing ? 1 : 0;
    }
  });
  return static_cast<double>(uneven) > UnevenShare * static_cast<double>(count);
}

/// Fits all points to as many neighbours as are spread evenly. Returns false if stopped.
bool FitEvenly(
  const FitInput& input, const Spreads& spreads, const StageProgress& progress, PlaneFits& fits)
{
  return ParallelFor(input.Cloud.Size(), progress, [&](vtkIdType begin, vtkIdType end) {
    PlaneFitter fitter(input.Cloud, input.Tree, input.Settings);
    EvenNeighbors neighbors;
    for (int i = static_cast<int>(begin); i < end; ++i)
    {
      fitter.FitEvenly(i, input.GivenNormal(i), spreads[i], neighbors, fits[i]);
    }
  });
}

/// Fits points on the lines of surfaces again, marks those on rods, and fits the ends of these.
/// Returns false if stopped.
bool FitFewLines(const FitInput& input, const Spreads& spreads, const NeighborGraph& graph,
  const StageProgress& progress, PlaneFits& fits)
{
  const ScanLines lines(input.Cloud, spreads);
  std::vector<LineKind> kinds(lines.Points().empty() ? 0 : fits.size(), LineKind::Other);
  if (!JudgeLines(input, lines, graph, fits, progress.Part(0.0, 0.3), kinds) ||
    !JudgeAlone(input, lines, fits, progress.Part(0.3, 0.4), kinds) ||
    !FitScanLines(input, lines, kinds, graph, progress.Part(0.4, 0.8), fits))
  {
    return false;
  }
  std::vector<int> rods;
  std::copy_if(lines.Points().begin(), lines.Points().end(), std::back_inserter(rods),
    [&fits](int i) { return fits[i].OnRod; });
  const std::vector<int> beside = PointsBeside(rods, graph);
  if (!FitEnds(input, beside, progress.Part(0.8, 1.0), fits))
  {
    return false;
  }
  rods.insert(rods.end(), beside.begin(), beside.end());
  BoundBesideRods(input.Cloud, rods, graph, fits);
  return true;
}
}

bool FitLines(const FitInput& input, const Spreads& spreads, const NeighborGraph& graph,
  const StageProgress& progress, PlaneFits& fits)
{
  return IsOfLines(input, spreads, fits) ? FitEvenly(input, spreads, progress, fits)
                                         : FitFewLines(input, spreads, graph, progress, fits);
}
}
