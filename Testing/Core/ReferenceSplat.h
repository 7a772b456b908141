// SPDX-License-Identifier: BSD-3-Clause
/**
 * From surfels to splats in double precision, without a shortcut: projection, lens, kernel, weight.
 * Shares no code with the core's set-up but the input structures and the light model.
 */
#pragma once

#include "Core/Splats/SplatContext.h"
#include "Core/Surfels/SurfelCloud.h"
#include "ReferenceKernel.h"

#include <vector>

namespace SurfelSplatting
{
/// One evaluated splat: everything that does not depend on the pixel.
struct ReferenceSplat
{
  double X, Y, Weight;
  ReferenceKernel Kernel; ///< of t = 1 - q/2c, or a Gaussian
  double W[2][2];         ///< covariance of the untruncated Gaussian, W / tau
  double Inverse[2][2];   ///< its inverse
  double Near, Far, Depth, DepthX, DepthY;
  double Order; ///< depth by which they are sorted
  double Point[2] = { 0, 0 }, PerPixel[2][2] = { { 0, 0 }, { 0, 0 } }; ///< of the lens
  double Area = 1, AreaX = 0, AreaY = 0, Back = 0;
  double LensShare = 1; ///< of W, mean over the directions
  double Color[3], Opacity;
};

/// Of those surfels that are seen.
std::vector<ReferenceSplat> MakeReferenceSplats(
  const SplatContext& context, const std::vector<SurfelCloud>& clouds);

/// The kernel at the raster's q, 1 at its centre.
double EvaluateKernel(const ReferenceSplat& s, double q, double cutoff);

/// Variance in px^2 of the lens's Gaussian for a circle of confusion of radius c px, and the factor
/// on a splat's weight that makes up for what min(1, sum w) loses to ripple; smooth is the
/// share of the footprint that lens and pixel filter make.
double ReferenceLensVariance(double c, double cutoff);
double ReferenceRippleCompensation(double smooth, double cosine);
}
