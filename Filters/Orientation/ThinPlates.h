// SPDX-License-Identifier: BSD-3-Clause
/**
 * Finds plates so thin that the neighbours of a point are on both of their sheets: leaves, paper,
 * cloth.
 *
 * A plane through both sheets has a poor direction, and the sheets mix in every neighbourhood. But
 * the heights of the neighbours have two sharp peaks, so two parallel planes fit them. Solid
 * matter is between the sheets: nobody can scan the walls of so thin a gap. So the outside of each
 * point is known from its neighbours alone.
 */
#pragma once

#include "Filters/Estimation/PlaneFit.h"

namespace SurfelGeometry
{
struct LocalCloud;

/// Gives points on thin plates the normal of their sheets, outward, and marks them `OnPlate`.
/// Points whose normals were given stay as they are. Returns false if stopped.
bool TurnPlatesOutward(const LocalCloud& cloud, const NeighborGraph& graph,
  const StageProgress& progress, PlaneFits& fits);
}
