// SPDX-License-Identifier: BSD-3-Clause
/**
 * Draws wide splats on coarse grids, so that raster time depends on the number of splats instead of
 * their area.
 *
 * A splat whose smallest standard deviation is at least 1.5 cells of a grid with cells of d = 2^l
 * px (1.15 of 2 px) loses nothing by being sampled there and interpolated bilinearly, once the
 * interpolation's own variance, d^2/6, has been taken out of W (ResamplingKernel.h,
 * FootprintOf::Without). Each level is an A-buffer of low resolution, drawn by the same tiles. Its
 * closed layers, with their z-ranges and un-normalised sums, go into the depth-sorted stream of the
 * picture as tents of 2d by 2d px (Tent.h). There they join what else lies at their depth, by the
 * one rule of ABuffer.h.
 *
 *   cell (i, j) of a level is centred at (i d, j d) px, so that every pixel has four neighbours
 */
#pragma once

#include "Core/Base/Buffer.h"
#include "Core/Base/CoarseLevels.h"
#include "Core/Base/TileSet.h"
#include "Core/Raster/TileBinning.h"
#include "Core/Raster/TileRaster.h"

#include <array>
#include <cstdint>
#include <vector>

namespace SurfelSplatting
{
/// The result of a tile of a level.
struct TileTents
{
  /// Where a tent belongs among those of its tile.
  struct Place
  {
    std::uint32_t Cell; ///< of the tile, row by row
    float Near;         ///< Tent::Near
  };

  Buffer<Tent> Tents; ///< in the order in which the raster closed them
  Buffer<Place> Places;
  std::size_t First = 0; ///< index of the first one among SplatList::Tents
  std::uint64_t Fragments = 0;

  void Clear()
  {
    this->Tents.Clear();
    this->Places.Clear();
  }
  /// Appends one, undefined, and its place.
  Tent& Add()
  {
    const std::size_t last = this->Tents.Size();
    this->Tents.Resize(last + 1);
    this->Places.Resize(last + 1);
    return this->Tents[last];
  }
};

/// Memory of ResolveCoarseLevels that is kept from frame to frame. SplatList::Tents points to it.
struct CoarseWork
{
  TileBins Bins;
  std::array<std::vector<TileTents>, HighestCoarseLevel + 1> Levels;
};

/**
 * Draws all coarse levels and appends their layers to the list's tents.
 * @param drawn tiles of the picture; tents that touch no others are left out
 * @return number of fragments on the coarse levels
 */
std::uint64_t ResolveCoarseLevels(SplatList& list, const TileSet& drawn,
  const RasterSettings& settings, const Executor& executor, Pool<TileRaster>& rasters,
  CoarseWork& work);
}
