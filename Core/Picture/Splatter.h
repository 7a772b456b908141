// SPDX-License-Identifier: BSD-3-Clause
/**
 * A frame from clouds of surfels: set-up, binning, sorting, raster. The core's front door.
 */
#pragma once

#include "Core/Picture/FrameAverage.h"
#include "Core/Picture/SplatExchange.h"
#include "Core/Raster/ABuffer.h"
#include "Core/Raster/CoarseGrid.h"
#include "Core/Raster/Frame.h"
#include "Core/Raster/TileBinning.h"
#include "Core/Raster/TileRaster.h"
#include "Core/Splats/LazySplats.h"
#include "Core/Splats/SplatList.h"
#include "Core/Splats/SplatMaker.h"

#include <cstdint>
#include <functional>
#include <vector>

namespace SurfelSplatting
{
/// Of a lens in cells, those of all cells together.
struct FrameStatistics
{
  std::uint64_t Surfels = 0;        ///< handed in; of a hierarchy its leaves
  CutStatistics Cut;                ///< of the clouds with a hierarchy
  std::uint64_t InvalidSurfels = 0; ///< with non-finite values, not drawn
  std::uint64_t Splats = 0;         ///< on the screen
  std::uint64_t BlurredSplats = 0;  ///< of these, by the lens
  std::uint64_t CoarseCells = 0;    ///< layers of coarse grids' cells that went into the picture
  std::uint64_t Pairs = 0;          ///< of splat and tile
  std::uint64_t Fragments = 0;
  std::uint64_t HiddenSurfels = 0;  ///< nodes and surfels skipped behind opaque tiles
  std::uint64_t HiddenPairs = 0;    ///< of splat and tile that were skipped behind opaque layers
  double SelectionMilliseconds = 0; ///< wall clock
  double SetupMilliseconds = 0;
  double CoarseMilliseconds = 0;
  double BinningMilliseconds = 0;
  double SortMilliseconds = 0;
  double RasterMilliseconds = 0;

  /// Adds another cell's of the same frame, but for the surfels, which are the same ones.
  void Add(const FrameStatistics& other);
};

/// Is told the share of the lens's cells that are done, (0, 1); false: stop.
using CellFunction = std::function<bool(double)>;

class Splatter
{
public:
  /**
   * Renders all clouds into one A-buffer and from there into the frame, whose size must be the
   * view's; where the lens is divided (SubApertures.h), once for each of its cells.
   * @param occluderDepth [Height][Width] distance along the view direction of opaque things drawn
   * by others, infinity where there are none; layers behind it are hidden. May be null.
   * @param sink       receives every layer before it is composited, cell after cell; may be null.
   * @param afterCell  called between the cells of the lens; may be empty.
   * @param exchange   where several ranks render a picture of all their clouds: collective, with
   * the same context, frame size and occluderDepth on all of them, and without a sink; the whole
   * picture is rank 0's. Null: this one's alone. The same frame, bit for bit, at any number of
   * threads.
   * @return false where afterCell has stopped it: the frame is the mean of the cells so far.
   */
  bool Render(const SplatContext& context, const std::vector<SurfelCloud>& clouds,
    const Executor& executor, const Frame& frame, const float* occluderDepth = nullptr,
    LayerSink* sink = nullptr, const CellFunction& afterCell = CellFunction(),
    SplatExchange* exchange = nullptr);

  const FrameStatistics& Statistics() const { return this->Stats; }

private:
  struct TileResult
  {
    TileRaster::Counts Counts;
    double Seconds;
  };

  void SetCell(const SplatContext& context, const SubAperture& cell);
  void RenderCell(const std::vector<SurfelCloud>& clouds, const Executor& executor,
    const Frame& frame, const float* occluderDepth, LayerSink* sink, SplatExchange* exchange);
  void MakeSplats(const std::vector<SurfelCloud>& clouds, bool mayWait, const Executor& executor);
  void ExchangeSplats(
    const std::vector<SurfelCloud>& clouds, const Executor& executor, SplatExchange& exchange);
  void ChooseRuns(const SurfelCloud& cloud, const Executor& executor);
  void Append(const SplatContext& context, const SurfelCloud& cloud, const CutRanges& runs,
    const Executor& executor);
  void PlaceRuns(const SurfelCloud& cloud, bool mayWait, const Executor& executor);
  void RasterTiles(const RasterSettings& settings, const Executor& executor, const Frame& frame,
    const float* occluderDepth, LayerSink* sink, const SplatExchange* exchange);
  void ShareTime(double milliseconds);

  FrameStatistics Stats;
  double TileSeconds = 0; // of all threads together

  // Memory that is kept from frame to frame: a steady frame allocates nothing.
  SplatContext Cell;          // what is seen through the cell of the lens
  SplatContext CellInPicture; // the same without coarse grids
  CutWork Cut;
  std::vector<CutRange> Runs, Others; // of one cloud
  SplatMaker Maker;
  SplatList List;
  LazySplats Lazy;
  CoarseWork Coarse;
  TileBins Bins;
  Pool<TileRaster> Rasters;
  std::vector<TileResult> Tiles;
  FrameAverage Average;
};
}
