// SPDX-License-Identifier: BSD-3-Clause
/**
 * The tiles of a picture that are drawn.
 */
#pragma once

#include "Core/Base/Tiles.h"
#include "Core/Simd/Inline.h"

namespace SurfelSplatting
{
struct TileSet
{
  PictureSize Picture{ 0, 0 };
  int Columns = 0;
  const unsigned char* Flags = nullptr; ///< [row][column], 1 for tiles that are drawn; null: all

  /// Whether a box of pixels touches any. It may be empty, and reach beyond the picture.
  SURFELSPLATTING_INLINE bool Touch(const PixelBox& box) const
  {
    if (!this->Flags)
    {
      return true;
    }
    const int left = box.X0 > 0 ? box.X0 / TileSize : 0;
    const int bottom = box.Y0 > 0 ? box.Y0 / TileSize : 0;
    const int right = box.X1 < this->Picture.Width ? box.X1 : this->Picture.Width;
    const int top = box.Y1 < this->Picture.Height ? box.Y1 : this->Picture.Height;
    for (int y = bottom; y * TileSize < top; ++y)
    {
      for (int x = left; x * TileSize < right; ++x)
      {
        if (this->Flags[static_cast<std::size_t>(y) * this->Columns + x] != 0)
        {
          return true;
        }
      }
    }
    return false;
  }
};
}
