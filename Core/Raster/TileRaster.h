// SPDX-License-Identifier: BSD-3-Clause
/**
 * Streams the sorted splats and tents of one tile through one open A-buffer layer per pixel.
 *
 * They come by ascending near depth. What of a layer lies far enough in front of the next splat is
 * composited front to back and forgotten (ABuffer.h): this needs no list per pixel.
 */
#pragma once

#include "Core/Raster/ABuffer.h"
#include "Core/Raster/Frame.h"
#include "Core/Raster/GaussianRun.h"
#include "Core/Raster/RasterTarget.h"
#include "Core/Raster/TileBinning.h"
#include "Core/Splats/LazySplats.h"

#include <cstdint>
#include <vector>

namespace SurfelSplatting
{
/// Layers of the cells of a coarse grid's block.
struct CellLayers
{
  const PixelTile& Tile;
  int Block;
  int X, Y;           ///< the cell of lane 0
  unsigned int Lanes; ///< those that have a layer, of which the weight is > 0
  const CellTents& Tents;
};

/// Receives the layers of a coarse grid's cells.
class CellSink
{
public:
  virtual ~CellSink() = default;
  virtual void Receive(const CellLayers& layers) = 0;
};

class TileRaster
{
public:
  /// @param occluderDepth [height][width] depth of opaque props, or null
  /// @param sink       receives what layers add to the picture, or null
  /// @param skipHidden whether to stop where all of a tile is opaque; without a sink only
  void Set(
    const RasterSettings& settings, const float* occluderDepth, LayerSink* sink, bool skipHidden);

  /// For a coarse grid, whose layers are not composited.
  void SetCoarse(const RasterSettings& settings, CellSink& cells);

  struct Counts
  {
    std::uint64_t Fragments = 0;
    std::uint64_t LazyPairs = 0; ///< splats that were made when they were needed
    std::uint64_t Hidden = 0;    ///< splats that were skipped, since all of the tile was opaque
    float Doubt = 0.0f;          ///< largest one about a pixel; with RasterSettings::Doubts only
  };

  /// Rasterises a tile into the frame.
  /// @param lazy further splats, or null
  Counts Render(const SplatList& list, const TileBins& bins, std::size_t tile, const Frame& frame,
    LazySplats* lazy = nullptr);

private:
  Counts RenderLayers(
    const SplatList& list, const TileBins& bins, std::size_t tile, LazySplats* lazy);
  Counts RenderNearest(const SplatList& list, const TileBins& bins, std::size_t tile);
  void TakeRuns(LazySplats& lazy, const std::uint32_t*& run, const std::uint32_t* end);
  bool AddBefore(
    float depth, const SplatList& list, const TileBins& bins, LazySplats* lazy, Counts& counts);
  unsigned int BehindProps(int block, float near) const;
  bool IsOpaque(float near) const;
  bool BecomesOpaque(float near);
  float LargestDoubt() const;
  void Clear();
  void ClearPixels();
  void Store(const Frame& frame) const;
  template <class Function>
  void ForPixels(int block, unsigned int lanes, Function&& function) const;
  static void SendToSink(
    void* self, const PixelTile& tile, int block, unsigned int lanes, const LeakedLayers& leaked);
  static void SendCells(
    void* self, const PixelTile& tile, int block, unsigned int lanes, const CellTents& tents);
  int BlockX(int block) const { return this->OriginX + block % BlocksPerRow * BlockSize; }
  int BlockY(int block) const { return this->OriginY + block / BlocksPerRow * BlockSize; }
  void Add(const SplatList& list, std::size_t i);
  void AddSplat(const SplatList& list, std::size_t i);
  void AddTent(const Tent& tent);
  void AddToBatch(const BatchItem& item);
  void Flush();
  void AddGaussian(const SplatList& list, std::size_t i);
  bool MayBeginRun(float depth) const;
  void EndRun();
  TilePlace PlaceInTile(const PixelBox& box, float x, float y) const;
  RasterCallbacks Callbacks();
  void CloseAll();

  RasterSettings Settings{};
  float LargestCoarseColor = 0.0f;
  const float* OccluderDepth = nullptr;
  LayerSink* Sink = nullptr;
  CellSink* Cells = nullptr;
  bool SkipHidden = false;
  bool IsEmpty = false; // nothing lies in the tile, which has not been cleared
  int OriginX = 0;
  int OriginY = 0;
  int Width = 0; // of the frame
  int Height = 0;
  std::uint64_t Next = 0; // of the tile's binned splats and tents
  std::uint64_t Last = 0;
  std::vector<std::uint64_t> Pending; // lazy splats: depth by which they come above, index below
  std::size_t PendingNext = 0;
  float PendingFar = 0.0f; ///< far end of the runs taken so far
  float Delay = 0.0f;      ///< RasterSettings::LargestDelay, also of the lazy splats so far
  KeySorter Sorter;
  BatchItem Batch[BatchSize]; // of surfels and tents, which wait to be added together
  int BatchCount = 0;
  std::uint64_t Fragments = 0;
  PixelTile Tile;
  float NearestProp = 0.0f; // depth of the nearest one in the tile
  GaussianRun Run;          // of blurred Gaussians behind what the tile has
};
}
