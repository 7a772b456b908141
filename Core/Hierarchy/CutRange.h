// SPDX-License-Identifier: BSD-3-Clause
/**
 * What a cut through a hierarchy (HierarchyCut.h) consists of: runs of nodes.
 *
 * Shortly before the nodes of a run give way to those of the next level, each pair of siblings
 * merges: the two move to the place, the extent and the colour of their parent. With the share m
 * that the parent has (Merging) and t = sqrt(1 - m), a child becomes
 *
 *   p = p_0 + t (p_i - p_0),  c = c_0 + t (c_i - c_0),  A = t A_i + (1 - t) s A_0,
 *   S = S_0 + (1 - m) (S_i - S_0),  H = H_0 + (1 - m) (H_i - H_0),
 *
 * where p, A, S, c and H are as in NodeMoments.h and NodeColors.h, 0 is the parent, and s the
 * child's share of its area. Area vector, mean, covariance and colour gradient of the pair are then
 * those of the parent for every m, since S_0 = sum s (S_i + (p_i - p_0) (p_i - p_0)') and so on; at
 * m = 1 the pair is the parent. (The colours have the shares of their opacities, which are nearly
 * those of the areas.)
 */
#pragma once

#include "Core/Base/PixelBox.h"

#include <cstddef>
#include <cstdint>

namespace SurfelSplatting
{
/// Where little of the light shows a run, ancestors so many levels above may be drawn instead
/// (LazySplats.h).
constexpr int LevelsToAncestors = 3;

/// A run of consecutive nodes to draw. All have the same level and lie below one entry of the
/// ClusterBounds.
struct CutRange
{
  std::size_t Begin;
  std::uint32_t Count;
  std::uint32_t Level;
  float Merging = 0.0f;        ///< m, [0, 1]
  std::size_t Parents = 0;     ///< of the first two nodes; those of the others follow. If m > 0
  bool HasAncestors = false;   ///< of Gaussians in space, which may be drawn instead
  bool Wide = false;           ///< all of its splats are wide enough for a coarse grid
  float Blur = 0.0f;           ///< smallest radius of the lens's blur in it, px
  float Near = -1e30f;         ///< no splat of it begins in front of this
  float Far = 1e30f;           ///< no splat of it ends behind this
  PixelBox Box{ 0, 0, 0, 0 };  ///< contains all of its splats
  std::uint64_t FirstLeaf = 0; ///< of those below it: the number of the first in its tree
};
}
