// SPDX-License-Identifier: BSD-3-Clause
/**
 * Selects which nodes of a hierarchy are drawn: a cut through the tree that is coarse where blur or
 * the pixel hides the loss, and leaves out what the view cannot see. SplatList.h and LazySplats.h
 * make splats of it.
 *
 * There are two rules, both with an error e, 1 by default:
 *
 * - Moments: sigma^2 <= e^2 (0.84^2 h + 0.37^2 V_I), the nodes' variance on the screen
 *   (NodeExtent::Sigma) against those of pixel filter and lens; 0.90 and 0.37 of Gaussians in
 *   space. Nodes are drawn with their full covariance and a colour gradient. Below the size at
 *   which a node is drawn, its two children merge (CutRange.h). The coarsest level that is fine
 *   enough counts, whatever finer ones are.
 *
 * - Paper: r <= e max(C, sqrt(h)), the projected radius of the node's bounding sphere against the
 *   circle of confusion or the pixel (Krivanek, Zara, Bouatouch 2003, section 4, "LOD selection").
 *   Its nodes have mean colours, and W = M V_r M' + h + circumellipse(M V_q M', V_I).
 *
 * The leaves of captures overlap and are no finer than their node: where the lens blurs, sigma^2 is
 * without the leaves' own variance (NodeExtent::Coherence).
 *
 * Nodes whose area vectors cancel (thin or folded surfaces, where the sum no longer tells how much
 * they hide) must be smaller by clamp((|A| / area - 0.6) / 0.35, 0.1, 1).
 */
#pragma once

#include "Core/Base/Executor.h"
#include "Core/Hierarchy/CutSettings.h"

#include <vector>

namespace SurfelSplatting
{
struct SurfelCloud;

/// Writes the cut of a cloud with a ClusterBounds into runs, the same at any number of threads.
/// All cells of the lens share one cut: what any point of the lens can see, with the boxes of a
/// cell at the lens's centre, which may be beyond the picture.
/// @throw DamagedMemory if the cloud has a guard that finds damage
CutStatistics SelectCut(const SurfelCloud& cloud, const CutCamera& camera,
  const CutSettings& settings, const Executor& executor, CutWork& work,
  std::vector<CutRange>& runs);

/// Writes those runs of a cut for all cells that one of them can see, with its boxes.
/// @param view from the lens's centre @param center of the cell, world units in camera space
void SeeFromCell(const std::vector<CutRange>& all, const View& view, const Lens& lens,
  const Vector3& center, std::vector<CutRange>& runs);
}
