// SPDX-License-Identifier: BSD-3-Clause
/**
 * Tangent plane, spacing and tangential extent of every point from its neighbours.
 */
#pragma once

#include "Filters/Estimation/PlaneFit.h"

namespace SurfelGeometry
{
/// Fits all points. Returns false if stopped.
/// @param graph filled; if it has the nearest points already, they are used
bool FitPlanes(
  const FitInput& input, const StageProgress& progress, PlaneFits& fits, NeighborGraph& graph);

/// Measures spacing and extent again, from neighbours on the same sheet, at points whose neighbours
/// are on more than one: on thin plates, and where surfaces cross. Otherwise the points of the
/// other sheet would count as density. Returns false if stopped.
bool RefineExtents(const OrientedCloud& oriented, const FitSettings& settings,
  const StageProgress& progress, PlaneFits& fits);
}
