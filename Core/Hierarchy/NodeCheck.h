// SPDX-License-Identifier: BSD-3-Clause
/**
 * Whether a hierarchy's nodes are still those of its leaves. Filters and users may change the
 * opacities, areas, covariances, overlaps, normals and sides of surfels, and know nothing of the
 * nodes.
 */
#pragma once

#include "Core/Base/Executor.h"
#include "Core/Hierarchy/HierarchyLayout.h"
#include "Core/Surfels/SurfelCloud.h"

namespace SurfelSplatting
{
/// Compares the nodes of the lowest level with the kernels of the leaves below them. Where they are
/// does not count; see LeafPlacement.h.
/// @param tree leaves and nodes
bool AreNodesOfKernels(
  const SurfelCloud& tree, const HierarchyLayout& layout, const Executor& executor);

/// Whether the one-sided and the two-sided surfels are still in the tree of their kind.
bool AreSidesOfTrees(const SurfelCloud& leaves, const HierarchyLayout& layout);
}
