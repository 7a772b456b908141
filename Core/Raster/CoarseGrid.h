// SPDX-License-Identifier: BSD-3-Clause
/**
 * Wide splats on coarse grids: raster time follows the number of splats instead of their area.
 *
 * A splat whose smallest standard deviation is at least 1.5 cells of a grid with cells of d = 2^l
 * px loses nothing by being sampled there and interpolated bilinearly, once the interpolation's own
 * variance, d^2/6, has been taken out of W (ResamplingKernel.h, Footprint::Without). Each level is
 * an A-buffer of low resolution, run by the same tiles; its closed layers, with their z-ranges and
 * un-normalised sums, go as tents of 2d by 2d px into the depth-sorted stream of the picture and
 * join with what else lies at their depth, by the one rule of ABuffer.h.
 *
 *   cell (i, j) of a level is centred at (i d, j d) px, so that every pixel has four neighbours
 */
#pragma once

#include "Core/Base/CoarseLevels.h"
#include "Core/Raster/TileBinning.h"
#include "Core/Raster/TileRaster.h"

#include <cstdint>
#include <vector>

namespace SurfelSplatting
{
/// What the tiles of a level have given, tile by tile.
struct TileTents
{
  std::vector<Splat> Splats;
  std::vector<PixelBox> Boxes;
  std::uint64_t Fragments = 0;
};

/// Memory of ResolveCoarseLevels, kept from frame to frame.
struct CoarseWork
{
  TileBins Bins;
  std::vector<TileTents> Tiles;
};

/**
 * Rasters all coarse levels and appends their layers to the list, as splats of the picture.
 * @param width  of the picture, px
 * @return number of fragments on the coarse levels
 */
std::uint64_t ResolveCoarseLevels(SplatList& list, int width, int height,
  const RasterSettings& settings, const Executor& executor, Pool<TileRaster>& rasters,
  CoarseWork& work);
}
