// SPDX-License-Identifier: BSD-3-Clause
/**
 * Levels of coarse grids (CoarseGrid.h). The cells of a level are 2^level px wide.
 */
#pragma once

#include "Core/Simd/RealLanes.h"

namespace SurfelSplatting
{
/// Finer levels would cost more for their tents (Tent.h) than they save.
constexpr int LowestCoarseLevel = 1;
constexpr int HighestCoarseLevel = 6;
constexpr double CoarseCellsPerDeviation = 1.5;

/// Cell size, px, of the coarsest level that can represent a splat whose smallest variance is
/// smallestVariance (px^2). 1: the picture itself.
template <class Real>
SURFELSPLATTING_INLINE Real CoarseCell(const Real& smallestVariance)
{
  Real cell = Uniform<Real>(1.0);
  for (int level = LowestCoarseLevel; level <= HighestCoarseLevel; ++level)
  {
    const double deviation = CoarseCellsPerDeviation * (1 << level);
    cell = smallestVariance >= deviation * deviation ? Uniform<Real>(1 << level) : cell;
  }
  return cell;
}

/// The level with this cell size, px; 0: the picture.
SURFELSPLATTING_INLINE int LevelOfCell(int cell)
{
  int level = 0;
  while ((1 << level) < cell)
  {
    ++level;
  }
  return level;
}

/// Number of cells along a side of the picture: one for every cell size of pixels and one more, so
/// that every pixel lies between two cells.
SURFELSPLATTING_INLINE int CoarseSize(int pixels, int cell)
{
  return (pixels + cell - 1) / cell + 1;
}

/// Cell i, of d px, is centred at i d px in the picture and at i + 1/2 in the coarse raster. The 2d
/// px of its tent then begin and end at blocks of pixels (RasterTarget.h) as often as possible.
constexpr double CoarseOrigin = 0.5;
}
