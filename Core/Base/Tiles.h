// SPDX-License-Identifier: BSD-3-Clause
/**
 * The square tiles of a picture: the unit of binning (TileBinning.h), raster (TileRaster.h) and
 * threads.
 */
#pragma once

#include "Core/Base/PixelBox.h"

#include <cstddef>

namespace SurfelSplatting
{
constexpr int TileSize = 32; ///< px

/// Blurred Gaussians are drawn on larger cells (GaussianRun.h): so many intervals between their
/// centres along a tile's side, from border to border. One more is a multiple of 4: cells fill
/// whole blocks of the raster, and no lanes are idle.
constexpr int RunIntervals[] = { 19, 11, 7, 3 };
constexpr int MostRunIntervals = RunIntervals[0];

/// Number of tiles that cover this many pixels in one direction.
inline int TileCount(int pixels)
{
  return (pixels + TileSize - 1) / TileSize;
}

/// Tiles that a box of pixels touches, both ends included. The box must not be empty.
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

inline std::size_t NumberOfTiles(const PictureSize& size)
{
  return static_cast<std::size_t>(TileCount(size.Width)) * TileCount(size.Height);
}

/// The tile of a pixel, in a picture of this width.
inline std::size_t TileOf(int x, int y, int width)
{
  return static_cast<std::size_t>(y / TileSize) * TileCount(width) + x / TileSize;
}

/// The pixels of a tile.
inline PixelBox BoxOfTile(std::size_t tile, const PictureSize& size)
{
  const int columns = TileCount(size.Width);
  const int left = static_cast<int>(tile) % columns * TileSize;
  const int bottom = static_cast<int>(tile) / columns * TileSize;
  const int right = left + TileSize, top = bottom + TileSize;
  return { left, bottom, right < size.Width ? right : size.Width,
    top < size.Height ? top : size.Height };
}

/// Calls function(x, y, index) for the pixels of a tile.
template <typename Function>
void ForPixels(std::size_t tile, const PictureSize& size, Function&& function)
{
  const PixelBox box = BoxOfTile(tile, size);
  for (int y = box.Y0; y < box.Y1; ++y)
  {
    for (int x = box.X0; x < box.X1; ++x)
    {
      function(x, y, PixelIndex(x, y, size.Width));
    }
  }
}

/// Calls function(tile) for every tile that a box touches, which must not be empty.
template <typename Function>
void ForTiles(const PixelBox& box, int tilesX, Function&& function)
{
  const TileRange range(box);
  for (int y = range.Y0; y <= range.Y1; ++y)
  {
    for (int x = range.X0; x <= range.X1; ++x)
    {
      function(static_cast<std::size_t>(y) * tilesX + x);
    }
  }
}

/// The order in which threads take a picture's tiles. A piece is a square of 2 x 2, since tiles
/// beside one another share surfels. Pieces are of the first and the second half of the picture by
/// turns: threads that work side by side wait for each other's surfels. (With two threads, frames
/// of the command line take up to 5 % less than row by row, those of CoreSpeed 1 %.)
class TileOrder
{
public:
  static constexpr std::size_t PieceSize = 4;

  TileOrder(int tilesX, int tilesY)
    : TilesX(tilesX)
    , TilesY(tilesY)
    , Columns((tilesX + 1) / 2)
    , Half((Columns * ((tilesY + 1) / 2) + 1) / 2)
  {
  }

  /// Number of places, those without a tile included.
  std::size_t Size() const { return 2 * PieceSize * this->Half; }

  /// The tile at a place, or the number of tiles if there is none.
  std::size_t operator[](std::size_t place) const
  {
    const std::size_t piece = place / PieceSize, square = piece / 2 + piece % 2 * this->Half;
    const std::size_t x = square % this->Columns * 2 + place % 2;
    const std::size_t y = square / this->Columns * 2 + place % PieceSize / 2;
    return x < this->TilesX && y < this->TilesY ? y * this->TilesX + x
                                                : this->TilesX * this->TilesY;
  }

private:
  std::size_t TilesX, TilesY;
  std::size_t Columns; ///< of squares
  std::size_t Half;    ///< of their number, rounded up
};
}
