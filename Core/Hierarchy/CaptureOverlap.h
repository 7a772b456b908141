// SPDX-License-Identifier: BSD-3-Clause
/**
 * How much the Gaussians of a capture cover one another, which the lens must not count again.
 *
 * A capture covers its surfaces several times. With the masses m_i (GaussianMass.h) of the
 * Gaussians on a patch of area A, its optical depth is t = sum 2 pi m_i / A, and it hides 1 -
 * exp(-t). Where the lens spreads a small thing over a wide blur, its Gaussians hide one by one, t
 * in all: foliage hid all that is behind. This share of the masses is left out there
 * (SetupGaussians.h):
 *
 *   o = 1 - (1 - exp(-t)) / t
 *
 * What Gaussians of a surface that is wider than the blur hide of the lens is known from the
 * moments of T (LensVisibility.h), which needs all of them. Whether there is such a surface tells
 * the node two levels above, with eigenvalues l1 >= l2 >= l3 of its covariance: twice as wide, it
 * is about as wide as the blur where the node is drawn (HierarchyCut.h). The node has the share
 *
 *   o min(1, l3 / (0.2 l2))
 *
 * Patches are those of the four leaves below a node of level 2.
 */
#pragma once

#include "Core/Base/Executor.h"
#include "Core/Hierarchy/HierarchyLayout.h"
#include "Core/Surfels/SurfelCloud.h"

namespace SurfelSplatting
{
/// o of a patch of leaves [begin, end), [0, 1); 0 of fewer than three.
double OverlapOfPatch(const SurfelCloud& leaves, std::size_t begin, std::size_t end);

/// Gives nodes, which have all else, their shares. @param leaves of a capture
void FillCaptureOverlaps(const SurfelCloud& leaves, const HierarchyLayout& layout,
  const Executor& executor, HierarchyNode* nodes);
}
