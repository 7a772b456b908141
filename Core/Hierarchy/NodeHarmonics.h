// SPDX-License-Identifier: BSD-3-Clause
/**
 * Spherical harmonics of a capture's Gaussians and of the nodes above them, packed for drawing: a
 * node has the means of the coefficients, weighted with the masses (GaussianMass.h) and opacities.
 * How the colours change within nodes is told by the constant harmonics.
 */
#pragma once

#include "Core/Base/Executor.h"
#include "Core/Hierarchy/HierarchyLayout.h"
#include "Core/Surfels/HierarchyNode.h"
#include "Core/Surfels/PackedHarmonics.h"
#include "Core/Surfels/SurfelCloud.h"

#include <vector>

namespace SurfelSplatting
{
/**
 * @param tree         leaves and nodes; without Nodes, only the leaves are packed
 * @param coefficients [leaves][count][3], red, green and blue of each harmonic
 * @param count        1, 4, 9 or 16
 * @return of leaves and nodes, in their order
 */
std::vector<PackedHarmonics> PackHarmonics(const SurfelCloud& tree, const HierarchyLayout& layout,
  const float* coefficients, int count, const Executor& executor);

/// Computes the colours of all nodes above the leaves (NodeColors.h) from the constant harmonics of
/// the leaves.
/// @param tree   leaves and nodes, without colours of their own
/// @param packed of the leaves
/// @param colors [layout.NumberOfInnerNodes()]
void FillHarmonicColors(const SurfelCloud& tree, const HierarchyLayout& layout,
  const PackedHarmonics* packed, const Executor& executor, NodeColor* colors);
}
