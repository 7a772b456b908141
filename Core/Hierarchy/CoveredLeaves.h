// SPDX-License-Identifier: BSD-3-Clause
/**
 * Leaves that are covered by another sheet which faces the same way, such as a wall behind a
 * poster: a node of both must not have the mean of their colours. (Ours.)
 *
 * Two sheets are one node where the gap between them is smaller than the node. So this is looked
 * for among the neighbours in the tree: leaves, and nodes of every fourth level, in runs of
 * RunSize. An element i is covered by those whose planes lie in front of its own,
 *
 *   v_i = 3/2 sum_j k(q_ij), at most 1,   k(q) = max(0, 1 - q / 3)^2 / pi,   q = d^2 / a_j
 *
 * j: n_i.(x_j - x_i) > GapOfSheets sqrt(a_i), n_i.n_j > CosineOfSheet; d the distance of their
 * places across n_i; a areas, n normals. The sum is 1 in the mean behind a sheet that covers all.
 * Half as much again counts, since the points of sheets are random.
 */
#pragma once

#include "Core/Base/Executor.h"
#include "Core/Hierarchy/HierarchyLayout.h"
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
}
