// SPDX-License-Identifier: BSD-3-Clause
/**
 * Rectangles of pixels.
 */
#pragma once

#include <cstddef>

namespace SurfelSplatting
{
/// Size of a picture in px, or of a coarse grid in cells.
struct PictureSize
{
  int Width, Height;
};

/// Pixels [X0, X1) x [Y0, Y1); empty where X0 >= X1 or Y0 >= Y1.
struct PixelBox
{
  int X0, Y0, X1, Y1;
};

/// The place of a pixel in an array [height][width].
inline std::size_t PixelIndex(int x, int y, int width)
{
  return static_cast<std::size_t>(y) * width + x;
}

inline bool IsEmpty(const PixelBox& box)
{
  return box.X0 >= box.X1 || box.Y0 >= box.Y1;
}
}
