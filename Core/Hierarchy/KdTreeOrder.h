// SPDX-License-Identifier: BSD-3-Clause
/**
 * The order of surfels that makes a hierarchy: an implicit tree needs no more (HierarchyLayout.h).
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
 * Sorts the surfels into a kd-tree whose ranges of 2^l leaves are its nodes: halved across the
 * direction of their largest extent, and small folded ones (two sheets, an edge) by their normals,
 * so that a node's area vector stands for what it covers. Ties by index: the same at any number of
 * threads.
 */
KdTreeOrder MakeKdTreeOrder(const SurfelCloud& cloud, const Executor& executor);
}
