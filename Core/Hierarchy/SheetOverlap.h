// SPDX-License-Identifier: BSD-3-Clause
/**
 * What sheets that face the same way cover of one another, such as a poster of the wall behind it.
 * (Ours.)
 *
 * Where a blur is wider than the gap between two sheets, they are one layer, in which they would
 * add up; where nodes are wider, a node of both would have the mean of their colours. So each node
 * has an overlap, 1 - u (SurfelCloud::OverlapOf). u is what of it no other sheet covers:
 *
 *   u = 1 - o                      of a surfel of overlap o, for the nodes above
 *   u = sum a_i u_i / sum a_i      of a node with children i, a their areas
 *   u = u (1 - v)                  of leaves, and of nodes of every second level
 *
 * v is looked for among the neighbours in the tree, in runs of RunSize elements of a level. An
 * element i is covered by those whose planes lie in front of its own,
 *
 *   v_i = 7/4 (sum_j k(q_ij) - 1/7), within [0, 1],
 *   k(q) = max(0, 1 - q / 3)^2 / pi,   q = d^2 / a_j
 *
 * j: n_i.(x_j - x_i) between NearestSheet and FarthestSheet sqrt(a_i), n_i.n_j > CosineOfSheet; d
 * the distance of their places across n_i; n normals. The sum is 1 in the mean behind a sheet that
 * covers all, 1/2 behind its border.
 *
 * A node is drawn where the blur's radius is two to three times its size (HierarchyCut.h), so that
 * sheets cover one another that are up to about three radii apart, from wherever they are seen.
 * Leaves are drawn where there is less blur, and only have the overlap of their own.
 */
#pragma once

#include "Core/Base/Executor.h"
#include "Core/Hierarchy/HierarchyLayout.h"
#include "Core/Surfels/HierarchyNode.h"
#include "Core/Surfels/SurfelCloud.h"

#include <vector>

namespace SurfelSplatting
{
/// What of each leaf no other sheet covers, [0, 1]: the product of 1 - v over it and its ancestors.
/// Two-sided leaves have no front, and 1. Colours do not matter.
/// @param tree leaves and nodes
/// @return [layout.NumberOfLeaves()], or empty if none is covered, as of all but surfels
std::vector<float> FindUncovered(
  const SurfelCloud& tree, const HierarchyLayout& layout, const Executor& executor);

/// Gives the one-sided nodes of surfels, which have all else, their overlaps.
/// @param tree leaves and nodes
void FillSheetOverlaps(const SurfelCloud& tree, const HierarchyLayout& layout,
  const Executor& executor, HierarchyNode* nodes);

/// Whether the nodes of level 1 have the overlaps that their leaves give them.
/// @param unseen differences up to this do not count
bool AreSheetOverlaps(
  const SurfelCloud& tree, const HierarchyLayout& layout, const Executor& executor, double unseen);
}
