// SPDX-License-Identifier: BSD-3-Clause
/**
 * Sets of a tile's blocks. Bit i: block i.
 */
#pragma once

#include "Core/Raster/RasterTarget.h"

namespace SurfelSplatting
{
/// Bits [begin, end) of a row of blocks; 0 <= begin, end <= BlocksPerRow.
SURFELSPLATTING_INLINE std::uint64_t BlocksBetween(unsigned int begin, unsigned int end)
{
  constexpr unsigned int all = (1u << BlocksPerRow) - 1;
  return all & (all << begin) & (all >> (BlocksPerRow - end));
}

/// Bit i: a span of the tile's pixels touches block i.
SURFELSPLATTING_INLINE std::uint64_t BlocksOf(const PixelBox& span)
{
  if (span.X0 >= span.X1 || span.Y0 >= span.Y1)
  {
    return 0; // and shifts of 64 bits are undefined
  }
  const auto block = [](int pixel) { return static_cast<unsigned int>(pixel) / BlockSize; };
  const std::uint64_t columns = BlocksBetween(block(span.X0), block(span.X1 + BlockSize - 1));
  constexpr std::uint64_t all = ~std::uint64_t{ 0 }, firstOfRows = all / ((1u << BlocksPerRow) - 1);
  const unsigned int below = BlocksPerRow * block(span.Y0);
  const unsigned int above = BlocksPerTile - BlocksPerRow * block(span.Y1 + BlockSize - 1);
  return (columns * firstOfRows) & (all << below) & (all >> above);
}
}
