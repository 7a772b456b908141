// SPDX-License-Identifier: BSD-3-Clause
#include "Splatter.h"

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

void Splatter::Render(const SplatContext& context, const std::vector<SurfelCloud>& clouds,
  const Executor& executor, const Frame& frame, const float* depthLimit, LayerSink* sink)
{
  this->Stats = FrameStatistics();
  StopWatch watch;
  this->List.Clear();
  for (const SurfelCloud& cloud : clouds)
  {
    AppendSplats(context, cloud, executor, this->List);
  }
  this->Stats.SetupMilliseconds = watch.Lap();

  const View& view = context.Camera;
  BinSplats(this->List, view.Width, view.Height, executor, this->Bins);
  this->Stats.BinningMilliseconds = watch.Lap();
  SortBins(this->List, executor, this->Bins);
  this->Stats.SortMilliseconds = watch.Lap();

  const TruncatedGaussian gaussian(context.Settings.Cutoff);
  std::vector<std::uint64_t> fragments(this->Bins.NumberOfTiles(), 0);
  executor.For(this->Bins.NumberOfTiles(), 1, [&](std::size_t begin, std::size_t end) {
    const auto raster =
      std::make_unique<TileRaster>(static_cast<float>(gaussian.Support()), depthLimit, sink);
    for (std::size_t tile = begin; tile < end; ++tile)
    {
      fragments[tile] = raster->Render(this->List, this->Bins, tile, frame);
    }
  });
  this->Stats.RasterMilliseconds = watch.Lap();

  this->Stats.Surfels = this->List.NumberOfSurfels;
  this->Stats.InvalidSurfels = this->List.NumberOfInvalidSurfels;
  this->Stats.Splats = this->List.Splats.size();
  this->Stats.Pairs = this->Bins.Indices.size();
  for (const std::uint64_t count : fragments)
  {
    this->Stats.Fragments += count;
  }
}
}
