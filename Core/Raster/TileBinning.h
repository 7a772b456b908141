// SPDX-License-Identifier: BSD-3-Clause
/**
 * Finds which splats and tents touch which tile, and sorts them by near depth. This lets the raster
 * (TileRaster.h) keep one open layer per pixel.
 */
#pragma once

#include "Core/Base/Executor.h"
#include "Core/Base/KeySorter.h"
#include "Core/Base/Pool.h"
#include "Core/Base/Tiles.h"
#include "Core/Splats/SplatList.h"

#include <cstdint>
#include <vector>

namespace SurfelSplatting
{
struct TileBins
{
  int TilesX = 0;
  int TilesY = 0;
  std::vector<std::uint64_t> Offsets; ///< [tiles + 1] into Keys
  /// Each tile's splats and tents: their near depths and indices (KeySorter.h), ascending.
  std::vector<std::uint64_t> Keys;

  std::vector<std::uint64_t> Cursors; ///< memory of BinSplats
  Pool<KeySorter> Sorters;            ///< of SortBins

  std::size_t NumberOfTiles() const { return static_cast<std::size_t>(TilesX) * TilesY; }
};

/// Assigns splats to the tiles of their grid, and tents to the tiles of the picture.
/// @param level of the grid (CoarseGrid.h); 0: the picture
/// @param size  of the grid
void BinSplats(const SplatList& list, int level, const PictureSize& size, const Executor& executor,
  TileBins& bins);

/// Sorts the splats and tents of every tile; ties by index, so that the order does not depend on
/// threads.
void SortBins(const Executor& executor, TileBins& bins);
}
