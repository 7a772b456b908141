// SPDX-License-Identifier: BSD-3-Clause
/**
 * Which runs (LazySplats.h) a tile draws as their ancestors: those of which it lets little through.
 * What ancestors lack is seen by T, so that their squared error counts by T^2.
 *
 * - Captures: the root mean square of T in all blocks that a run may touch. Gaussians overlap at
 *   random, so that hardly a run of a far side has no bright pixel in front of it.
 * - Volumes, which have no such gaps: the largest T.
 * - Where the lens blurs a run, which hides most of what ancestors lack: the root mean square in
 *   each of the blocks.
 */
#pragma once

#include "Core/Raster/GaussianRun.h"
#include "Core/Raster/RasterTarget.h"
#include "Core/Splats/LazySplats.h"

namespace SurfelSplatting
{
class AncestorChoice
{
public:
  /// @param tile,front what lies in front: the tile's finished layers, then a run, if one is open
  /// @param x,y the tile's first pixel
  AncestorChoice(const LazySplats& lazy, const RasterTarget& target, const PixelTile& tile,
    const GaussianRun& front, int x, int y);

  LazySplats::Wanted operator()(std::uint32_t run) const
  {
    return { run, this->Lazy.HasCoarser(run) && this->IsDim(run) };
  }

private:
  bool IsDim(std::uint32_t run) const;
  float MeanSquare(const PixelBox& span) const;

  const LazySplats& Lazy;
  int OriginX, OriginY;
  BrightBlocks Bright;
  /// Sums of the blocks' mean squares, of those below and to the left.
  float Sums[BlocksPerRow + 1][BlocksPerRow + 1];
};
}
