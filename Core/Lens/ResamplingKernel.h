// SPDX-License-Identifier: BSD-3-Clause
/**
 * The screen-space EWA resampling kernel of a splat: the paper's truncated Gaussian, or one with
 * the kurtosis of the lens's disc convolved with the splat. Mass and variance of both are exact.
 *
 * Krivanek, Zara, Bouatouch 2003, equations 4 and 7: W = M S M' + h I + V_I, with a cut-off c on
 * the exponent. The exponent of the Gaussian is beta = q/2, where q = x' W^-1 x, so a splat ends at
 * q = 2c and keeps the mass 1 - e^-c; hence their compensation 1 / (1 - e^-c). Truncation also
 * reduces the variance, by the factor
 *
 *   tau(c) = 1 - c e^-c / (1 - e^-c)            (0.776 at c = 2.5)
 *
 * (q/2 is exponentially distributed). To filter surfaces and pixels equally at every cut-off, the
 * Gaussian that is truncated has the covariance W / tau. The result has mass 1 and variance W for
 * every c. Lens.h has the variance V_I that the lens adds to W.
 */
#pragma once

#include "Core/Base/Geometry.h"
#include "Core/Simd/RealLanes.h"

#include <cmath>

namespace SurfelSplatting
{
struct TruncatedGaussian
{
  double Cutoff; ///< c, on the exponent q/2; > 0
  double Mass;   ///< 1 - e^-c
  double Tau;    ///< share of the variance that remains after truncation, (0, 1)

  explicit TruncatedGaussian(double cutoff)
    : Cutoff(cutoff)
    , Mass(-std::expm1(-cutoff))
    , Tau(1.0 - cutoff * std::exp(-cutoff) / Mass)
  {
  }

  /// Squared Mahalanobis radius, with respect to W / tau, where the kernel ends.
  SURFELSPLATTING_INLINE double Support() const { return 2.0 * this->Cutoff; }
};

enum class KernelType
{
  Gaussian, ///< Krivanek, Zara, Bouatouch 2003
  PearsonII ///< with variance and kurtosis of the disc convolved with the splat: SmoothProfile,
            ///< BellProfile
};

/// Covariance W = M S M' + h I + V_I of a splat on the screen, px^2, and its determinant, px^4.
template <class Real>
struct FootprintOf : Symmetric2Of<Real>
{
  Real Determinant;
  Real InverseYY;   ///< 1 / YY
  Real InverseRoot; ///< 1 / sqrt(Determinant)

  FootprintOf() = default;

  /**
   * @param projected M S M', px^2
   * @param smooth    h I + V_I, px^2, positive definite; XY is 0 but for cells of a lens
   */
  SURFELSPLATTING_INLINE FootprintOf(
    const Symmetric2Of<Real>& projected, const Symmetric2Of<Real>& smooth)
  {
    // det W = det(M S M') + terms of which the sum is positive, so cancellation cannot make it zero
    // or negative.
    const Real determinant =
      Larger(projected.XX * projected.YY - projected.XY * projected.XY, Real{});
    this->XY = projected.XY + smooth.XY;
    this->Determinant = determinant + smooth.XX * projected.YY + smooth.YY * projected.XX +
      smooth.XX * smooth.YY - smooth.XY * (2.0 * projected.XY + smooth.XY);
    this->YY = projected.YY + smooth.YY;
    this->CompleteFromDeterminant();
  }

  SURFELSPLATTING_INLINE Real Trace() const { return this->XX + this->YY; }

  /// det W tr(W^-1 S).
  SURFELSPLATTING_INLINE Real Trace(const Symmetric2Of<Real>& s) const
  {
    return this->XX * s.YY + this->YY * s.XX - 2.0 * this->XY * s.XY;
  }

  /// Without the cancellation of Mean() - Radius() in long footprints.
  SURFELSPLATTING_INLINE Real SmallestEigenvalue() const
  {
    return this->Determinant / this->LargestEigenvalue();
  }

