// SPDX-License-Identifier: BSD-3-Clause
/**
 * Colours of surfels such that the surface has the colours of the points at the points.
 *
 * A splatted surface has the colours C(x) = sum_j a_j K_j(x) c_j: those of the points, blurred by
 * the kernels. With the colours of the points for the coefficients c_j, edges in a texture are
 * blurred twice, by the kernels and by the pixel filter. The coefficients that interpolate the
 * colours s_i of the points, C(p_i) = s_i, solve a linear system. This is the first step of van
 * Cittert's iteration towards them (van Cittert 1931; as a filter before a reconstruction: Unser
 * 2000, "Sampling - 50 years after Shannon", sec. III), c = s + (s - C[s]), with the weights a_j
 * K_j(p_i) of the neighbours of one sheet as a Gaussian of their distances. Further steps gain 0.2
 * dB. What it passes of a frequency is k (2 - k), where the kernels pass k <= 1: never more than
 * the points have, so it does not amplify their noise. The mean over an area stays, so that nodes,
 * and distant views, have the same colours.
 *
 * The Gaussian stays round where kernels are steered: with the metric of the steering, pictures
 * were up to 0.2 dB farther from the truth.
 */
#pragma once

#include "Filters/Arrays/PointColors.h"
#include "Filters/Estimation/KernelSteering.h"
#include "Filters/Estimation/PlaneFit.h"
#include "Filters/Estimation/SurfaceHeights.h"

namespace SurfelGeometry
{
/// What the neighbours give besides colours, so that they are loaded once.
struct SheetResults
{
  KernelSteering& Steering; ///< becomes [n]
  SurfaceHeights* Heights;  ///< make their first step; or null
};

/**
 * @param blur   mean standard deviation of the kernels, spacings
 * @param colors of the points; the result is bounded to 0 to 255
 * @param others become known
 * @return false if stopped
 */
bool InterpolateColors(const OrientedCloud& oriented, const PlaneFits& fits, double blur,
  const StageProgress& progress, CloudColors& colors, SheetResults others);
}
