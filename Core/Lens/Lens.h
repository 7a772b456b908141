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

/**
 * The area of a surfel that point u of the lens, a unit disc, sees, over the largest one: Base +
 * (X, Y).u where that is positive, 0 elsewhere, or, of a two-sided surfel, its magnitude.
 *
 * Seen from R u, the projected area of area vector a at p is proportional to -a.(p - R u), which is
 * linear in u. A surfel that is nearly edge-on is seen from one side of the lens only.
 */
template <class Real>
struct VisibleAreaOf
{
  Real Base; ///< at the lens's centre, (-inf, 1]
  Real X, Y; ///< length 1 - Base
  MaskOf<Real> TwoSided;
};

/// Mean of the visible area, [0, 1], and of u weighted with it.
template <class Real>
struct MeanVisibleArea
{
  Real Area, X, Y;
};

/// What is seen of a node, and its change per change of what is seen of its mean normal.
template <class Real>
struct FacingArea
{
  Real Area, Slope;
};

/**
 * Mean of max(0, x), or of |x| if two-sided, over x from area - spread to area + spread: what is
 * seen of leaves whose normals spread. Beyond that it is `area`, negative where all turn away.
 * @param area   px^2, seen of the sum of the leaves' area vectors, signed
 * @param spread px^2, >= 0
 */
template <class Real>
SURFELSPLATTING_INLINE FacingArea<Real> MeanFacingArea(
  const Real& area, const Real& spread, const MaskOf<Real>& twoSided)
{
  const Real inverse = 1.0 / Larger(spread, Uniform<Real>(1e-200));
  const Real high = area + spread;
  const MaskOf<Real> parts = (high > 0.0) & (area < spread);
  const Real one = 0.25 * high * high * inverse, slope = 0.5 * high * inverse;
  const Real both = 0.5 * (area * area * inverse + spread);
  return { parts ? (twoSided ? both : one) : area,
    parts ? (twoSided ? area * inverse : slope) : Uniform<Real>(1.0) };
}

/// Half-width of a uniform distribution with the variance of a coordinate of the disc, 1/4.
constexpr double UniformLens = 0.86602540378443865;

/// MeanOverLens where parts of the lens see nothing, or the other side.
template <class Real>
SURFELSPLATTING_INLINE MeanVisibleArea<Real> MeanOverParts(const VisibleAreaOf<Real>& v)
{
  const Real slope = Larger(1.0 - v.Base, Uniform<Real>(1e-30)), reach = UniformLens * slope;
  const auto part = [&](const Real& base, Real& moment) {
    const Real seen = Smaller(Larger(base + reach, Real{}), 2.0 * reach);
    const Real area = seen * seen / (4.0 * reach);
    moment = area * (UniformLens - seen / (3.0 * slope)); // a triangle's centroid
    return area + Larger(base - reach, Real{});
  };
  Real moment, behind;
  Real area = part(v.Base, moment);
  const Real back = part(-1.0 * v.Base, behind);
  area = v.TwoSided ? area + back : area;
  moment = v.TwoSided ? moment - behind : moment;
  const Real scale = moment / (slope * Larger(area, Uniform<Real>(1e-30)));
  return { area, scale * v.X, scale * v.Y };
}

/**
 * Means over the lens, with u uniform within UniformLens along the slope. Exact where all of the
 * lens sees the same side: area Base, point (X, Y) / (4 Base). Else area and moment are up to 0.009
 * (1 - Base) off.
 */
template <class Real>
SURFELSPLATTING_INLINE MeanVisibleArea<Real> MeanOverLens(const VisibleAreaOf<Real>& v)
{
  const MaskOf<Real> all = v.Base >= UniformLens * (1.0 - v.Base);
  const Real quarter = 0.25 / v.Base;
  MeanVisibleArea<Real> mean{ v.Base, quarter * v.X, quarter * v.Y };
  if (AnyLane<Real>(Not(all)))
  {
    const MeanVisibleArea<Real> parts = MeanOverParts(v);
    mean = { all ? mean.Area : parts.Area, all ? mean.X : parts.X, all ? mean.Y : parts.Y };
  }
  return mean;
}

/// An ellipse with the area of a disc: the covariance of its points over that of the disc's,
/// determinant 1. The default is a disc.
struct LensShape
{
  double XX = 1.0, YY = 1.0, XY = 0.0; ///< x right, y up in camera space

  /// Smaller eigenvalue: the squared ratio of the smaller semi-axis to the disc's radius.
  double Smallest() const { return 1.0 / this->Largest(); }
  double Largest() const { return Symmetric2{ this->XX, this->YY, this->XY }.LargestEigenvalue(); }

  /// The symmetric square root: it maps a disc to the ellipse.
  LensShape Root() const
  {
    const double scale = 1.0 / std::sqrt(this->XX + this->YY + 2.0);
    return { scale * (this->XX + 1.0), scale * (this->YY + 1.0), scale * this->XY };
  }
};

/// A lens in VTK's ray-tracing convention; Radius = vtkCamera::FocalDisk / 2. Radius 0 is a
/// pinhole.
struct Lens
{
  double Radius = 0.0;        ///< world units, >= 0; of an ellipse, that of a disc of its area
  double FocalDistance = 1.0; ///< distance in focus along the view direction, world units, > 0
  LensShape Shape{};          ///< of cells (SubApertures.h)

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
