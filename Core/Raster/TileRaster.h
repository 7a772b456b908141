// SPDX-License-Identifier: BSD-3-Clause
/**
 * Streams the sorted splats and tents of one tile through one open A-buffer layer per pixel.
 *
 * They come by ascending near depth. Once one begins behind the far end of a pixel's open
 * layer, nothing later can join that layer: it is closed, composited front to back and forgotten.
 * This equals the merge of all z-ranges into their unions and needs no list per pixel.
 */
#pragma once

#include "Core/Raster/ABuffer.h"
#include "Core/Raster/Frame.h"
#include "Core/Raster/RasterTarget.h"
#include "Core/Raster/TileBinning.h"
#include "Core/Splats/LazySplats.h"

#include <cstdint>
#include <vector>

namespace SurfelSplatting
{
class TileRaster
{
public:
  /// @param occluderDepth [height][width] depth of opaque props, or null
  /// @param sink       receives the closed layers, or null
  /// @param skipHidden whether to stop where all of a tile is opaque; without a sink only
  void Set(const RasterSettings& settings, const float* occluderDepth, LayerSink* sink,
    bool skipHidden);

  struct Counts
  {
    std::uint64_t Fragments = 0;
    std::uint64_t LazyPairs = 0; ///< splats that were made when they were needed
    std::uint64_t Hidden = 0;    ///< splats that were skipped, since all of the tile was opaque
  };

  /// Rasterises a tile into the frame.
  /// @param lazy further splats, or null
  Counts Render(const SplatList& list, const TileBins& bins, std::size_t tile, const Frame& frame,
    LazySplats* lazy = nullptr);

private:
  Counts RenderLayers(
    const SplatList& list, const TileBins& bins, std::size_t tile, LazySplats* lazy);
  Counts RenderNearest(const SplatList& list, const TileBins& bins, std::size_t tile);
  void BeginPart(LayerSink* sink, float share);
  void TakeRuns(LazySplats& lazy, const std::uint32_t*& run, const std::uint32_t* end);
  bool AddBefore(
    float depth, const SplatList& list, const TileBins& bins, LazySplats* lazy, Counts& counts);
  unsigned int BehindProps(int block, float near) const;
  bool IsOpaque(float near);
  void Place(std::size_t tile, const TileBins& bins, const Frame& frame);
  void Clear();
  void Store(const Frame& frame) const;
  static void SendToSink(void* self, const PixelTile& tile, int block, unsigned int lanes, const float* keep);
  void SendFragments(int block) const;
  int BlockX(int block) const { return this->OriginX + block % BlocksPerRow * BlockSize; }
  int BlockY(int block) const { return this->OriginY + block / BlocksPerRow * BlockSize; }
  std::uint64_t Add(const SplatList& list, std::size_t i);
  std::uint64_t AddSplat(const SplatList& list, std::size_t i);
  std::uint64_t AddTent(const Tent& tent);
  TilePlace PlaceInTile(const PixelBox& box, float x, float y) const;
  CloseCallback Callback();
  void CloseAll();

  RasterSettings Settings{};
  float LargestCoarseColor = 0.0f;
  const float* OccluderDepth = nullptr;
  LayerSink* Sink = nullptr;
  bool SkipHidden = false;
  int OriginX = 0;
  int OriginY = 0;
  int Width = 0; // of the frame
  int Height = 0;
  std::uint64_t Next = 0; // of the tile's binned splats and tents
  std::uint64_t Last = 0;
  std::vector<std::uint64_t> Pending; // lazy splats: near depth above, index below
  std::size_t PendingNext = 0;
  float PendingFar = 0.0f; ///< far end of the runs taken so far
  KeySorter Sorter;
  PixelTile Tile;
};
}
