// SPDX-License-Identifier: BSD-3-Clause
/**
 * What the raster adds to a block: its pixels as a splat sees them, and the splat. Included by the
 * translation units of the raster's targets (RasterTarget.h), whose own this code is.
 */
#pragma once

#include "Core/Raster/RasterTarget.h"
#include "Core/Simd/Lanes.h"

namespace SurfelSplatting
{
namespace
{
/// Columns and rows of a block's pixels.
alignas(64) constexpr float RampX[LaneCount] = { 0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3 };
alignas(64) constexpr float RampY[LaneCount] = { 0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3 };

/// First pixel of a column or row of blocks.
constexpr float FirstPixel[BlocksPerRow] = { 0, 4, 8, 12, 16, 20, 24, 28 };
static_assert(BlockSize == 4 && BlocksPerRow == 8, "FirstPixel has these");

/// Pixels of a block as a splat sees them, or of two blocks (LanePair).
template <class Real>
struct BlockPixels
{
  Real X, Y; // px from the splat's centre
  Real Q;    // squared radius in the kernel's own unit
};

/// @param rampX,rampY from a splat's centre to the pixels of the tile's first block
SURFELSPLATTING_INLINE BlockPixels<Lanes> PixelsAt(
  const Splat& s, const Lanes& rampX, const Lanes& rampY, int block)
{
  const Lanes dx = rampX + FirstPixel[block % BlocksPerRow];
  const Lanes dy = rampY + FirstPixel[block / BlocksPerRow];
  const Lanes u = dx + s.K * dy;
  return { dx, dy, s.A * u * u + s.B * dy * dy };
}

/// Data that a Gaussian in space is drawn from: the copies that AddBlocks makes.
struct SplatCopy
{
  const Splat& S;
  const SpaceFootprint& Footprint; // with a lens
  const RasterSettings& Settings;
};
}
}
