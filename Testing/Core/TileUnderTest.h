// SPDX-License-Identifier: BSD-3-Clause
/**
 * A tile of the raster, and single splats and tents that are added to it.
 */
#pragma once

#include "Core/Raster/RasterTarget.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <memory>

namespace SurfelSplatting
{
constexpr RasterCallbacks Nobody{ nullptr, nullptr, nullptr };

/// A splat and its optional data.
struct SplatData
{
  const Splat& Body;
  const SplatGradient* Gradient;  ///< or null: one colour
  const LensFootprint* Footprint; ///< or null: in focus
};

/// Adds one splat.
inline std::uint64_t AddSplat(const RasterTarget& target, PixelTile& tile, const SplatData& splat,
  const TilePlace& place, const RasterSettings& settings, const RasterCallbacks& callbacks)
{
  const BatchItem item{ &splat.Body, nullptr, splat.Gradient, splat.Footprint, place,
    settings.LargestColor };
  return target.AddBatch(tile, &item, 1, settings, callbacks);
}

/// Adds one tent.
inline std::uint64_t AddTent(const RasterTarget& target, PixelTile& tile, const Tent& tent,
  const TilePlace& place, const RasterSettings& settings)
{
  const BatchItem item{ nullptr, &tent, nullptr, nullptr, place, settings.LargestColor };
  return target.AddBatch(tile, &item, 1, settings, Nobody);
}

/// A tile without layers.
inline std::unique_ptr<PixelTile> EmptyTile()
{
  auto tile = std::make_unique<PixelTile>();
  *tile = PixelTile{};
  constexpr float infinity = std::numeric_limits<float>::infinity();
  for (int i = 0; i < BlocksPerTile; ++i)
  {
    std::fill_n(tile->Open[i].Far, PixelsPerBlock, NoFar);
    std::fill_n(tile->Coarse[i].Near, PixelsPerBlock, infinity);
    std::fill_n(tile->Finished[i].OccluderDepth, PixelsPerBlock, infinity);
    std::fill_n(tile->Finished[i].Transmittance, PixelsPerBlock, 1.0f);
  }
  return tile;
}
}
