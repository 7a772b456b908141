// SPDX-License-Identifier: BSD-3-Clause
#include "Splatter.h"

#include "CoarseGrid.h"
#include "FrameAverage.h"
#include "TileRaster.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>

namespace SurfelSplatting
{
namespace
{
class StopWatch
{
public:
  /// Milliseconds since the last call or the construction.
  double Lap()
  {
    const auto now = std::chrono::steady_clock::now();
    const double elapsed = std::chrono::duration<double, std::milli>(now - this->Start).count();
    this->Start = now;
    return elapsed;
  }

private:
  std::chrono::steady_clock::time_point Start = std::chrono::steady_clock::now();
};

/// The frame through one cell of the lens. Lights stay where they are in the world. Layers for a
/// sink are those of all sectors.
SplatContext CellContext(const SplatContext& context, const LensCell& cell, bool hasSink)
{
  SplatContext part = context;
  const bool layers = !context.DepthBuffered;
  part.CoarseGrids = context.CoarseGrids && layers;
  part.SkipHidden = context.SkipHidden && layers;
  part.Sectors = context.Sectors && layers && !hasSink && cell.Optics.Radius > 0.0 &&
    !cell.Camera.Parallel && context.Settings.Kernel != KernelType::Gaussian;
  part.Camera = cell.Camera;
  part.Optics = cell.Optics;
  for (Light& light : part.Lights)
  {
    for (int i = 0; i < 3; ++i)
    {
      light.Position[i] -= cell.Center[i];
    }
  }
  return part;
}
}

void FrameStatistics::Add(const FrameStatistics& other)
{
  this->Surfels = std::max(this->Surfels, other.Surfels);
  this->InvalidSurfels = std::max(this->InvalidSurfels, other.InvalidSurfels);
  this->Detail.Add(other.Detail);
  this->Splats += other.Splats;
  this->BlurredSplats += other.BlurredSplats;
  this->CoarseCells += other.CoarseCells;
  this->Pairs += other.Pairs;
  this->Fragments += other.Fragments;
  this->HiddenSurfels += other.HiddenSurfels;
  this->HiddenPairs += other.HiddenPairs;
  this->SelectionMilliseconds += other.SelectionMilliseconds;
  this->SetupMilliseconds += other.SetupMilliseconds;
  this->CoarseMilliseconds += other.CoarseMilliseconds;
  this->BinningMilliseconds += other.BinningMilliseconds;
  this->SortMilliseconds += other.SortMilliseconds;
  this->RasterMilliseconds += other.RasterMilliseconds;
}

std::vector<NodeRun> Splatter::ChooseRuns(
  const SplatContext& context, const SurfelCloud& cloud, const Executor& executor)
{
  if (!cloud.Detail)
  {
    this->Stats.Surfels += cloud.NumberOfSurfels;
    return AllSurfels(cloud);
  }
  this->Stats.Surfels += cloud.NumberOfLeaves;
  const TruncatedGaussian gaussian(context.Settings.Cutoff);
  const KernelReach reach{ std::fmax(
                             LargestPearsonReach, std::sqrt(gaussian.Support() / gaussian.Tau)),
    context.Settings.Prefilter };
  return SelectDetail(
    cloud, context.Camera, context.Optics, reach, context.Detail, executor, this->Stats.Detail);
}

/// Wide runs go to coarse grids, which have to be complete before anything else. All others stay in
/// the picture, and where hidden ones are skipped, they wait until a tile needs them.
void Splatter::PlaceRuns(const SplatContext& context, const SurfelCloud& cloud,
  std::vector<NodeRun>& runs, bool mayWait, const Executor& executor)
{
  const auto narrow = std::stable_partition(runs.begin(), runs.end(),
    [&context](const NodeRun& run) { return run.Wide && context.CoarseGrids; });
  const std::vector<NodeRun> others(narrow, runs.end());
  runs.erase(narrow, runs.end());
  AppendSplats(context, cloud, runs, executor, this->List);
  if (mayWait && context.SkipHidden)
  {
    this->Lazy.Add(cloud, others);
    return;
  }
  SplatContext fine = context;
  fine.CoarseGrids = false;
  AppendSplats(fine, cloud, others, executor, this->List);
}

bool Splatter::Render(const SplatContext& context, const std::vector<SurfelCloud>& clouds,
  const Executor& executor, const Frame& frame, const float* depthLimit, LayerSink* sink,
  const CellFunction& afterCell)
{
  const std::vector<LensCell> cells = DivideLens(context.Camera, context.Optics, context.Sampling);
  if (cells.size() == 1)
  {
    this->RenderCell(
      CellContext(context, cells[0], sink != nullptr), clouds, executor, frame, depthLimit, sink);
    return true;
  }
  FrameStatistics total;
  FrameAverage average(frame, executor);
  std::size_t done = 0;
  bool goOn = true;
  while (goOn && done < cells.size())
  {
    this->RenderCell(CellContext(context, cells[done], sink != nullptr), clouds, executor,
      average.Next(), depthLimit, sink);
    total.Add(this->Stats);
    average.Add();
    ++done;
    goOn = done == cells.size() || !afterCell ||
      afterCell(static_cast<double>(done) / static_cast<double>(cells.size()));
  }
  average.Finish();
  this->Stats = total;
  return goOn;
}

void Splatter::RenderCell(const SplatContext& context, const std::vector<SurfelCloud>& clouds,
  const Executor& executor, const Frame& frame, const float* depthLimit, LayerSink* sink)
{
  this->Stats = FrameStatistics();
  this->TileSeconds = 0.0;
  StopWatch watch;
  this->List.Clear(context.Sectors);
  this->Lazy.Clear(context);
  for (const SurfelCloud& cloud : clouds)
  {
    std::vector<NodeRun> runs = this->ChooseRuns(context, cloud, executor);
    this->Stats.SelectionMilliseconds += watch.Lap();
    if (cloud.Detail)
    {
      this->PlaceRuns(context, cloud, runs, !sink, executor);
    }
    else
    {
      AppendSplats(context, cloud, runs, executor, this->List);
    }
    this->Stats.SetupMilliseconds += watch.Lap();
  }

  const View& view = context.Camera;
  this->Stats.InvalidSurfels = this->List.NumberOfInvalidSurfels();
  this->Stats.Splats = this->List.NumberOfSplats();
  this->Stats.BlurredSplats = this->List.NumberOfBlurredSplats();
  const TruncatedGaussian gaussian(context.Settings.Cutoff);
  RasterSettings settings{ static_cast<float>(gaussian.Support()),
    this->List.LargestCoarseColor() };
  settings.LeastConflict = context.LeastConflict;
  settings.Pass = context.DepthBuffered ? RasterPass::Nearest : RasterPass::Layers;
  this->Stats.Fragments =
    ResolveCoarseLevels(this->List, view.Width, view.Height, settings, executor);
  this->Stats.CoarseCells = this->List.NumberOfSplats() - this->Stats.Splats;
  this->Stats.CoarseMilliseconds = watch.Lap();

  BinSplats(this->List, 0, view.Width, view.Height, executor, this->Bins);
  this->Lazy.Bin(view.Width, view.Height);
  this->Stats.BinningMilliseconds = watch.Lap();
  if (!context.DepthBuffered)
  {
    SortBins(this->List, executor, this->Bins);
  }
  this->Stats.SortMilliseconds = watch.Lap();

  this->RasterTiles(settings, context.SkipHidden, executor, frame, depthLimit, sink);
  this->ShareTime(watch.Lap());
}

void Splatter::RasterTiles(const RasterSettings& settings, bool skipHidden,
  const Executor& executor, const Frame& frame, const float* depthLimit, LayerSink* sink)
{
  LazySplats* lazy = this->Lazy.IsEmpty() ? nullptr : &this->Lazy;
  std::vector<TileRaster::Counts> counts(this->Bins.NumberOfTiles());
  std::vector<double> seconds(counts.size());
  executor.For(counts.size(), 1, [&](std::size_t begin, std::size_t end) {
    const auto raster = std::make_unique<TileRaster>(settings, depthLimit, sink, skipHidden);
    for (std::size_t tile = begin; tile < end; ++tile)
    {
      StopWatch watch;
      counts[tile] = raster->Render(this->List, this->Bins, tile, frame, lazy);
      seconds[tile] = 1e-3 * watch.Lap();
    }
  });
  this->Stats.Pairs = this->Bins.Indices.size();
  for (std::size_t tile = 0; tile < counts.size(); ++tile)
  {
    this->Stats.Fragments += counts[tile].Fragments;
    this->Stats.HiddenPairs += counts[tile].Hidden;
    this->Stats.Pairs += counts[tile].LazyPairs;
    this->TileSeconds += seconds[tile];
  }
}

/// Set-up and raster run by turns in the tiles: their wall-clock time is shared out by the time
/// that all threads spent on each.
void Splatter::ShareTime(double milliseconds)
{
  const LazySplats::Counts lazy = this->Lazy.Count();
  this->Stats.Splats += lazy.Splats;
  this->Stats.BlurredSplats += lazy.Blurred;
  this->Stats.InvalidSurfels += lazy.Invalid;
  this->Stats.HiddenSurfels = lazy.Hidden;
  const double share =
    this->TileSeconds > 0.0 ? std::fmin(1.0, lazy.Seconds / this->TileSeconds) : 0.0;
  this->Stats.SetupMilliseconds += share * milliseconds;
  this->Stats.RasterMilliseconds = (1.0 - share) * milliseconds;
}
}
