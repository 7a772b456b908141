// SPDX-License-Identifier: BSD-3-Clause
/**
 * Renders clouds of surfels into a frame: set-up, binning, sorting, raster. The entry point of the
 * core.
 */
#pragma once

#include "Core/Lens/SubApertures.h"
#include "Core/Picture/DoubtfulTiles.h"
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
/// Contents of a frame and times of its stages; summed over the cells of the lens.
struct FrameStatistics
{
  std::uint64_t Surfels = 0;        ///< handed in; a hierarchy counts its leaves
  CutStatistics Cut;                ///< clouds with a hierarchy only
  std::uint64_t InvalidSurfels = 0; ///< with non-finite values, not drawn
  std::uint64_t Splats = 0;         ///< on the screen
  std::uint64_t BlurredSplats = 0;  ///< of these, blurred by the lens
  std::uint64_t CoarseCells = 0;    ///< layers of coarse-grid cells, or their surfaces, drawn
  std::uint64_t Pairs = 0;          ///< pairs of splat and tile
  std::uint64_t Fragments = 0;
  std::uint64_t HiddenSurfels = 0;  ///< nodes and surfels skipped behind opaque tiles
  std::uint64_t HiddenPairs = 0;    ///< pairs of splat and tile skipped behind opaque layers
  double SelectionMilliseconds = 0; ///< wall clock
  double SetupMilliseconds = 0;
  double CoarseMilliseconds = 0;
  double BinningMilliseconds = 0;
  double SortMilliseconds = 0;
  double RasterMilliseconds = 0;

  /// Adds the statistics of another cell of the same frame. All cells see the same surfels, which
  /// are counted once.
  void Add(const FrameStatistics& other);
};

/// Receives the share of the lens's cells that are done, (0, 1). Returns false to stop.
using CellFunction = std::function<bool(double)>;

/// Destination of a picture, and the occluders drawn there before.
struct RenderTarget
{
  RenderTarget() = default;

  /// A frame with nothing else in it.
  RenderTarget(const Frame& picture)
    : Picture(picture)
  {
  }

  Frame Picture; ///< as large as the view

  /// [Height][Width] distance along the view direction of opaque things that were drawn before,
  /// world units; infinity where there are none. Layers behind it are hidden. May be null.
  const float* OccluderDepth = nullptr;

  /// Receives every layer before it is composited, cell after cell. May be null.
  LayerSink* Sink = nullptr;

  /// Receives the picture tile by tile, if this is one of several. May be null.
  FrameAverage* Mean = nullptr;

  /// Set where several ranks render one picture of all their clouds; null for a picture of this
  /// rank's clouds. Rendering is then collective, with the same context, frame size and occluder
  /// depth on all ranks and without a sink. Rank 0 gets the whole picture.
  SplatExchange* Exchange = nullptr;
};

class Splatter
{
public:
  /**
   * Renders all clouds into one A-buffer and from there into the target's frame. If the lens is
   * divided (SubApertures.h), does so once per cell and takes the mean, where that differs from one
   * picture (DoubtfulTiles.h). More than nine cells, pinholes, and layers for a sink are rendered
   * everywhere. The frame is the same, bit for bit, at any number of threads.
   * @param afterCell called between the cells of the lens; may be empty
   * @throw std::invalid_argument if frame and view have different sizes, or the frame has colours
   * but no depths
   * @throw DamagedMemory if a cloud is from a file that is damaged: the frame is to be dropped
   * @return false if afterCell has stopped it: the frame is the mean of the cells so far
   */
  bool Render(const SplatContext& context, const std::vector<SurfelCloud>& clouds,
    const Executor& executor, const RenderTarget& target,
    const CellFunction& afterCell = CellFunction());

  const FrameStatistics& Statistics() const { return this->Stats; }

private:
  struct TileResult
  {
    TileRaster::Counts Counts;
    double Seconds;
  };

  void SetCell(const SplatContext& context, const SubAperture& cell);
  void SetDivision(const SplatContext& context, const std::vector<SubAperture>& cells);
  void RenderWhole(const SplatContext& context, const std::vector<SurfelCloud>& clouds,
    const Executor& executor, const RenderTarget& target);
  Frame MeanBeside(const Frame& picture);
  bool RenderCells(const SplatContext& context, const std::vector<SurfelCloud>& clouds,
    const Executor& executor, const RenderTarget& target, const CellFunction& afterCell);
  void RenderCell(
    const std::vector<SurfelCloud>& clouds, const Executor& executor, const RenderTarget& target);
  void DrawSplats(const Executor& executor, const RenderTarget& target);
  void MakeSplats(const std::vector<SurfelCloud>& clouds, bool mayWait, const Executor& executor);
  void ExchangeSplats(
    const std::vector<SurfelCloud>& clouds, const Executor& executor, SplatExchange& exchange);
  void SelectRanges(const SurfelCloud& cloud, std::size_t index, const Executor& executor);
  void Append(const SplatContext& context, const SurfelCloud& cloud, const CutRanges& ranges,
    const Executor& executor);
  void PlaceRanges(const SurfelCloud& cloud, bool mayWait, const Executor& executor);
  RasterSettings ResolveCoarseGrids(const Executor& executor);
  void RasterTiles(
    const RasterSettings& settings, const Executor& executor, const RenderTarget& target);
  void ShareTime(double milliseconds);

  FrameStatistics Stats;
  double TileSeconds = 0; // sum over all threads

  // Memory that is kept from frame to frame: a steady frame allocates nothing.
  SplatContext Cell;          // the frame through one cell of the lens
  SplatContext CellInPicture; // the same without coarse grids
  SubAperture Whole;          // the lens that is divided
  Vector3 CellCenter{ { 0, 0, 0 } };
  bool IsFirstCell = true;
  double CellShare = 1.0, CellReach = 1.0; // CutCamera
  CutWork Cut;
  std::vector<std::vector<CutRange>> SharedCuts; // [cloud] of all cells
  std::vector<CutRange> Ranges;                  // the cut of one cloud
  std::vector<CutRange> PictureRanges;           // those of them that are not drawn on coarse grids
  SplatMaker Maker;
  SplatList List;
  LazySplats Lazy;
  CoarseWork Coarse;
  TileBins Bins;
  Pool<TileRaster> Rasters;
  std::vector<TileResult> Tiles;
  FrameAverage Average;
  DoubtfulTiles Doubtful;       // where cells are rendered
  bool SumsDoubts = false;      // while the picture through the whole lens is rendered
  std::vector<float> MeanColor; // the mean of the cells there
  std::vector<float> MeanDepth;
};
}
