// SPDX-License-Identifier: BSD-3-Clause
#include "Splatter.h"

#include "CoarseGrid.h"
#include "TileRaster.h"

#include <chrono>
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

void Splatter::Render(const SplatContext& context, const std::vector<SurfelCloud>& clouds,
  const Executor& executor, const Frame& frame, const float* depthLimit, LayerSink* sink)
{
  this->Stats = FrameStatistics();
  StopWatch watch;
  this->List.Clear();
  for (const SurfelCloud& cloud : clouds)
  {
    const std::vector<NodeRun> runs = this->ChooseRuns(context, cloud, executor);
    this->Stats.SelectionMilliseconds += watch.Lap();
    AppendSplats(context, cloud, runs, executor, this->List);
    this->Stats.SetupMilliseconds += watch.Lap();
  }

  const View& view = context.Camera;
  this->Stats.InvalidSurfels = this->List.NumberOfInvalidSurfels();
  this->Stats.Splats = this->List.NumberOfSplats();
  const TruncatedGaussian gaussian(context.Settings.Cutoff);
  const RasterSettings settings{ static_cast<float>(gaussian.Support()),
    this->List.LargestColor() };
  this->Stats.Fragments =
    ResolveCoarseLevels(this->List, view.Width, view.Height, settings, executor);
  this->Stats.CoarseCells = this->List.NumberOfSplats() - this->Stats.Splats;
  this->Stats.CoarseMilliseconds = watch.Lap();

  BinSplats(this->List, 0, view.Width, view.Height, executor, this->Bins);
  this->Stats.BinningMilliseconds = watch.Lap();
  SortBins(this->List, executor, this->Bins);
  this->Stats.SortMilliseconds = watch.Lap();

  std::vector<TileRaster::Counts> counts(this->Bins.NumberOfTiles());
  executor.For(this->Bins.NumberOfTiles(), 1, [&](std::size_t begin, std::size_t end) {
    const auto raster =
      std::make_unique<TileRaster>(settings, depthLimit, sink, context.SkipHidden);
    for (std::size_t tile = begin; tile < end; ++tile)
    {
      counts[tile] = raster->Render(this->List, this->Bins, tile, frame);
    }
  });
  this->Stats.RasterMilliseconds = watch.Lap();

  this->Stats.Pairs = this->Bins.Indices.size();
  for (const TileRaster::Counts& count : counts)
  {
    this->Stats.Fragments += count.Fragments;
    this->Stats.HiddenPairs += count.Hidden;
  }
}
}
