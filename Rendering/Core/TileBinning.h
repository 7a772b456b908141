// SPDX-License-Identifier: BSD-3-Clause
/**
 * Which splats touch which tile, sorted by near depth: what lets the raster keep one open layer per
 * pixel.
 */
#pragma once

#include "Executor.h"
#include "Pool.h"
#include "RasterKernel.h"
#include "SplatList.h"

#include <cstdint>
#include <cstring>
#include <vector>

namespace SurfelSplatting
{
/// Tiles that a box of pixels, not empty, touches; both ends included.
struct TileRange
{
  int X0, Y0, X1, Y1;

  explicit TileRange(const PixelBox& box)
    : X0(box.X0 / TileSize)
    , Y0(box.Y0 / TileSize)
    , X1((box.X1 - 1) / TileSize)
    , Y1((box.Y1 - 1) / TileSize)
  {
  }
};

/// Order of floats as unsigned integers.
inline std::uint32_t SortableBits(float value)
{
  std::uint32_t bits;
  std::memcpy(&bits, &value, sizeof(bits));
  return bits & 0x80000000u ? ~bits : bits | 0x80000000u;
}

/// Sorts keys of (SortableBits of a depth) << 32 | index, ascending.
class KeySorter
{
public:
  void Sort(std::vector<std::uint64_t>& keys);

private:
  std::vector<std::uint64_t> Other;
};

struct TileBins
{
  int TilesX = 0;
  int TilesY = 0;
  std::vector<std::uint64_t> Offsets; ///< [tiles + 1] into Indices
  std::vector<std::uint32_t> Indices; ///< splats of each tile, by ascending (Near, index)

  std::vector<std::uint64_t> Cursors; ///< memory of BinSplats
  struct Sorting
  {
    std::vector<std::uint64_t> Keys;
    KeySorter Sorter;
  };
  Pool<Sorting> Sortings; ///< memory of SortBins

  std::size_t NumberOfTiles() const { return static_cast<std::size_t>(TilesX) * TilesY; }
};

/// @param level of the splats' grid (CoarseGrid.h)
/// @param width of that grid
void BinSplats(const SplatList& list, int level, int width, int height, const Executor& executor,
  TileBins& bins);

/// Sorts every tile's splats; ties by index, so that the order does not depend on threads.
void SortBins(const SplatList& list, const Executor& executor, TileBins& bins);
}
