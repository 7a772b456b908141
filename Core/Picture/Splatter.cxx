// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Picture/Splatter.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <new>

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

}

void FrameStatistics::Add(const FrameStatistics& other)
{
  this->Surfels = std::max(this->Surfels, other.Surfels);
  this->InvalidSurfels = std::max(this->InvalidSurfels, other.InvalidSurfels);
  this->Cut.Add(other.Cut);
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

/// The frame through one cell of the lens. Lights stay where they are in the world.
void Splatter::SetCell(const SplatContext& context, const SubAperture& cell)
{
  SplatContext& part = this->Cell;
  part = context;
  const bool layers = !context.DepthBuffered;
  part.CoarseGrids = context.CoarseGrids && layers;
  part.SkipHidden = context.SkipHidden && layers;
  part.Sectors = context.Sectors && layers && cell.Optics.Radius > 0.0 && !cell.Camera.Parallel &&
    context.Settings.Kernel != KernelType::Gaussian;
  part.Camera = cell.Camera;
  part.Optics = cell.Optics;
  for (Light& light : part.Lights)
  {
    for (int i = 0; i < 3; ++i)
    {
      light.Position[i] -= cell.Center[i];
    }
  }
  this->CellInPicture = part;
  this->CellInPicture.CoarseGrids = false;
}

/// Of one cloud, into Runs.
void Splatter::ChooseRuns(const SurfelCloud& cloud, const Executor& executor)
{
  this->Stats.Surfels += cloud.NumberOfSurfels;
  if (!cloud.Clusters)
  {
    AllSurfels(cloud, this->Runs);
    return;
  }
  const SplatContext& cell = this->Cell;
  const TruncatedGaussian gaussian(cell.Settings.Cutoff);
  const KernelReach reach{ std::fmax(
                             LargestPearsonReach, std::sqrt(gaussian.Support() / gaussian.Tau)),
    cell.Settings.Prefilter };
  SelectCut(cloud, cell.Camera, cell.Optics, reach, cell.Cut, executor, this->Cut, this->Runs,
    this->Stats.Cut);
}

void Splatter::Append(const SplatContext& context, const SurfelCloud& cloud, const CutRanges& runs,
  const Executor& executor)
{
  if (!(cloud.Prefilter > 0.0))
  {
    this->Maker.Set(context, cloud);
    AppendSplats(this->Maker, runs, executor, this->List);
    return;
  }
  SplatContext own = context;
  own.Settings.Prefilter = cloud.Prefilter;
  this->Maker.Set(own, cloud);
  AppendSplats(this->Maker, runs, executor, this->List);
}

/// Wide runs go to coarse grids, which have to be complete before anything else. All others stay in
/// the picture, and where hidden ones are skipped, they wait until a tile needs them.
void Splatter::PlaceRuns(const SurfelCloud& cloud, bool mayWait, const Executor& executor)
{
  const bool grids = this->Cell.CoarseGrids;
  this->Others.clear();
  std::size_t wide = 0;
  for (const CutRange& run : this->Runs)
  {
    if (run.Wide && grids)
    {
      this->Runs[wide++] = run;
    }
    else
    {
      this->Others.push_back(run);
    }
  }
  const CutRanges others{ this->Others.data(), this->Others.data() + this->Others.size() };
  this->Append(this->Cell, cloud, { this->Runs.data(), this->Runs.data() + wide }, executor);
  if (mayWait && this->Cell.SkipHidden)
  {
    this->Lazy.Add(cloud, others);
    return;
  }
  this->Append(this->CellInPicture, cloud, others, executor);
}

bool Splatter::Render(const SplatContext& context, const std::vector<SurfelCloud>& clouds,
  const Executor& executor, const Frame& frame, const float* occluderDepth, LayerSink* sink,
  const CellFunction& afterCell, SplatExchange* exchange)
{
  if (exchange)
  {
    exchange->BeginPicture();
  }
  if (IsWhole(context.Camera, context.Optics, context.Sampling))
  {
    this->SetCell(context, { context.Camera, context.Optics });
    if (sink)
    {
      sink->BeginCell();
    }
    this->RenderCell(clouds, executor, frame, occluderDepth, sink, exchange);
    if (exchange)
    {
      exchange->Collect(frame);
    }
    return true;
  }
  const std::vector<SubAperture> cells =
    DivideLens(context.Camera, context.Optics, context.Sampling);
  FrameStatistics total;
  FrameAverage& average = this->Average;
  average.Start(frame, executor);
  std::size_t done = 0;
  bool goOn = true;
  while (goOn && done < cells.size())
  {
    this->SetCell(context, cells[done]);
    if (sink)
    {
      sink->BeginCell();
    }
    this->RenderCell(clouds, executor, average.Next(), occluderDepth, sink, exchange);
    total.Add(this->Stats);
    average.Add();
    ++done;
    goOn = done == cells.size() || !afterCell ||
      afterCell(static_cast<double>(done) / static_cast<double>(cells.size()));
  }
  average.Finish();
  if (exchange)
  {
    exchange->Collect(frame);
  }
  this->Stats = total;
  return goOn;
}

/// Of all clouds, into List and, where they may wait, Lazy.
void Splatter::MakeSplats(
  const std::vector<SurfelCloud>& clouds, bool mayWait, const Executor& executor)
{
  StopWatch watch;
  for (const SurfelCloud& cloud : clouds)
  {
    this->ChooseRuns(cloud, executor);
    this->Stats.SelectionMilliseconds += watch.Lap();
    if (cloud.Clusters)
    {
      this->PlaceRuns(cloud, mayWait, executor);
    }
    else
    {
      this->Append(
        this->Cell, cloud, { this->Runs.data(), this->Runs.data() + this->Runs.size() }, executor);
    }
    this->Stats.SetupMilliseconds += watch.Lap();
  }
  this->Stats.InvalidSurfels = this->List.NumberOfInvalidSurfels();
  this->Stats.Splats = this->List.NumberOfSplats();
  this->Stats.BlurredSplats = this->List.NumberOfBlurredSplats();
}

/// Makes all splats at once: those that lie behind another rank's cannot be known. A rank that
/// lacks the memory says so instead of leaving the others waiting.
void Splatter::ExchangeSplats(
  const std::vector<SurfelCloud>& clouds, const Executor& executor, SplatExchange& exchange)
{
  bool good = true;
  try
  {
    this->MakeSplats(clouds, false, executor);
  }
  catch (const std::bad_alloc&)
  {
    good = false;
  }
  const View& view = this->Cell.Camera;
  exchange.Exchange(view.Width, view.Height, good, executor, this->List);
}

void Splatter::RenderCell(const std::vector<SurfelCloud>& clouds, const Executor& executor,
  const Frame& frame, const float* occluderDepth, LayerSink* sink, SplatExchange* exchange)
{
  const SplatContext& context = this->Cell;
  this->Stats = FrameStatistics();
  this->TileSeconds = 0.0;
  this->List.Clear(context.Sectors);
  this->Lazy.Clear(context);
  if (exchange)
  {
    this->ExchangeSplats(clouds, executor, *exchange);
  }
  else
  {
    this->MakeSplats(clouds, !sink, executor);
  }
  StopWatch watch;
  const std::uint64_t splats = this->List.NumberOfSplats();
  const View& view = context.Camera;
  const TruncatedGaussian gaussian(context.Settings.Cutoff);
  RasterSettings settings{ static_cast<float>(gaussian.Support()),
    this->List.LargestCoarseColor() };
  settings.LeastConflict = context.LeastConflict;
  settings.Pass = context.DepthBuffered ? RasterPass::Nearest : RasterPass::Layers;
  this->Stats.Fragments = ResolveCoarseLevels(
    this->List, view.Width, view.Height, settings, executor, this->Rasters, this->Coarse);
  this->Stats.CoarseCells = this->List.NumberOfSplats() - splats;
  this->Stats.CoarseMilliseconds = watch.Lap();

  BinSplats(this->List, 0, view.Width, view.Height, executor, this->Bins);
  this->Lazy.Bin(view.Width, view.Height);
  this->Stats.BinningMilliseconds = watch.Lap();
  if (!context.DepthBuffered)
  {
    SortBins(this->List, executor, this->Bins);
  }
  this->Stats.SortMilliseconds = watch.Lap();

  this->RasterTiles(settings, executor, frame, occluderDepth, sink, exchange);
  this->ShareTime(watch.Lap());
}

void Splatter::RasterTiles(const RasterSettings& settings, const Executor& executor,
  const Frame& frame, const float* occluderDepth, LayerSink* sink, const SplatExchange* exchange)
{
  LazySplats* lazy = this->Lazy.IsEmpty() ? nullptr : &this->Lazy;
  const RowRange rows = exchange ? exchange->Rows() : RowRange{ 0, frame.Height };
  this->Tiles.assign(this->Bins.NumberOfTiles(), {});
  executor.For(this->Tiles.size(), 1, [&](std::size_t begin, std::size_t end) {
    const Pool<TileRaster>::Loan raster(this->Rasters);
    raster->Set(settings, occluderDepth, sink, this->Cell.SkipHidden);
    for (std::size_t tile = begin; tile < end; ++tile)
    {
      const int row = static_cast<int>(tile) / this->Bins.TilesX * TileSize;
      if (row < rows.Begin || row >= rows.End)
      {
        continue; // another rank's
      }
      StopWatch watch;
      this->Tiles[tile].Counts = raster->Render(this->List, this->Bins, tile, frame, lazy);
      this->Tiles[tile].Seconds = 1e-3 * watch.Lap();
    }
  });
  this->Stats.Pairs = this->Bins.Indices.size();
  for (const TileResult& tile : this->Tiles)
  {
    this->Stats.Fragments += tile.Counts.Fragments;
    this->Stats.HiddenPairs += tile.Counts.Hidden;
    this->Stats.Pairs += tile.Counts.LazyPairs;
    this->TileSeconds += tile.Seconds;
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
