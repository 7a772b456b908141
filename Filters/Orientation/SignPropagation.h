// SPDX-License-Identifier: BSD-3-Clause
/**
 * Propagates the signs of normals over the neighbourhood graph: from edges to patches, from patches
 * to components. The outside of a component is decided later (OutsideDecision.h).
 */
#pragma once

#include "Filters/Common/StageProgress.h"
#include "Filters/Orientation/OrientationGraph.h"

namespace SurfelGeometry
{
/// Joins points to components of consistent sign. Where the votes contradict each other, as where
/// surfaces cross, components stay apart. Returns false if stopped.
bool PropagateSigns(const NeighborGraph& graph, const EdgeVotes& edges,
  const std::vector<PlaneFit>& fits, const StageProgress& progress, ParityUnionFind& signs);
}