  /// W minus an isotropic variance, which must be smaller than the smallest eigenvalue.
  SURFELSPLATTING_INLINE FootprintOf Without(const Real& variance) const
  {
    FootprintOf w = *this;
    w.Determinant = this->Determinant + variance * variance - variance * this->Trace();
    w.YY = this->YY - variance;
    w.CompleteFromDeterminant();
    return w;
  }

private:
  /// Computes XX from the determinant. This is M S M' + h + V_I, but larger if rounding made the
  /// projected covariance indefinite.
  SURFELSPLATTING_INLINE void CompleteFromDeterminant()
  {
    this->InverseYY = 1.0 / this->YY;
    this->InverseRoot = 1.0 / SquareRoot(this->Determinant);
    this->XX = (this->Determinant + this->XY * this->XY) * this->InverseYY;
  }
};
using Footprint = FootprintOf<double>;

template <class Real>
SURFELSPLATTING_INLINE FootprintOf<Real> Select(
  const MaskOf<Real>& mask, const FootprintOf<Real>& a, const FootprintOf<Real>& b)
{
  FootprintOf<Real> w;
  w.XX = mask ? a.XX : b.XX;
  w.YY = mask ? a.YY : b.YY;
  w.XY = mask ? a.XY : b.XY;
  w.Determinant = mask ? a.Determinant : b.Determinant;
  w.InverseYY = mask ? a.InverseYY : b.InverseYY;
  w.InverseRoot = mask ? a.InverseRoot : b.InverseRoot;
  return w;
}

/**
 * Kernel as the raster evaluates it, at an offset (dx, dy) px from the centre:
 *   q = A (dx + K dy)^2 + B dy^2,   the support is q < Q = 2c
 *   Shape < 0:  k = Peak exp(-q/2)                 (Gaussian)
 *   0 <= Shape <= 1:  k = Peak (e x + s x^2 + f x^4),  x = 1 - q/Q, weights BellOf   (BellProfile)
 *   Shape = SmoothShape + s:  k = Peak u^2 (3 - 2u),  u = min(1, s (1 - q/Q))   (SmoothProfile)
 * q is a sum of squares, so rounding cannot make it negative.
 *
 * The colour of a node changes over its footprint. Let h = M H', px, be the first moment of its
 * colour on the screen (NodeColors.h). A splat with coverage w deposits
 *   w (k c_0 + t h' W^-1 (dx, dy)),   t = -2 dk/dq (q here with respect to W),
 * The term with t is the derivative of a kernel; its first moment is h for every kernel of mass 1.
 * The raster evaluates t without its constant factor, which is Tilt.
 */
template <class Real>
struct ResamplingKernelOf
{
  Real A, K, B;
  Real Peak;                  ///< for unit mass, 1/px^2
  Real HalfWidth, HalfHeight; ///< of the bounding box of the support, px
  Real Shape;
  Real Tilt;
};
using ResamplingKernel = ResamplingKernelOf<double>;

constexpr double GaussianShape = -1.0;
constexpr double SmoothShape = 2.0;

/// A kernel as a function of q = x' W^-1 x.
template <class Real>
struct KernelProfile
{
  Real Reach; ///< q0: the support is q < q0
  Real Scale; ///< factor from q to the raster's q, Q / q0
  Real Peak;  ///< for unit mass, 1/px^2
  Real Shape;
  Real Tilt;
};

template <class Real>
SURFELSPLATTING_INLINE KernelProfile<Real> Select(
  const MaskOf<Real>& mask, const KernelProfile<Real>& a, const KernelProfile<Real>& b)
{
  return { mask ? a.Reach : b.Reach, mask ? a.Scale : b.Scale, mask ? a.Peak : b.Peak,
    mask ? a.Shape : b.Shape, mask ? a.Tilt : b.Tilt };
}

template <class Real>
SURFELSPLATTING_INLINE KernelProfile<Real> GaussianProfile(
  const TruncatedGaussian& gaussian, const FootprintOf<Real>& w)
{
  return { Uniform<Real>(gaussian.Support() / gaussian.Tau), Uniform<Real>(gaussian.Tau),
    gaussian.Tau / (gaussian.Mass * (2.0 * Pi)) * w.InverseRoot, Uniform<Real>(GaussianShape),
    Uniform<Real>(1.0) };
}

/// What determines a kernel's shape: the lens's disc, or ellipse, in relation to W.
template <class Real>
struct BlurShape
{
  Real SquaredConfusion; ///< C^2, px^2
  Real Trace;            ///< tr W, or det W tr(W^-1 S) of an ellipse of shape S, px^2

