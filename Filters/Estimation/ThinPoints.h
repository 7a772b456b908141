// SPDX-License-Identifier: BSD-3-Clause
/**
 * Points of things as thin as their spacing: wires of a fence, spokes, twigs, blades, small leaves.
 *
 * Sixteen neighbours on such things lie in no plane. Kernels in a plane that means nothing reach
 * into the void beside a wire until they meet those of the next one: a fence becomes a wall. So
 * these points become round, as large as what the nearest neighbours alone tell. Edges of larger
 * things are in no plane either, but most of what is around them is. Where most of the cloud is
 * about as thick, that is noise.
 */
#pragma once

#include "Filters/Estimation/PlaneFit.h"

namespace SurfelGeometry
{
/// Makes thin points round (PlaneFit::OnRod); their sides stay. Returns false if stopped.
bool RoundThinPoints(const OrientedCloud& oriented, const StageProgress& progress, PlaneFits& fits);
}
