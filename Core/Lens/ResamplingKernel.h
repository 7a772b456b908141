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

#include "Core/Base/Geometry.h"

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

  double SmallestEigenvalue() const
  {
    const double half = 0.5 * this->Trace();
    const double radius = std::hypot(0.5 * (this->XX - this->YY), this->XY);
    return this->Determinant / (half + radius);
  }

  /// W less an isotropic variance that is smaller than its smallest eigenvalue.
  Footprint Without(double variance) const
  {
    Footprint w = *this;
    w.Determinant += variance * variance - variance * this->Trace();
    w.YY -= variance;
    w.XX = (w.Determinant + w.XY * w.XY) / w.YY;
    return w;
  }
};

/**
 * Kernel in the form that the raster evaluates, at an offset (dx, dy) px from the centre:
 *   q = A (dx + K dy)^2 + B dy^2,   inside where q < Q = 2c
 *   Shape < 0:  k = Peak exp(-q/2)                 (Gaussian)
 *   Shape = n:  k = Peak (1 - q/Q)^n               (Pearson II), n one of PearsonExponents
 *   Shape = SmoothShape + s:  k = Peak u^2 (3 - 2u),  u = min(1, s (1 - q/Q))   (MakeSmoothKernel)
 * Sums of squares: q cannot become negative by rounding.
 *
 * A node's colour changes over its footprint. With h = M H' the first moment of its colour on the
 * screen (NodeColors.h, px), what a splat with coverage w deposits is
 *   w (k c_0 + t h' W^-1 (dx, dy)),   t = -2 dk/dq (q here with respect to W),
 * the derivative of the kernel, whose first moment is h for any kernel of mass 1. The raster
 * evaluates t without the constant that is Tilt.
 */
struct ResamplingKernel
{
  double A, K, B;
  double Peak;                  ///< for unit mass, 1/px^2
  double HalfWidth, HalfHeight; ///< of the bounding box of the support, px
  double Shape;
  double Tilt = 1.0;
};

constexpr double GaussianShape = -1.0;
constexpr double SmoothShape = 16.0;
constexpr double TentShape = -2.0; ///< of a coarse grid's cells, see Splat.h

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
 * Exponent n of the Pearson-II kernel with the kurtosis of (uniform disc of radius C convolved with
 * the splat's own Gaussian), for det and trace of W, which holds the disc's own variance C^2 / 4:
 *   n + 3 = 384 det^2 / (C^4 (3 tr^2 - 4 det))
 * 0 where blur is all; infinity or NaN in focus.
 * @param squaredConfusion C^2, px^2
 */
inline double PearsonExponent(const Footprint& w, double squaredConfusion)
{
  const double trace = w.Trace();
  const double spread =
    squaredConfusion * squaredConfusion * (3.0 * trace * trace - 4.0 * w.Determinant);
  return 384.0 * w.Determinant * w.Determinant / spread - 3.0;
}

/**
 * Pearson type II kernel with variance W and the kurtosis of (uniform disc of radius C convolved
 * with the splat's own Gaussian): between a flat disc, n = 0, where blur is all, and the Gaussian
 * in focus.
 *
 *   k(q) = (n + 1) / (pi q0 sqrt(det W)) (1 - q/q0)^n,   q0 = 2 (n + 2),   q = x' W^-1 x < q0
 *
 * Mass 1 and variance W are exact for every n; W holds the disc's own variance, C^2 / 4.
 * @param squaredConfusion C^2, px^2
 */
inline ResamplingKernel MakePearsonKernel(
  const Footprint& w, double squaredConfusion, const TruncatedGaussian& gaussian)
{
  const double exponent = PearsonExponent(w, squaredConfusion);
  if (!(exponent <= LargestPearsonExponent)) // NaN too: in focus spread is 0
  {
    return MakeGaussianKernel(w, gaussian);
  }
  const double n = RoundPearsonExponent(exponent);
  const double reach = 2.0 * (n + 2.0); // q0
  const double support = gaussian.Support();
  ResamplingKernel kernel =
    MakeKernel(w, support / reach, support, (n + 1.0) / (Pi * reach * std::sqrt(w.Determinant)), n);
  kernel.Tilt = n / (n + 2.0);
  return kernel;
}

/// A node's kernel is smooth below this Pearson exponent: beyond it little is gained.
constexpr double LargestSmoothExponent = 1.95;

/**
 * The kernel of a blurred node with a colour gradient: flat in the middle, a smooth step down
 * towards the border, with the mass, the variance W and the kurtosis of (disc of radius C convolved
 * with the node). A Pearson-II kernel would have an edge there, and its derivative a pole.
 *
 *   k(q) = peak u^2 (3 - 2u),  u = min(1, (q0 - q) kappa) for q = x' W^-1 x < q0
 *
 * The mean of q is 2 (variance W), that of q^2 is the Pearson kernel's, K = 8 (n + 2) / (n + 3):
 *   n < 0.857: a plateau (kappa q0 > 1), the step's middle at q_m and half its width w:
 *     q_m = 3 + sqrt(9 - 3K/2),  w = sqrt(5 (4 q_m - q_m^2)),  q0 = q_m + w,  kappa = 1/(2w),
 *     peak = 1/(pi q_m sqrt(det W))
 *   else no plateau: x = kappa q0 the smaller root of
 *     (1/15 - K/100) x^2 + (K/20 - 1/3) x + 2/5 - K/16 = 0,  m = 1 - x/2,
 *     q0 = 2m/(1/4 - x/10),  peak = 1/(pi q0 x^2 m sqrt(det W))
 */
inline ResamplingKernel MakeSmoothKernel(
  const Footprint& w, double exponent, const TruncatedGaussian& gaussian)
{
  constexpr double smallestPlateauExponent = 0.857;
  const double n = std::fmax(0.0, exponent);
  const double k = 8.0 * (n + 2.0) / (n + 3.0);
  double reach, steepness, mass; // q0, kappa q0, integral of u^2 (3 - 2u) over q
  if (n < smallestPlateauExponent)
  {
    const double middle = 3.0 + std::sqrt(9.0 - 1.5 * k);
    const double width = std::sqrt(5.0 * std::fmax(0.0, 4.0 * middle - middle * middle));
    const double half = std::fmax(width, 1e-3); // a disc without an edge: n = 0
    reach = middle + half;
    steepness = reach / (2.0 * half);
    mass = middle;
  }
  else
  {
    const double a = 1.0 / 15.0 - 0.01 * k, b = 0.05 * k - 1.0 / 3.0, c = 0.4 - 0.0625 * k;
    steepness = (-b - std::sqrt(std::fmax(0.0, b * b - 4.0 * a * c))) / (2.0 * a);
    const double m = 1.0 - 0.5 * steepness;
    reach = 2.0 * m / (0.25 - 0.1 * steepness);
    mass = reach * steepness * steepness * m;
  }
  const double support = gaussian.Support();
  ResamplingKernel kernel = MakeKernel(w, support / reach, support,
    1.0 / (Pi * mass * std::sqrt(w.Determinant)), SmoothShape + steepness);
  kernel.Tilt = 12.0 * steepness / reach;
  return kernel;
}

/// Radius of the largest support of all these kernels in standard deviations of W, but for the
/// Gaussian's sqrt(2c / tau): sqrt(q0) at n = 4.
constexpr double LargestPearsonReach = 3.4641016151377544;
}
