// SPDX-License-Identifier: BSD-3-Clause
/**
 * The Voronoi cell of a point on its surface; reconstruction kernels are made from its moments.
 *
 * Cells tile the surface: their indicator functions sum to one, and still do when all are blurred
 * alike. A Gaussian with the cell's centroid and with the cell's covariance plus that of the blur
 * has the moments of the blurred indicator up to the second. So kernels made from cells sum to
 * nearly one before any normalization. They also close the gaps of a random sampling, where round
 * kernels of an average spacing leave holes.
 */
#pragma once

#include "Filters/Estimation/PlaneFit.h"

#include <vector>

namespace SurfelGeometry
{
/// Moments of a cell in the tangent plane of its point.
struct VoronoiCell
{
  Float3 Centroid;     // minus the point, world units
  Float3 AxisU;        // unit, tangential: direction of the larger variance
  float VarianceU = 0; // about the centroid, world units squared
  float VarianceV = 0;
  float Area = 0; // world units squared; 0: no cell, the kernel is made from the fit
};

/// Measures the cells of all points from their neighbours on the same sheet. Returns false if
/// stopped.
bool MeasureCells(const OrientedCloud& oriented, const std::vector<PlaneFit>& fits,
  const StageProgress& progress, std::vector<VoronoiCell>& cells);
}
