// SPDX-License-Identifier: BSD-3-Clause
/**
 * Sides of a cloud of several scans, each point of which knows its scanner: what a scanner has seen
 * faces it.
 *
 * A single normal tells its side only if the scanner is well off the tangent plane: where planes
 * are uncertain (noise, edges, foliage) and where the scanner looks along the surface, the sign of
 * the cosine is chance. There the votes of the neighbours decide (Orientation.h).
 */
#pragma once

#include "Filters/Estimation/PlaneFit.h"

#include <vector>

class vtkDataArray;

namespace SurfelGeometry
{
struct LocalCloud;

/// Turns normals towards the scanners, but not those that were given, nor those of thin plates that
/// do not surely face it. Returns [n] the cosines of the angles between both, 0 where a point's
/// scanner is not known.
/// @param toScanner vectors from the input's points to their scanners; null: none is known
std::vector<float> FaceScanners(const LocalCloud& cloud, vtkDataArray* toScanner, PlaneFits& fits);

/// Largest variance across the tangent plane over that along it of points that tell their sides
/// alone. At edges, where the plane leans on both of their faces, it is larger.
constexpr double SeenFlatness = 0.15;

/// Whether the normal surely faces the scanner: the direction to it has a larger slope over the
/// tangent plane than the neighbours. The slope of the plane is then four of its standard
/// deviations if the neighbours are noise.
inline bool IsSurelySeen(const PlaneFit& fit, double facing)
{
  return facing > 0.0 && facing * facing > fit.Flatness && fit.Flatness <= SeenFlatness &&
    !fit.Isolated && !fit.Degenerate;
}
}
