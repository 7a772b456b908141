// SPDX-License-Identifier: BSD-3-Clause
/**
 * The levels of coarse grids (CoarseGrid.h): cells of 2^level px.
 */
#pragma once

namespace SurfelSplatting
{
/// Levels below cost more for their tents than they spare.
constexpr int LowestCoarseLevel = 1;
constexpr int HighestCoarseLevel = 6;
constexpr double CoarseCellsPerDeviation = 1.5;

/// Cells of a level in a direction where the picture has this many pixels.
inline int CoarseSize(int pixels, int level)
{
  return ((pixels + (1 << level) - 1) >> level) + 2;
}
}
