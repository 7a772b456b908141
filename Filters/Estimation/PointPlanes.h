// SPDX-License-Identifier: BSD-3-Clause
/**
 * Planes of kernels where normals were given.
 *
 * Cells tile the surface if they lie in it. Given normals, of a mesh or of a wider fit, need not be
 * those of the surface that the points make up: what is left of noise, and the waves of scans from
 * photographs, tilt the points of a few spacings together. Where such a place faces the viewer more
 * than its normals say, its surfels cover too little, and the background shines through.
 */
#pragma once

#include "Filters/Estimation/PlaneFit.h"

namespace SurfelGeometry
{
/// Turns given normals to the surface of the nearest points on the same sheet, as far as its tilt
/// is not chance. Returns false if stopped.
bool TurnToPoints(const OrientedCloud& oriented, const StageProgress& progress, PlaneFits& fits);
}