  SURFELSPLATTING_INLINE BlurShape(const FootprintOf<Real>& w, const Real& squaredConfusion)
    : SquaredConfusion(squaredConfusion)
    , Trace(w.Trace())
  {
  }
  SURFELSPLATTING_INLINE BlurShape(
    const FootprintOf<Real>& w, const Real& squaredConfusion, const Symmetric2Of<Real>& shape)
    : SquaredConfusion(squaredConfusion)
    , Trace(w.Trace(shape))
  {
  }
};

/**
 * The kurtosis K = mean of q^2, q = x' W^-1 x, of (uniform disc of radius C convolved with a
 * Gaussian), by what it lacks of a Gaussian's, which is 8:
 *   (8 - K) / 8 = C^4 (3 tr^2 - 4 det) / (384 det^2)
 * det and tr are those of W, which includes the disc's variance C^2/4. 0 in focus, 1/3 if the
 * footprint is all blur; of a round footprint l^2 / 3, l the lens's share of W. The Pearson-II
 * kernel (1 - q/q0)^n has 1 / (n + 3). Of an ellipse, with the covariance C^2/4 S and det S = 1, tr
 * is det W tr(W^-1 S).
 */
template <class Real>
SURFELSPLATTING_INLINE Real KurtosisLack(const FootprintOf<Real>& w, const BlurShape<Real>& blur)
{
  const Real perArea = blur.SquaredConfusion * (w.InverseRoot * w.InverseRoot);
  const Real spread = 3.0 * blur.Trace * blur.Trace - 4.0 * w.Determinant;
  const Real lack = perArea * perArea * spread * (1.0 / 384.0);
  return Smaller(Larger(lack, Real{}), Uniform<Real>(1.0 / 3.0)); // NaN: in focus
}

/**
 * The same of its marginal across the direction in which W is thinnest, as a share of a Gaussian's:
 *   l^2 / 3,  l = C^2 / (4 v),  1 / v = (tr + sqrt(tr^2 - 4 det)) / (2 det)
 * v is the smallest eigenvalue of W, l the lens's share there. (The marginals of an elliptical
 * kernel lack what it lacks itself.) Of an ellipse, 1 / v is the largest eigenvalue of W^-1 S.
 */
template <class Real>
SURFELSPLATTING_INLINE Real KurtosisLackAcross(
  const FootprintOf<Real>& w, const BlurShape<Real>& blur)
{
  const Real squared = Larger(blur.Trace * blur.Trace - 4.0 * w.Determinant, Real{});
  const Real perVariance = 0.5 * (blur.Trace + SquareRoot(squared)) * w.InverseRoot * w.InverseRoot;
  const Real share = 0.25 * blur.SquaredConfusion * perVariance;
  const Real lack = share * share * (1.0 / 3.0);
  return Smaller(Larger(lack, Real{}), Uniform<Real>(1.0 / 3.0)); // NaN: in focus
}

/// Up to the first C^2, px^2, the kernel of a surfel has the kurtosis across its thin direction,
/// and from the second one on the mean one.
constexpr double MostBlurAcross = 20.0, LeastBlurInMean = 50.0;

/**
 * What the kernel of a surfel lacks. Surfels that are nearly edge-on lie side by side along
 * silhouettes. Along these their sum is smooth whatever the kernel is; across them it has the
 * kernel's marginal. With the mean kurtosis everywhere, the border that a thin surfel's lens blurs
 * is off by up to 0.018 of its coverage instead of 0.004: a bunny at 12 px of blur has 0.13 dB
 * less. Where blur is wide, nodes are drawn, few beside one another: with the kurtosis across
 * everywhere, they ripple along silhouettes, and a plane at 36 px has 0.8 dB less.
 */
template <class Real>
SURFELSPLATTING_INLINE Real SurfelKurtosisLack(
  const FootprintOf<Real>& w, const BlurShape<Real>& blur)
{
  const Real lack = KurtosisLack(w, blur);
  const MaskOf<Real> isLittle = blur.SquaredConfusion < LeastBlurInMean;
  if (!AnyLane<Real>(isLittle))
  {
    return lack;
  }
  const Real share =
    Smaller((LeastBlurInMean - blur.SquaredConfusion) * (1.0 / (LeastBlurInMean - MostBlurAcross)),
      Uniform<Real>(1.0));
  const Real across = lack + share * (KurtosisLackAcross(w, blur) - lack);
  return isLittle ? across : lack;
}

/// Splats that lack more have the kernel of SmoothProfile, others that of BellProfile. Here, at n =
/// 1.99, both are (1 - q/q0)^2.
constexpr double LeastSmoothLack = 1.0 / 4.99;

/// Weights of x, x^2 and x^4 in the kernel of BellProfile; their sum is 1.
template <class Real>
struct BellWeights
{
  Real Edge, Square, Fourth;
};

/// The bell's edge in focus: the larger it is, the smaller is the support of a splat in focus, and
/// the more do neighbours ripple. With 0.5, pinhole pictures have the error that the Gaussian cut
/// off at c = 2.5 gives; 0.4 gains 0.02 to 0.2 dB, and as much at 12 px of blur.
constexpr double BellEdge = 0.4;

/// Its edge with little blur, which rounds the border off. With the edge in focus, thinly sampled
/// surfaces ripple by 0.05 where the mean of pinholes is smooth. The closest bell to the disc
/// convolved with that in focus has 0.13, and 0.13 of the square (the test Disc and kernel in
/// focus), but a support 1.2 times as large: a plane at 12 px gains another 0.1 dB and takes 5 %
/// longer.
constexpr double BlurredBellEdge = 0.34;

/// The bell has that edge where KurtosisLack is between these two. From the second one on it goes
/// over into the square. (The lens has 0.09 and 0.46 of the variance of a round footprint there.)
constexpr double LeastBlurredLack = 0.0025, LeastWideLack = 0.07;

/// The raster's shape of a bell: 1 in focus, 1/2 with little blur, 0 for the square.
/// @param lack KurtosisLack
template <class Real>
SURFELSPLATTING_INLINE Real BellShape(const Real& lack)
{
  const Real wide = (LeastSmoothLack - lack) * (0.5 / (LeastSmoothLack - LeastWideLack));
  const Real blurred = Smaller(Larger(wide, Real{}), Uniform<Real>(0.5));
  return Larger(1.0 - (0.5 / LeastBlurredLack) * lack, blurred);
}

/// @param shape BellShape
template <class Real>
SURFELSPLATTING_INLINE BellWeights<Real> BellOf(const Real& shape)
{
  const Real twice = shape + shape, one = Uniform<Real>(1.0), bell = Smaller(twice, one);
  const Real blurred = Uniform<Real>(BlurredBellEdge);
  const Real edge = blurred * bell + (Uniform<Real>(BellEdge) - blurred) * (twice - bell);
  return { edge, one - bell, bell - edge };
}

/**
 * Kernel of a splat with little blur. In focus it has nearly the kurtosis and the support of the
 * Gaussian cut off at c = 2.5 (6.65 and q0 = 7.4 instead of 6.60 and 6.4), but it ends in zero: a
 * splat that moves enters a pixel without a jump. The smooth kernel below goes over into it.
 *
 *   k(q) = peak (e x + s x^2 + f x^4),  x = 1 - q/q0,  q = x' W^-1 x < q0
 *
 * Gradients have the derivative of the kernel (1 - q/q0)^2, which ends in zero as well: t =
 * peak 12 m0 / q0 x.
 *
 * Mass and variance are exact for all weights: with the moments m0 = integral of k over x, m1 =
 * that of (1 - x) k, q0 = 2 m0 / m1.
 */
template <class Real>
SURFELSPLATTING_INLINE KernelProfile<Real> BellProfile(
  const FootprintOf<Real>& w, const BellWeights<Real>& k, const Real& shape, double support)
{
  const Real m0 = k.Edge * (1.0 / 2.0) + k.Square * (1.0 / 3.0) + k.Fourth * (1.0 / 5.0);
  const Real m1 = k.Edge * (1.0 / 6.0) + k.Square * (1.0 / 12.0) + k.Fourth * (1.0 / 30.0);
  const Real perMass = 1.0 / m0, inverse = 0.5 * m1 * perMass; // 1 / q0
  return { 2.0 * m0 / m1, support * inverse, (1.0 / Pi) * inverse * perMass * w.InverseRoot, shape,
    6.0 * m1 };
}

/// A smooth kernel that lacks more has a plateau: n = 0.857.
constexpr double LeastPlateauLack = 1.0 / 3.857;

/**
 * Kernel of a blurred splat: flat in the middle, with a smooth step down at the border. It has mass
 * 1, variance W, and the kurtosis of (disc of radius C convolved with the splat). A Pearson-II
 * kernel would have an edge there, and its derivative, which the colour gradients of nodes need, a
 * pole.
 *
 *   k(q) = peak u^2 (3 - 2u),  u = min(1, (q0 - q) kappa) for q = x' W^-1 x < q0
 *
 * The mean of q is 2 (variance W). The mean of q^2 is that of the Pearson kernel, K = 8 (n + 2) /
 * (n + 3):
 *   n < 0.857: with a plateau (kappa q0 > 1); the step has its middle at q_m and half-width w:
 *     q_m = 3 + sqrt(9 - 3K/2),  w = sqrt(5 (4 q_m - q_m^2)),  q0 = q_m + w,  kappa = 1/(2w),
 *     peak = 1/(pi q_m sqrt(det W))
 *   else: without a plateau; x = kappa q0 is the smaller root of
 *     (1/15 - K/100) x^2 + (K/20 - 1/3) x + 2/5 - K/16 = 0,  m = 1 - x/2,
 *     q0 = 2m/(1/4 - x/10),  peak = 1/(pi q0 x^2 m sqrt(det W))
 */
template <class Real>
SURFELSPLATTING_INLINE KernelProfile<Real> SmoothProfile(
  const FootprintOf<Real>& w, const Real& lack, double support)
{
  const Real k = 8.0 - 8.0 * lack;
  const Real middle = 3.0 + SquareRoot(Larger(9.0 - 1.5 * k, Real{}));
  const Real width = SquareRoot(5.0 * Larger(4.0 * middle - middle * middle, Real{}));
  const Real half = Larger(width, Uniform<Real>(1e-3)); // a disc without an edge: n = 0
  const Real a = 1.0 / 15.0 - 0.01 * k, b = 0.05 * k - 1.0 / 3.0, c = 0.4 - 0.0625 * k;
  const Real root = 2.0 * c / (SquareRoot(Larger(b * b - 4.0 * a * c, Real{})) - b);
  const Real m = 1.0 - 0.5 * root;
  const Real sharp = 2.0 * m / (0.25 - 0.1 * root);
  const MaskOf<Real> plateau = lack > LeastPlateauLack;
  const Real reach = plateau ? middle + half : sharp;
  const Real steepness = plateau ? (middle + half) / (2.0 * half) : root; // kappa q0
  const Real mass = plateau ? middle : sharp * root * root * m;           // of u^2 (3 - 2u) over q
  return { reach, support / reach, (1.0 / Pi) * w.InverseRoot / mass, SmoothShape + steepness,
    12.0 * steepness / reach };
}

/// Chooses the kernel's profile for a footprint.
template <class Real>
SURFELSPLATTING_INLINE KernelProfile<Real> ChooseProfile(KernelType type,
  const TruncatedGaussian& gaussian, const FootprintOf<Real>& w, const BlurShape<Real>& blur)
{
  if (type == KernelType::Gaussian)
  {
    return GaussianProfile(gaussian, w);
  }
  const double support = gaussian.Support();
  const Real focus = Uniform<Real>(1.0);
  if (!AnyLane<Real>(blur.SquaredConfusion != 0.0))
  {
    return BellProfile(w, BellOf(focus), focus, support);
  }
  const Real lack = SurfelKurtosisLack(w, blur), least = Uniform<Real>(LeastSmoothLack);
  const MaskOf<Real> smooth = lack > LeastSmoothLack;
  if (!AnyLane<Real>(Not(smooth)))
  {
    return SmoothProfile(w, lack, support);
  }
  const Real shape = BellShape(lack);
  const KernelProfile<Real> bell = BellProfile(w, BellOf(shape), shape, support);
  if (!AnyLane<Real>(smooth))
  {
    return bell;
  }
  return Select<Real>(smooth, SmoothProfile(w, smooth ? lack : least, support), bell);
}

/// Makes the kernel with this profile and footprint.
template <class Real>
SURFELSPLATTING_INLINE ResamplingKernelOf<Real> MakeKernel(
  const KernelProfile<Real>& profile, const FootprintOf<Real>& w)
{
  return { profile.Scale * w.YY * w.InverseRoot * w.InverseRoot, -w.XY * w.InverseYY,
    profile.Scale * w.InverseYY, profile.Peak, SquareRoot(profile.Reach * w.XX),
    SquareRoot(profile.Reach * w.YY), profile.Shape, profile.Tilt };
}

/// Radius of the largest support of all kernels except the Gaussian, in standard deviations of W:
/// sqrt(q0) of the kernel between the two profiles. The Gaussian's is sqrt(2c / tau).
constexpr double MaxKernelReach = 2.8284271247461903;
}
