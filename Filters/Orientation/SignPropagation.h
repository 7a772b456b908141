// SPDX-License-Identifier: BSD-3-Clause
/**
 * Propagates the signs of normals over the neighbourhood graph, from patches to components.
 */
#pragma once

#include "Filters/Common/StageProgress.h"
#include "Filters/Orientation/OrientationGraph.h"

namespace SurfelGeometry
{
struct PatchVotes
{
  const NeighborGraph& Graph;
  const EdgeVotes& Edges;
  const PlaneFits& Fits;
};

/// Joins patches to components of consistent sign. Where the votes contradict each other, as where
/// surfaces cross, components stay apart; so do patches whose outsides the votes contradict.
/// `sides`: [n] at the root of a patch or component +1 if its sign is outward, -1 if inward, 0 if
/// that is unknown. Returns false if stopped.
bool JoinPatches(const PatchVotes& votes, const StageProgress& progress, ParityUnionFind& signs,
  std::vector<signed char>& sides);
}
