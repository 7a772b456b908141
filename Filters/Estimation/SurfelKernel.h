// SPDX-License-Identifier: BSD-3-Clause
/**
 * The kernel of a surfel: a Gaussian in its tangent plane.
 */
#pragma once

#include "Filters/Common/VectorMath.h"

namespace SurfelGeometry
{
struct PlaneFit;
struct VoronoiCell;

/// A Gaussian in the tangent plane, and the area that it represents.
struct SurfelKernel
{
  Vector3 AxisU;
  double VarianceU, VarianceV; // world units squared
  double Area;
};

/// The kernel from the spacing, round or stretched like the neighbours' extent; in both cases
/// sqrt(VarianceU VarianceV) = (scale spacing)^2.
SurfelKernel SpacingKernel(const PlaneFit& fit, double scale, bool elliptical);

/// The kernel from the indicator function of a cell, blurred.
/// @param fit with the kernel's moments (VoronoiCell.h)
SurfelKernel CellKernel(const PlaneFit& fit, const VoronoiCell& cell);

/// Mean standard deviation of such kernels, spacings: a square of the mean area, blurred.
double MeanBlur(double blur);

/// Bounds the ratio of the standard deviations; their product stays.
void BoundAxes(double maximumRatio, SurfelKernel& kernel);

/// S = s_u^2 u u' + s_v^2 v v' with v = n x u, in VTK's order of a symmetric tensor.
/// @param s [6] world units squared
void StoreCovariance(const SurfelKernel& kernel, const Vector3& normal, float* s);
}
