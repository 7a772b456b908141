// SPDX-License-Identifier: BSD-3-Clause
/**
 * The screen-space EWA resampling kernel of a splat: a truncated Gaussian, or where the lens blurs
 * a Pearson-II kernel; their mass and variance are exactly what they are said to be.
 *
 * Krivanek, Zara, Bouatouch 2003, equations 4 and 7: W = M S M' + h I + V_I, and a cut-off c on the
 * exponent. Their compensation 1 / (1 - e^-c) fits the exponent beta = q/2 of the Gaussian, q = x'
 * W^-1 x: a splat ends at q = 2c and keeps the mass 1 - e^-c. Truncation also takes variance away:
 * of a Gaussian ended at q = 2c there remains the factor
 *
 *   tau(c) = 1 - c e^-c / (1 - e^-c)            (0.776 at c = 2.5)
 *
 * (q/2 is exponentially distributed). So that surfaces and pixels are not filtered differently at
 * each cut-off, the Gaussian that is truncated has covariance W / tau: mass 1, variance W, for
 * every c. (What the lens adds to W: Lens.h.)
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

enum class KernelType
{
  Gaussian, ///< Krivanek, Zara, Bouatouch 2003
  PearsonII ///< matched to variance and kurtosis of the disc convolved with the splat, see
            ///< MakePearsonKernel
};

/// Covariance W = M S M' + h I + V_I of a splat on the screen and its determinant, px^2 and px^4.
struct Footprint
{
  double XX, YY, XY;
  double Determinant;

  /**
   * @param projected M S M', px^2
   * @param variance  isotropic part h + V_I in x and y (they differ only for non-square pixels),
   *                  px^2, > 0
   */
  Footprint(const Symmetric2& projected, const double variance[2])
    : YY(projected.YY + variance[1])
    , XY(projected.XY)
  {
    // det W = det(M S M') + positive terms: no cancellation can make it zero or negative.
    const double determinantProjected =
      std::fmax(0.0, projected.XX * projected.YY - projected.XY * projected.XY);
    this->Determinant = determinantProjected + variance[0] * projected.YY +
      variance[1] * projected.XX + variance[0] * variance[1];
    // M S M' + h + V_I, but larger where rounding made the projected covariance indefinite.
    this->XX = (this->Determinant + this->XY * this->XY) / this->YY;
  }

  double Trace() const { return this->XX + this->YY; }
};

/**
 * Kernel in the form that the raster evaluates, at an offset (dx, dy) px from the centre:
 *   q = A (dx + K dy)^2 + B dy^2,   inside where q < Q = 2c
 *   Shape < 0:  k = Peak exp(-q/2)                 (Gaussian)
 *   Shape = n:  k = Peak (1 - q/Q)^n               (Pearson II), n one of PearsonExponents
 * Sums of squares: q cannot become negative by rounding.
 */
struct ResamplingKernel
{
  double A, K, B;
  double Peak;                  ///< for unit mass, 1/px^2
  double HalfWidth, HalfHeight; ///< of the bounding box of the support, px
  double Shape;
};

constexpr double GaussianShape = -1.0;

/// @param scale of the inverse of W in q; the support then is x' W^-1 x < Q / scale
inline ResamplingKernel MakeKernel(
  const Footprint& w, double scale, double support, double peak, double shape)
{
  ResamplingKernel kernel;
  kernel.A = scale * w.YY / w.Determinant;
  kernel.K = -w.XY / w.YY;
  kernel.B = scale / w.YY;
  kernel.Peak = peak;
  kernel.HalfWidth = std::sqrt(support / scale * w.XX);
  kernel.HalfHeight = std::sqrt(support / scale * w.YY);
  kernel.Shape = shape;
  return kernel;
}

constexpr double Pi = 3.14159265358979323846;

inline ResamplingKernel MakeGaussianKernel(const Footprint& w, const TruncatedGaussian& gaussian)
{
  return MakeKernel(w, gaussian.Tau, gaussian.Support(),
    gaussian.Tau / (2.0 * Pi * std::sqrt(w.Determinant) * gaussian.Mass), GaussianShape);
}

/// Exponents that need products and square roots alone; rounding to them costs at most 0.1 dB.
inline double RoundPearsonExponent(double n)
{
  return n < 0.125 ? 0.0
    : n < 0.375    ? 0.25
    : n < 0.75     ? 0.5
    : n < 1.5      ? 1.0
    : n < 2.5      ? 2.0
    : n < 3.5      ? 3.0
                   : 4.0;
}

/// Beyond this exponent a Pearson-II kernel is taken for the Gaussian it tends to.
constexpr double LargestPearsonExponent = 6.0;

/**
 * Pearson type II kernel with variance W and the kurtosis of (uniform disc of radius C convolved
 * with the splat's own Gaussian): between a flat disc, n = 0, where blur is all, and the Gaussian
 * in focus.
 *
 *   k(q) = (n + 1) / (pi q0 sqrt(det W)) (1 - q/q0)^n,   q0 = 2 (n + 2),   q = x' W^-1 x < q0
 *   n + 3 = 384 det^2 / (C^4 (3 tr^2 - 4 det)),          det and trace of W
 *
 * Mass 1 and variance W are exact for every n; W holds the disc's own variance, C^2 / 4.
 * @param squaredConfusion C^2, px^2
 */
inline ResamplingKernel MakePearsonKernel(
  const Footprint& w, double squaredConfusion, const TruncatedGaussian& gaussian)
{
  const double trace = w.Trace();
  const double spread =
    squaredConfusion * squaredConfusion * (3.0 * trace * trace - 4.0 * w.Determinant);
  const double exponent = 384.0 * w.Determinant * w.Determinant / spread - 3.0;
  if (!(exponent <= LargestPearsonExponent)) // NaN too: in focus spread is 0
  {
    return MakeGaussianKernel(w, gaussian);
  }
  const double n = RoundPearsonExponent(exponent);
  const double reach = 2.0 * (n + 2.0); // q0
  const double support = gaussian.Support();
  return MakeKernel(
    w, support / reach, support, (n + 1.0) / (Pi * reach * std::sqrt(w.Determinant)), n);
}
}
