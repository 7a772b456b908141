// SPDX-License-Identifier: BSD-3-Clause
/**
 * Fits the points on lines again, of scanners that turn and on rods (ScanLines.h).
 */
#pragma once

#include "Filters/Estimation/PlaneFit.h"
#include "Filters/Estimation/ScanLines.h"

namespace SurfelGeometry
{
/// Returns false if stopped.
/// @param fits to the nearest neighbours, whose spreads these are
bool FitLines(const FitInput& input, const Spreads& spreads, const NeighborGraph& graph,
  const StageProgress& progress, PlaneFits& fits);
}
