// SPDX-License-Identifier: BSD-3-Clause
/**
 * Builds a hierarchy over surfels (QSplat: Rusinkiewicz and Levoy 2000; used for depth of field by
 * Krivanek, Zara and Bouatouch 2003, section 3.3).
 */
#pragma once

#include "Executor.h"
#include "HierarchyLayout.h"
#include "SurfelCloud.h"

#include <cstdint>
#include <vector>

namespace SurfelSplatting
{
/// Leaves in the order of the tree: indices of surfels of the cloud.
struct LeafOrder
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
LeafOrder OrderLeaves(const SurfelCloud& cloud, const Executor& executor);

/// Where the nodes' values go, in the layout's order; the caller's memory.
struct NodeArrays
{
  float* Positions = nullptr;       ///< [nodes][3]
  float* Covariances = nullptr;     ///< [nodes][6]
  float* AreaVectors = nullptr;     ///< [nodes][3]
  float* LeafCovariances = nullptr; ///< [nodes][6]
  float* Opacities = nullptr;       ///< [nodes], may be null: all 1
  float* Areas = nullptr;           ///< [nodes] sum of the leaves' areas
  float* Bounds = nullptr;          ///< [nodes] radius of a sphere about p with all leaves' centres
  float* Cones = nullptr;           ///< [nodes] cosine of a cone about A with all leaves' normals
};

/// @param shift subtracted from the cloud's positions before they become float
void FillNodes(const SurfelCloud& cloud, const LeafOrder& order, const Vector3& shift,
  const Executor& executor, const NodeArrays& nodes);
}
