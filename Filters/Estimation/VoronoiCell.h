// SPDX-License-Identifier: BSD-3-Clause
/**
 * The Voronoi cell of a point on its surface, and the reconstruction kernel that stands for it.
 *
 * Cells tile the surface: their indicator functions sum to one, and still do when all are blurred
 * alike. A Gaussian with the cell's centroid and the cell's covariance plus that of the blur is the
 * blurred indicator up to second moments. So kernels made from cells overlap to a sum near one
 * before any normalization, and close the gaps of a random sampling, where round kernels of an
 * average spacing leave holes.
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
  float Area = 0; // world units squared; 0: no cell, keep the fit's kernel
};

/// Cells of all points from their neighbours on the same sheet. Returns false if stopped.
bool MeasureCells(const LocalCloud& cloud, const NeighborSearch& tree, const NeighborGraph& graph,
  const std::vector<unsigned char>& twoSided, const std::vector<PlaneFit>& fits,
  const StageProgress& monitor, std::vector<VoronoiCell>& cells);
}
