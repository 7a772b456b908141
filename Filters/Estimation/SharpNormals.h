// SPDX-License-Identifier: BSD-3-Clause
/**
 * Normals at edges, where none are given.
 *
 * The plane through all neighbours of a point beside an edge is a mean over both sides: the edge is
 * round by the size of the neighbourhood. Neighbours that are farther away have planes of their own
 * side. If the point lies in one of these, it gets the plane of those of its neighbours that lie in
 * it, too. (Nagao and Matsuyama 1979 smooth pictures alike: each pixel takes the mean of the most
 * homogeneous window that contains it.)
 *
 * Rounded surfaces stay: there a quadric through all neighbours fits those of the plane as well.
 */
#pragma once

#include "Filters/Estimation/PlaneFit.h"

namespace SurfelGeometry
{
/// Replaces fitted normals beside edges by those of one side (PlaneFit::Sharp). Returns false if
/// stopped.
bool SharpenNormals(const OrientedCloud& oriented, const StageProgress& progress, PlaneFits& fits);
}
