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
/// A splat's smallest standard deviation is at least so many cells of its grid. With 1.15 on all
/// levels, a lion has a third more seams, and seven cells lose up to 0.4 dB. (Cells of 3, 6, 12,
/// ... px besides make frames no faster, and where two grids meet, a floor's textures lose 0.4 dB.)
constexpr double CoarseCellsPerDeviation = 1.5;
/// The same of the lowest level. Against 1.5, frames take 4 % less; ray-traced scenes gain up to
/// 0.16 dB at 12 px of blur and lose at most 0.05 (seven cells).
constexpr double LowestCellsPerDeviation = 1.15;

/// Cell size, px, of the coarsest level that can represent a splat whose smallest variance is
/// smallestVariance (px^2). 1: the picture itself.
template <class Real>
SURFELSPLATTING_INLINE Real CoarseCell(const Real& smallestVariance)
{
  Real cell = Uniform<Real>(1.0);
  for (int level = LowestCoarseLevel; level <= HighestCoarseLevel; ++level)
  {
    const double perDeviation =
      level == LowestCoarseLevel ? LowestCellsPerDeviation : CoarseCellsPerDeviation;
    const double deviation = perDeviation * (1 << level);
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
