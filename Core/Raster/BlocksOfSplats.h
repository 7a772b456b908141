// SPDX-License-Identifier: BSD-3-Clause
/**
 * Which blocks of a tile a splat touches. Included by the translation units of the raster's targets
 * (RasterTarget.h), whose own this code is.
 */
#pragma once

#include "Core/Raster/BlockMasks.h"
#include "Core/Raster/BlockPixels.h"

namespace SurfelSplatting
{
namespace
{
alignas(
  64) constexpr float Ramp[LaneCount] = { 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15 };

/// Blocks between the support's ends, |dx + K dy| < sqrt((support - B dy^2) / A), in any of a
/// block's four rows of pixels; sixteen rows of pixels at a time.
SURFELSPLATTING_INLINE std::uint64_t BlocksInSupport(
  const Splat& s, const TilePlace& place, float support)
{
  constexpr int rowsOfBlocks = LaneCount / BlockSize;
  // For rounding. NaN becomes the whole row or nothing: no pixel outside of the tile is touched.
  constexpr float margin = 1.0f / 16.0f;
  const float across = 1.0f / s.A;
  std::uint64_t blocks = 0;
  for (int next = place.Span.Y0 / BlockSize; next * BlockSize < place.Span.Y1; next += rowsOfBlocks)
  {
    const int j = next < BlocksPerRow - rowsOfBlocks ? next : BlocksPerRow - rowsOfBlocks;
    const Lanes dy = Lanes::Load(Ramp) + (static_cast<float>(j * BlockSize) + 0.5f - place.Y);
    const Lanes half = SquareRoot(Larger(support - s.B * dy * dy, 0.0f) * across) + margin;
    const Lanes center = (place.X - 0.5f) - s.K * dy;
    // The first pixel of a row is the next one behind its end.
    const Lanes first = (1.0f - margin) + (center - half);
    alignas(64) float low[LaneCount], high[LaneCount];
    Smaller(SmallestOfFour(Larger(first, 0.0f)), TileSize).Store(low);
    Larger(Smaller(LargestOfFour(center + half), TileSize - 1.0f), -1.0f).Store(high);
    for (int i = 0; i < rowsOfBlocks; ++i)
    {
      const unsigned int begin = static_cast<unsigned int>(low[i * BlockSize]) / BlockSize;
      const unsigned int end =
        static_cast<unsigned int>(high[i * BlockSize] + BlockSize) / BlockSize;
      blocks |= BlocksBetween(begin, end) << ((j + i) * BlocksPerRow);
    }
  }
  return blocks;
}

/// Narrower spans are not worth narrowing. A fragment of a coarse grid takes longer.
constexpr int FewPixels = 3 * BlockSize, FewCells = BlockSize;

/// Blocks that a splat with this support may touch.
/// @param few FewPixels or FewCells
SURFELSPLATTING_INLINE std::uint64_t BlocksOfSplat(
  const Splat& s, const TilePlace& place, float support, int few)
{
  const std::uint64_t blocks = BlocksOf(place.Span);
  return place.Span.X1 - place.Span.X0 > few ? blocks & BlocksInSupport(s, place, support) : blocks;
}

/// A step of Transpose: exchanges blocks of Step x Step bits beside the diagonal.
template <unsigned int Step>
SURFELSPLATTING_INLINE void TransposeBlocks(std::uint64_t (&words)[64])
{
  constexpr std::uint64_t mask = ~std::uint64_t{ 0 } / ((std::uint64_t{ 1 } << Step) + 1);
  for (unsigned int first = 0; first < 64; first += 2 * Step)
  {
    for (unsigned int i = first; i < first + Step; ++i)
    {
      const std::uint64_t change = (words[i] >> Step ^ words[i + Step]) & mask;
      words[i] ^= change << Step;
      words[i + Step] ^= change;
    }
  }
}

/// Exchanges bit k of word i for bit i of word k. Constant steps, so that compilers vectorize them.
SURFELSPLATTING_INLINE void Transpose(std::uint64_t (&words)[64])
{
  TransposeBlocks<32>(words);
  TransposeBlocks<16>(words);
  TransposeBlocks<8>(words);
  TransposeBlocks<4>(words);
  TransposeBlocks<2>(words);
  TransposeBlocks<1>(words);
}
}
}
