// SPDX-License-Identifier: BSD-3-Clause
/**
 * Builds the nodes of a hierarchy over surfels (QSplat: Rusinkiewicz and Levoy 2000; used for depth
 * of field by Krivanek, Zara and Bouatouch 2003, section 3.3).
 */
#pragma once

#include "Core/Base/Executor.h"
#include "Core/Hierarchy/HierarchyLayout.h"
#include "Core/Surfels/HierarchyNode.h"
#include "Core/Surfels/SurfelCloud.h"

#include <vector>

namespace SurfelSplatting
{
/**
 * Computes moments and bounds of all nodes above the leaves, summing in double.
 * @param leaves the surfels in the order of the tree (KdTreeOrder.h)
 * @param nodes  [layout.NumberOfInnerNodes()], the caller's memory
 */
void FillNodes(const SurfelCloud& leaves, const HierarchyLayout& layout, const Executor& executor,
  HierarchyNode* nodes);

/// What a Gaussian of a volume that has Normals brings to the NodeMoments::AreaVector of its node.
Vector3 WeightedNormal(const SurfelCloud& cloud, std::size_t i, double weight);

/// V_r, the mean covariance of the leaves, of all nodes above them: [nodes][6] XX YY ZZ XY YZ XZ.
/// S - V_r is the paper's V_q.
/// @param tree leaves and nodes
std::vector<float> MakeLeafCovariances(
  const SurfelCloud& tree, const HierarchyLayout& layout, const Executor& executor);
}
