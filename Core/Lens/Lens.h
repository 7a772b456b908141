// SPDX-License-Identifier: BSD-3-Clause
/**
 * The thin lens: circle of confusion and the variance of the blur it causes.
 */
#pragma once

#include "Core/Lens/ResamplingKernel.h"
#include "Core/Lens/View.h"

#include <array>
#include <cmath>

namespace SurfelSplatting
{
/// C / f with a sign: negative in front of the focus. Light through point u of the lens, a unit
/// disc, is displaced by C u on the screen.
template <class Real>
SURFELSPLATTING_INLINE Real SignedConfusion(
  double radius, double inverseFocalDistance, const Real& inverseZ)
{
  return radius * (inverseFocalDistance - inverseZ);
}

/// A point of the lens in units of its radius: x right, y up in camera space.
template <class Real>
struct AperturePointOf
{
  Real X, Y;
};

/**
 * Mean of the points where the light of a surfel passes through the lens. Seen from point u of the
 * unit disc, the projected area of area vector a at p is proportional to -a.(p - R u), so it is
 * larger from one side of the lens than from the other. The mean of u with this weight is R a_xy /
 * (-4 a.p). Its length is limited to 1/4, where the surfel is edge-on from the border of the lens.
 * (Also excluding the part of the lens that sees the back was measured to gain nothing.)
 *
 * The blur of a surfel is centred C u from the surfel's own centre on the screen.
 */
template <class Real>
SURFELSPLATTING_INLINE AperturePointOf<Real> MeanAperturePoint(
  double radius, const Vector3Of<Real>& a, const Vector3Of<Real>& p)
{
  const Real scale = radius / (-4.0 * Dot(a, p));
  const Real x = scale * a.X, y = scale * a.Y;
  const Real length = SquareRoot(x * x + y * y);
  const Real limit = length > 0.25 ? 0.25 / length : Uniform<Real>(1.0);
  return { x * limit, y * limit };
}

/// A lens in VTK's ray-tracing convention; Radius = vtkCamera::FocalDisk / 2. Radius 0 is a
/// pinhole.
struct Lens
{
  double Radius = 0.0;        ///< world units, >= 0
  double FocalDistance = 1.0; ///< distance in focus along the view direction, world units, > 0

  /// Radius of the circle of confusion in units of the focal length f in px: C = f * R |1/z_f -
  /// 1/z| (Potmesil and Chakravarty 1981, with the sensor scaled to pixels). z > 0.
  double RelativeCircleOfConfusion(double z) const
  {
    return std::abs(SignedConfusion(this->Radius, 1.0 / this->FocalDistance, 1.0 / z));
  }
};

/**
 * Variance in px^2 that a lens with circle of confusion C adds to a splat.
 *
 * PearsonII: the variance of the uniform disc, C^2 / 4.
 *
 * Gaussian: the Gaussian closest in L2 to the uniform disc of radius C has variance
 * a = C^2 / (2 ln 4) (Krivanek, Zara, Bouatouch 2003, section 3.2; exp(-C^2 / 2a) = 1/4). The
 * kernel is truncated at the cut-off c, which leaves tau(c) a of the variance: 0.28 C^2 at c = 2.5,
 * where the disc has 0.25 C^2. The reconstruction kernel and the prefilter compensate for the
 * truncation; here that was measured to be farther from a ray tracer's lens at every aperture (by
 * 0.3 to 0.9 dB), since the disc has no tail.
 */
inline double DefocusVariance(
  KernelType type, double circleOfConfusion, const TruncatedGaussian& gaussian)
{
  if (type == KernelType::PearsonII)
  {
    return 0.25 * circleOfConfusion * circleOfConfusion;
  }
  constexpr double twoLogFour = 2.7725887222397811; // 2 ln 4
  return gaussian.Tau * circleOfConfusion * circleOfConfusion / twoLogFour;
}
}
