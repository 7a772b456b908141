// SPDX-License-Identifier: BSD-3-Clause
/**
 * The footprint of a Gaussian in space on the screen, and its opacity there.
 *
 * In focus it is exp(-q/2), q = x' W^-1 x, W = M S M' + h (EWA volume splatting: Zwicker, Pfister,
 * van Baar, Gross 2001). The lens convolves it with a disc of radius C: W grows by C^2 / 4, and the
 * kernel gets the kurtosis of that (ResamplingKernel.h), with its mass kept:
 *
 *   K = 8 (n + 2) / (n + 3), n + 3 = 1 / KurtosisLack:  8 is a Gaussian
 *   n < 1.99:  SmoothProfile
 *   n < 2.9:   BellProfile, K up to 6.64
 *   above:     g exp(-q/2) + (1 - g) bell, with g so that the mixture has K
 *
 * so that it changes continuously with the blur. Both parts of the mixture have mass 1 and variance
 * W, hence kurtosis and g are linear in one another.
 */
#pragma once

#include "Core/Lens/ResamplingKernel.h"

namespace SurfelSplatting
{
/// h of Gaussians in space, px^2: captures are trained with it.
constexpr double SpacePrefilter = 0.3;

/// Largest opacity of one Gaussian of a capture, as they are trained.
constexpr float MaxOpacity = 0.99f;

/// Moments over x of the bell in focus: BellProfile's m0 and q0 at r = 1.
constexpr double FocusBellMass = BellEdge / 2.0 + (1.0 - BellEdge) / 5.0;
constexpr double FocusBellReach = 2.0 * FocusBellMass / (BellEdge / 6.0 + (1.0 - BellEdge) / 30.0);
/// Peak of the bell over that of the Gaussian, for the same mass.
constexpr double FocusBellPeak = 2.0 / (FocusBellReach * FocusBellMass);
/// Its kurtosis, q0^2 m2 / m0.
constexpr double FocusBellKurtosis =
  FocusBellReach * FocusBellReach * (BellEdge / 12.0 + (1.0 - BellEdge) / 105.0) / FocusBellMass;

/// The exponent of that kurtosis, nearly: where the mixture begins.
constexpr double FocusBellExponent = 2.9;

/// A Gaussian ends, in q, no nearer than this. One of a capture ends about where it is a level of
/// 255, 2 ln(255 w), up to the larger one.
constexpr double LeastGaussianReach = 9.0, LargestGaussianReach = 11.09;

/// One of a volume ends where its optical depth is this. What lies beyond is added inside.
constexpr double LeastOpticalDepth = 1e-4, LargestVolumeReach = 20.0;

/// Reach of a Gaussian of a capture. @param weight opacity at the centre, in focus
template <class Real>
SURFELSPLATTING_INLINE Real CaptureReach(const Real& weight)
{
  return LeastGaussianReach +
    (LargestGaussianReach - LeastGaussianReach) * Smaller(weight, Uniform<Real>(1.0));
}

/// Reach of a Gaussian of a volume. @param weight optical depth at the centre, in focus
template <class Real>
SURFELSPLATTING_INLINE Real VolumeReach(const Real& weight)
{
  const Real reach = FillLanes<Real>(LaneTypes<Real>::Count,
    [&](int l) { return 2.0 * __builtin_log(LaneAt(weight, l) * (1.0 / LeastOpticalDepth)); });
  return Smaller(
    Larger(reach, Uniform<Real>(LeastGaussianReach)), Uniform<Real>(LargestVolumeReach));
}

/// Mass of a Gaussian over the part of it within VolumeReach, 1 to 1.0112.
template <class Real>
SURFELSPLATTING_INLINE Real MassOverCutOff(const Real& weight)
{
  constexpr double most = 0.011108996538242306; // exp(-LeastGaussianReach / 2)
  return 1.0 / (1.0 - Smaller(LeastOpticalDepth / weight, Uniform<Real>(most)));
}

/// The raster's shape of the mixture: -g. Above this share it is a Gaussian.
constexpr double WholeGaussian = 0.99;

/**
 * The kernel of a Gaussian in space: its Scale is 1, its Reach the raster's support.
 * @param w      footprint with prefilter and lens
 * @param gaussianReach where the Gaussian in focus ends
 */
template <class Real>
SURFELSPLATTING_INLINE KernelProfile<Real> SpaceProfile(
  const FootprintOf<Real>& w, const BlurShape<Real>& blur, const Real& gaussianReach)
{
  const Real one = Uniform<Real>(1.0), lack = KurtosisLack(w, blur);
  const Real share = 1.0 - lack * (8.0 / (8.0 - FocusBellKurtosis));
  const Real gaussian = share > WholeGaussian ? one : share;
  const KernelProfile<Real> sharp{ gaussianReach, one, 0.5 / Pi * w.InverseRoot, Real{} - gaussian,
    one };
  const MaskOf<Real> bell = Not<MaskOf<Real>>(share > 0.0);
  if (!AnyLane<Real>(bell))
  {
    return sharp;
  }
  const MaskOf<Real> smooth = lack > LeastSmoothLack;
  const Real least = Uniform<Real>(LeastSmoothLack);
  constexpr double first = 1.0 / LeastSmoothLack, last = FocusBellExponent + 3.0;
  const Real inverse = 1.0 / Larger(lack, Uniform<Real>(1.0 / last));
  const Real r = Larger((inverse - first) * (1.0 / (last - first)), Real{});
  KernelProfile<Real> blurred = Select<Real>(smooth, SmoothProfile(w, smooth ? lack : least, 1.0),
    BellProfile(w, BellWeights<Real>{ BellEdge * r, 1.0 - r, (1.0 - BellEdge) * r }, r, 1.0));
  blurred.Scale = one;
  return Select<Real>(bell, blurred, sharp);
}

/**
 * Ends a capture's Gaussian that the lens has spread where it is about a level of 255 again. Its
 * share g of the mixture is fainter than in focus by r: q' = q + 2 ln(g r), by Pade's approximation
 * of ln, off by 0.09 at 0.2, and not before the bell.
 * @param fainter r, (0, 1]
 * @return factor of the mass that makes up for what lies between q' and q
 */
template <class Real>
SURFELSPLATTING_INLINE Real ShortenReach(KernelProfile<Real>& profile, const Real& fainter)
{
  constexpr double most = 0.024916; // exp(-FocusBellReach / 2)
  const Real one = Uniform<Real>(1.0), gaussian = Larger(Real{} - profile.Shape, Real{});
  const Real x = Larger(gaussian * fainter, Uniform<Real>(1e-3));
  if (!AnyLane<Real>(x < 1.0))
  {
    return one; // in focus
  }
  const Real q = Smaller(profile.Reach, Uniform<Real>(LargestGaussianReach));
  // exp(-q / 2) for q in [9, 11.09] is off by 0.0008.
  const Real lost = 0.011109 - 0.003455 * (q - LeastGaussianReach);
  const Real further = Larger(Smaller(lost / x, Uniform<Real>(most)) - lost, Real{});
  const Real reach = q + 6.0 * (x * x - 1.0) / (x * x + 4.0 * x + 1.0);
  const Real shorter = Larger(Smaller(reach, q), Uniform<Real>(FocusBellReach));
  const MaskOf<Real> mixture = profile.Shape < 0.0;
  profile.Reach = mixture ? shorter : profile.Reach;
  return mixture ? one + gaussian * further : one;
}
}
