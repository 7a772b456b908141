// SPDX-License-Identifier: BSD-3-Clause
/**
 * The screen-space EWA resampling kernel of a splat: a truncated Gaussian whose mass and variance are exactly what they
 * are said to be.
 *
 * Krivanek, Zara, Bouatouch 2003, equations 4 and 7: W = M S M' + h I + V_I, and a cut-off c on the exponent. Their
 * compensation 1 / (1 - e^-c) fits the exponent beta = q/2 of the Gaussian, q = x' W^-1 x: a splat ends at q = 2c and
 * keeps the mass 1 - e^-c. Truncation also takes variance away: of a Gaussian ended at q = 2c there remains the factor
 *
 *   tau(c) = 1 - c e^-c / (1 - e^-c)            (0.776 at c = 2.5)
 *
 * (q/2 is exponentially distributed). So that surfaces and pixels are not filtered differently at each cut-off, the
 * Gaussian that is truncated has covariance W / tau: mass 1, variance W, for every c. (What the lens adds to W: Lens.h.)
 */
#pragma once

#include "Geometry.h"

#include <cmath>

namespace SurfelSplatting
{
struct TruncatedGaussian
{
  double Cutoff; ///< c, on the exponent q/2; > 0
  double Mass;   ///< 1 - e^-c
  double Tau;    ///< share of the variance that truncation leaves, (0, 1)

  explicit TruncatedGaussian(double cutoff)
    : Cutoff(cutoff)
    , Mass(-std::expm1(-cutoff))
    , Tau(1.0 - cutoff * std::exp(-cutoff) / Mass)
  {
  }

  /// Squared Mahalanobis radius, with respect to W / tau, where the kernel ends.
  double Support() const { return 2.0 * this->Cutoff; }
};

/**
 * Kernel in the form that the raster evaluates, at an offset (dx, dy) px from the centre:
 *   q = A (dx + K dy)^2 + B dy^2,   k = Peak exp(-q/2) where q < Support.
 * Sums of squares: q cannot become negative by rounding.
 */
struct ResamplingKernel
{
  double A, K, B;
  double Peak;                  ///< for unit mass, 1/px^2
  double HalfWidth, HalfHeight; ///< of the bounding box of the support, px
  double Determinant;           ///< of W (not W / tau), px^4
};

/**
 * @param projected M S M', px^2
 * @param variance  isotropic part h + V_I in x and y (they differ only for non-square pixels), px^2, > 0
 */
inline ResamplingKernel MakeResamplingKernel(
  const Symmetric2& projected, const double variance[2], const TruncatedGaussian& gaussian)
{
  // det W = det(M S M') + positive terms: no cancellation can make it zero or negative.
  const double determinantProjected =
    std::fmax(0.0, projected.XX * projected.YY - projected.XY * projected.XY);
  const double determinant = determinantProjected + variance[0] * projected.YY +
    variance[1] * projected.XX + variance[0] * variance[1];
  const double wxx = projected.XX + variance[0];
  const double wyy = projected.YY + variance[1];

  ResamplingKernel kernel;
  kernel.A = gaussian.Tau * wyy / determinant;
  kernel.K = -projected.XY / wyy;
  kernel.B = gaussian.Tau / wyy;
  kernel.Peak =
    gaussian.Tau / (2.0 * 3.14159265358979324 * std::sqrt(determinant) * gaussian.Mass);
  const double scale = gaussian.Support() / gaussian.Tau;
  kernel.HalfWidth = std::sqrt(scale * wxx);
  kernel.HalfHeight = std::sqrt(scale * wyy);
  kernel.Determinant = determinant;
  return kernel;
}
}
