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
/// Area and place of a cell. Its second moments take the place of those in the fit.
struct VoronoiCell
{
  Float3 Centroid; // minus the point, world units
  float Area = 0;  // world units squared; 0: no cell, the kernel is made from the fit
};

using VoronoiCells = RawVector<VoronoiCell>;

/// Measures the cells of all points from their neighbours on the same sheet. Returns false if
/// stopped.
/// @param fits of points with a cell: axis and variances become the cell's about its centroid, in
/// the tangent plane, world units squared
bool MeasureCells(const OrientedCloud& oriented, const StageProgress& progress, PlaneFits& fits,
  VoronoiCells& cells);
}
