// SPDX-License-Identifier: BSD-3-Clause
/**
 * The order of surfels that makes a hierarchy; an implicit tree needs no more (HierarchyLayout.h).
 * HierarchyBuilder.h then fills the nodes.
 */
#pragma once

#include "Core/Base/Executor.h"
#include "Core/Hierarchy/HierarchyLayout.h"
#include "Core/Surfels/SurfelCloud.h"

#include <cstdint>
#include <vector>

namespace SurfelSplatting
{
/// Leaves in the order of the tree: indices of surfels of the cloud.
struct KdTreeOrder
{
  HierarchyLayout Layout;
  std::vector<std::uint32_t> Surfels;       ///< [leaves]
  std::uint64_t NumberOfInvalidSurfels = 0; ///< with non-finite values, left out
};

/**
 * Sorts the surfels into a kd-tree whose ranges of 2^l leaves are its nodes. A range is halved
 * across the direction of its largest extent. Small folded ranges (two sheets, an edge) are halved
 * by their normals, so that a node's area vector tells how much it covers. Ties are broken by
 * index: the order is the same at any number of threads.
 */
KdTreeOrder MakeKdTreeOrder(const SurfelCloud& cloud, const Executor& executor);
}
