// SPDX-License-Identifier: BSD-3-Clause
/**
 * The Voronoi cell of a point on its surface; reconstruction kernels are made from its moments.
 *
 * Cells tile the surface: their indicator functions sum to one, and still do when all are blurred
 * alike. A Gaussian with the cell's centroid and with the cell's covariance plus that of the blur
 * has the moments of the blurred indicator up to the second. So kernels made from cells sum to
 * nearly one before any normalization. They also close the gaps of a random sampling, where round
 * kernels of an average spacing leave holes. At a fold (SurfaceFold.h) the cells of both sides
 * meet.
 *
 * The metric may be steered (KernelSteering.h): cells and blur are then long along the edges of a
 * texture, and tile as well.
 */
#pragma once

#include "Filters/Estimation/KernelSteering.h"
#include "Filters/Estimation/PlaneFit.h"
#include "Filters/Estimation/SurfaceHeights.h"

namespace SurfelGeometry
{
/// Area and place of a cell. The kernel's moments take the place of the extents in the fit.
struct VoronoiCell
{
  Float3 Centroid; // minus the point, world units
  float Area = 0;  // world units squared; 0: no cell, the kernel is made from the fit
};

using VoronoiCells = RawVector<VoronoiCell>;

/// What is round in the tangent planes.
struct CellMetric
{
  const KernelSteering& Steering; ///< [n], or empty: none
  double Blur;                    ///< of the cells: standard deviation, spacings
};

/// Measures the cells of all points from their neighbours on the same sheet. Returns false if
/// stopped.
/// @param fits of points with a cell: axis and variances become those of the blurred cell about
/// its centroid, in the tangent plane, world units squared
/// @param heights make their second step with the same neighbours
bool MeasureCells(const OrientedCloud& oriented, const CellMetric& metric,
  const StageProgress& progress, PlaneFits& fits, VoronoiCells& cells, SurfaceHeights& heights);
}
