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
  const std::vector<PlaneFit>& Fits;
  const std::vector<signed char>& Sides; // [n] at the root of a patch: 0 if its outside is unknown
};

/// Joins patches to components of consistent sign. Where the votes contradict each other, as where
/// surfaces cross, components stay apart; so do patches whose outsides are known. A larger patch
/// without an outside does not take that of a smaller one. Returns false if stopped.
bool JoinPatches(const PatchVotes& votes, const StageProgress& progress, ParityUnionFind& signs);
}
