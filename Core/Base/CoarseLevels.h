// SPDX-License-Identifier: BSD-3-Clause
/**
 * The levels of coarse grids (CoarseGrid.h): cells of 2^level px.
 */
#pragma once

#include <cmath>

namespace SurfelSplatting
{
/// Levels below cost more for their tents than they spare.
constexpr int LowestCoarseLevel = 1;
constexpr int HighestCoarseLevel = 6;
constexpr double CoarseCellsPerDeviation = 1.5;

/// Coarsest level that carries a splat of this smallest variance (px^2); 0: the picture itself.
inline int CoarseLevel(double smallestVariance)
{
  const double cells = std::sqrt(smallestVariance) / CoarseCellsPerDeviation;
  int level = 0;
  while (level < HighestCoarseLevel && cells >= static_cast<double>(2 << level))
  {
    ++level;
  }
  return level < LowestCoarseLevel ? 0 : level;
}

/// Cells of d px where the picture has this many pixels: one for each d px, and one more, so that
/// every pixel lies between two.
inline int CoarseSize(int pixels, int cell)
{
  return (pixels + cell - 1) / cell + 1;
}

/// Cell i, which the raster has at i + 1/2, is centred at i d px: the 2d px of its tent begin and
/// end with blocks of pixels (RasterTarget.h) as often as can be.
constexpr double CoarseOrigin = 0.5;
}
