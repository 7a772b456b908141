// SPDX-License-Identifier: BSD-3-Clause
/**
 * What is seen through a lens behind and within blurred layers, by moments over the lens. (Ours;
 * Documentation/Method.md derives it.)
 *
 * A fragment d px from the centre of its splat passes the lens, a unit disc, on average at
 *
 *   u = (I - L) m + M d,   M = C/4 S^(1/2) W^-1,   C signed: negative in front of the focus
 *
 * the regression of u, of covariance I/4, on d, of covariance W. (Of an ellipse, LensShape S, u is
 * the point of the unit disc that S^(1/2) maps to its own; of a disc S is I.) Splats of surfels
 * that are nearly edge-on are thin: across them u changes faster than along them. The lens's share
 * of W is L = C M S^(1/2). The rest of u does not depend on d; m is its mean where the surfel is
 * seen (Lens.h). In a wide blur u is on one side of the lens. There the fragment's weight
 * is that of what u sees of the surfel: the kernel, times Base + (X, Y).M d (LensFootprints in
 * Core/Splats/SetupOutput.h).
 *
 * A function f on the lens is kept as its mean f0 and its first moment f1 = mean of u f(u); its
 * linear reconstruction is
 *
 *   f(u) = f0 + 4 f1.u       (the mean of u_x^2 is 1/4)
 *
 * Two such functions decide what a fragment adds to the picture: T(u), what shines through the
 * finished layers, which has second moments too (LensMoments), and the coverage of its own layer so
 * far.
 *
 * Real is double, or Lanes of floats.
 */
#pragma once

#include "Core/Simd/RealLanes.h"

namespace SurfelSplatting
{
/// Where the light of a splat's fragments passes through the lens, u = (MeanX, MeanY) + PerForm
/// S^(1/2) Q (dx, dy), Q the matrix of the raster's q (ResamplingKernel.h), and its share of the
/// splat's weight, x = Area + AreaX dx + AreaY dy where x is positive, -Back x elsewhere. The
/// offset (dx, dy) from the centre is in px, or in cells of a coarse grid.
struct alignas(32) LensFootprint
{
  float MeanX, MeanY, PerForm;
  float Area, AreaX, AreaY;
  float Back;  ///< 1: two-sided, 0: seen from one side
  float Share; ///< l, the lens's share of W, mean over the directions, [0, 1]
};

/// What a Gaussian in space has instead, in the same place. They may be needles, so that the
/// regression is that of each direction, u = C / 4 W^-1 d.
struct alignas(32) SpaceFootprint
{
  float Quarter;                                  ///< C / 4, px
  float Opacity;                                  ///< at the centre in focus; 0 of volumes
  float RedX, GreenX, BlueX, RedY, GreenY, BlueY; ///< how the colour changes, per px
};
static_assert(sizeof(SpaceFootprint) == sizeof(LensFootprint), "one in the place of the other");

SURFELSPLATTING_INLINE SpaceFootprint SpaceFootprintOf(const LensFootprint& stored)
{
  SpaceFootprint footprint;
  __builtin_memcpy(&footprint, &stored, sizeof(footprint));
  return footprint;
}

SURFELSPLATTING_INLINE LensFootprint StoredOf(const SpaceFootprint& footprint)
{
  LensFootprint stored;
  __builtin_memcpy(&stored, &footprint, sizeof(stored));
  return stored;
}

/**
 * Largest first moment of a function with values in [0, 1] and this mean: that of a segment of the
 * disc, within 0.5 %.
 * @param mean [0, 1]
 */
template <class Real>
SURFELSPLATTING_INLINE Real LargestMoment(const Real& mean)
{
  const Real p = Larger(mean * (1.0f - mean), Real(0.0f));
  return p / (1.0f + 0.355f * SquareRoot(p));
}

/**
 * Factor, at most 1, by which a moment becomes no longer than LargestMoment.
 * @param mean [0, 1]
 * @param squared length of the moment
 */
template <class Real>
SURFELSPLATTING_INLINE Real ShortenToLargest(const Real& mean, const Real& squared)
{
  const Real p = Larger(mean * (1.0f - mean), Real(0.0f));
  const Real d = 1.0f + 0.355f * (p * InverseRoot(Larger(p, Real(1e-30f))));
  return Smaller(p * InverseRoot(Larger(squared * d * d, Real(1e-30f))), Real(1.0f));
}

/**
 * Largest mean of a function with values in [0, 1] whose centroid is c away from the centre: the
 * area of a segment of the disc with this centroid, over pi. A polynomial, fitted to the least
 * largest error against (t - sin t cos t) / pi at c = 2/3 sin^3 t / (t - sin t cos t), t the half
 * angle of the segment; off by 0.0005 up to c = 0.9.
 * @param c [0, 1], units of the lens's radius
 */
template <class Real>
SURFELSPLATTING_INLINE Real LargestCover(const Real& c)
{
  const Real p = 1.0f - c * (0.03396f + c * (0.94003f - c * (1.04860f - c * 0.86426f)));
  return Larger((1.0f - c) * p, Real(0.01f));
}

/// A layer's centroid has about this much noise, of the sampling: of a centroid c, c^3 / (c^2 +
/// CentroidNoise^2) counts. Units of the lens's radius. (With 0.02 subtracted from all of them a
/// lion has 0.3 dB less.)
constexpr float CentroidNoise = 0.04f;

/// The excess of a layer's weights over full coverage is assumed this far off the lens's centre: a
/// fully covered lens with a second surface in front of half of it is no less covered.
constexpr float ExcessCentroid = 0.5f;

/// Centroids of layers that cover little are uncertain as well: that of a segment that covers less
/// than 0.1 is noise of the level of detail. Such layers are not limited any further. In tails of
/// a kernel the regression of u is beyond the lens's rim; with 0.9, edges near the focus have a
/// step where 0.04 of the lens is covered, and with 0.85 where 0.08 is: a dragon has 1.1 times the
/// seams. (With 0.74, crowns of leaves get brighter, by 0.2 %.)
constexpr float MaxLensCentroid = 0.8f;

/// LargestCover(c) is at least 1 - CoverLossPerCentroid c.
constexpr float CoverLossPerCentroid = 1.18f;

/// A layer's moment without that of its excess over full coverage.
/// @param weight sum w @param moment length of sum w u
template <class Real>
SURFELSPLATTING_INLINE Real MomentOfCover(const Real& weight, const Real& moment)
{
  return Larger(moment - ExcessCentroid * Larger(weight - 1.0f, Real(0.0f)), Real(0.0f));
}

/**
 * Share of the lens that a layer can cover at most. Surfaces that cover one another through the
 * same side of the lens have a sum of weights that their centroid does not allow.
 * @param weight sum w, > 0
 * @param moment length of sum w u
 */
template <class Real>
SURFELSPLATTING_INLINE Real LargestCoverOfLayer(const Real& weight, const Real& moment)
{
  constexpr float noise = CentroidNoise * CentroidNoise;
  const Real cover = Larger(Smaller(weight, Real(1.0f)), Real(1e-8f)); // its cube is a float
  const Real m = Smaller(MomentOfCover(weight, moment), cover), squared = m * m;
  const Real counted = squared * m / (cover * (squared + noise * (cover * cover)));
  return LargestCover(Smaller(counted, Real(MaxLensCentroid)));
}

/**
 * Factor for the moment of a layer whose weights shrink by a factor: it then covers as large a
 * share of the lens as before.
 * @param weight sum w, > 0
 * @param moment length of sum w u
 * @param shrink [0, 1]
 */
template <class Real>
SURFELSPLATTING_INLINE Real ShrinkMoment(const Real& weight, const Real& moment, const Real& shrink)
{
  const Real one(1.0f), cover = Smaller(weight, one), left = shrink * weight;
  const Real excess = ExcessCentroid * Larger(left - 1.0f, Real(0.0f));
  const Real wanted = MomentOfCover(weight, moment) * Smaller(left, one) + cover * excess;
  return Smaller(wanted / Larger(cover * moment, Real(1e-30f)), shrink);
}

/// A fragment adds nothing where its layer is full: one that arrives at coverage f through its lens
/// point counts (1 + r - f) / r, within [0, 1]. Weights of one surface ripple about 1 by r, more
/// through a lens than in focus. Through a lens it adds 1 + r - f at most: without this limit a
/// heavy fragment counts much more before another one than behind it, and where two of nearly the
/// same depth swap, a lion in a focus pull jumps by 3.2 levels instead of 2.7.
constexpr float RippleInFocus = 0.1f, RippleThroughLens = 0.25f;

/// The same for tents, whose layers were limited on their grid, and are averaged over neighbours:
/// they count (FullOfTents - f) / RippleOfTents.
constexpr float FullOfTents = 1.3f, RippleOfTents = 0.2f;

/// A layer's coverage at a lens point is f0 + FillSlope 4 f1.u. With the whole slope, half a lens
/// that is covered has 1.35 at its rim instead of 1, and what arrives there last would be dropped.
constexpr float FillSlope = 0.6f;

/// T at a lens point is t0 + SeenSlope 4 t1.u, clipped to [0, 1]. Clipping takes a part of the
/// moment away, and a steeper line gives some of it back. Covariances of tents are means over much
/// of the lens, where less is clipped, so that theirs is less steep. (Measured before
/// QuadraticPart: with 1 for both, bars at 12 px have 0.8 dB less, and a bunny at 36 px 0.7; with
/// 1.5, a veil has 1.5 dB less. With it, and 1.1 instead of 1.25, scans have 0.1 dB more, but
/// blurred corners lose 0.058 of their coverage instead of 0.039.)
constexpr float SeenSlope = 1.25f, SeenSlopeOfTents = 1.125f;

/// What is seen at a lens point is at least this share of what is seen on average: something of a
/// layer that covers all of the lens is seen.
constexpr float LeastSeen = 0.02f;

/// T at a lens point from its linear reconstruction. @param mean of T
template <class Real>
SURFELSPLATTING_INLINE Real LimitSeen(const Real& seen, const Real& mean)
{
  return Smaller(Larger(seen, LeastSeen * mean), Real(1.0f));
}

/// What of T is reconstructed about a lens point u.
template <class Real>
struct RampMoments
{
  Real Squared; ///< |t1|^2
  Real AtPoint; ///< t1.u
  Real Spread;  ///< t1' (1 - L) t1
};

/// The height c of the sigmoid: its ends lie beyond [0, 1], to which it is clipped. With 1.1, five
/// captures blurred by 8 px are 0.8 to 2 dB farther from the mean of pinholes.
constexpr float RampPeak = 1.2f;

/// Weight of the ramp beside the linear reconstruction: T hardly varies over the lens for a
/// fragment whose light comes through most of it. @param share l, [0, 1]
SURFELSPLATTING_INLINE float WeightOfRamp(float share)
{
  constexpr float from = 0.25f, to = 0.4f;
  const float weight = (share - from) * (1.0f / (to - from));
  return weight < 0.0f ? 0.0f : weight > 1.0f ? 1.0f : weight;
}

/// What the blur of a fragment's footprint adds to the width of the ramp. @param share l, [0, 1]
SURFELSPLATTING_INLINE float BlurOfRamp(float share)
{
  const float rest = 1.0f - share;
  return 0.6f * (1.0f - rest * rest);
}

/**
 * T(u) where many fragments have come through the same side of the lens: little is left there, and
 * nearly all elsewhere, which is steeper than the linear reconstruction. A sigmoid has the same
 * mean and moment, from hardly any slope to the border of a segment of the disc:
 *
 *   T = 1/2 + c/2 N / sqrt(N^2 + D^2), clipped to [0, 1],  y = 2 mean - 1,  P = 1 / (c^2 - y^2)
 *   N = y P^1/2 (1 + r^2 g(P)) + b t1.u,  b = 8 c^2 P^3/2
 *   D^2 = (1 - r^2) (1 + r^2 d(P)),  r = |t1| / LargestMoment
 *
 * With r = 0, it has the mean and the slope 4 t1. g and d are polynomials, fitted to the mean and
 * moment over the disc for means from 0.003 to 0.997 and r to 0.99: off by at most 0.0056 and
 * 0.0041; with r = 1 by 0.0081 and 0.0076.
 *
 * Of a fragment's footprint only the share L is the lens's: its light comes through points about u
 * of covariance (1 - L) / 4, over which T is to be averaged. k b^2 t1' (1 - L) t1 is added to D^2.
 * k = pi / 8 would be right for a step. Measured on surfaces and hair, less is better where l is
 * small, and more where it is large: k = BlurOfRamp.
 * @param mean of T, [0, 1]
 * @param blur k
 */
template <class Real>
SURFELSPLATTING_INLINE Real ReconstructRamp(
  const Real& mean, const RampMoments<Real>& t, float blur)
{
  const Real one(1.0f), none(0.0f);
  const Real p = Larger(mean * (1.0f - mean), Real(1e-6f)), perRoot = InverseRoot(p);
  const Real toLargest = perRoot * perRoot + 0.355f * perRoot;      // 1 / LargestMoment(mean)
  const Real r = Smaller(t.Squared * (toLargest * toLargest), one); // squared
  const Real y = 2.0f * mean - 1.0f, perWidth = InverseRoot(RampPeak * RampPeak - y * y);
  const Real w = perWidth * perWidth, slope = (8.0f * RampPeak * RampPeak) * (w * perWidth);
  const Real shift = 0.575f + w * (-0.210f - 0.209f * w);
  const Real steep = Larger(one + r * (0.102f + w * (0.792f - 0.560f * w)), Real(0.02f));
  const Real place = y * perWidth * (one + r * shift) + slope * t.AtPoint;
  // L exceeds 1 where pixels are not square.
  const Real spread = Larger(t.Spread, none);
  const Real width = (one - r) * steep + (blur * spread) * (slope * slope) + 1e-6f; // squared
  const Real rise = place * InverseRoot(place * place + width);
  return Smaller(Larger(0.5f + (0.5f * RampPeak) * rise, none), one);
}

/// T over the lens: the means of u T and of three polynomials of the second degree times T.
template <class Real>
struct LensMoments
{
  Real X, Y;
  Real Rim;      ///< 2 |u|^2 - 1
  Real Across;   ///< u_x^2 - u_y^2
  Real Diagonal; ///< 2 u_x u_y
};

/// The lens's share of a Gaussian's footprint, L = C^2 / 4 W^-1: symmetric, eigenvalues in [0, 1].
/// The light of a fragment comes through points about its lens point, of covariance (1 - L) / 4.
struct ShareOfLens
{
  float XX, XY, YY;

  /// Mean over the directions, at most 1.
  SURFELSPLATTING_INLINE float Mean() const
  {
    const float mean = 0.5f * (this->XX + this->YY);
    return mean < 1.0f ? mean : 1.0f;
  }

  /// (1 - L) t1 @param t of T
  template <class Real>
  SURFELSPLATTING_INLINE void Rest(const LensMoments<Real>& t, Real& x, Real& y) const
  {
    x = t.X - (this->XX * t.X + this->XY * t.Y);
    y = t.Y - (this->XY * t.X + this->YY * t.Y);
  }

  /// Means over the footprint of a fragment. @param x,y its lens point
  template <class Real>
  SURFELSPLATTING_INLINE LensMoments<Real> MomentsAt(const Real& x, const Real& y) const
  {
    const Real xx = x * x, yy = y * y;
    return { x, y, 2.0f * (xx + yy) - this->Mean(), xx - yy - 0.25f * (this->XX - this->YY),
      2.0f * (x * y) - 0.5f * this->XY };
  }
};

/// T(u) is no line where little of it is left: 4 hides / T limits what its slope adds.
constexpr float LargestSlope = 4.0f;

/**
 * Mean of 2 |u|^2 - 1 over a segment of the disc whose centroid is c away from the centre, over c.
 * The mean is c cos t, t the half angle of the segment (LargestCover), and that of u_n^2 - u_t^2 as
 * well, n along the centroid. A polynomial, fitted to the least largest error: c times it is off by
 * 0.001 up to c = 0.95, by 0.004 beyond.
 * @param c [0, 1]
 */
template <class Real>
SURFELSPLATTING_INLINE Real SecondMomentPerCentroid(const Real& c)
{
  return c * (2.41930f - c * (0.87468f - 0.35441f * c)) - 0.89520f;
}

/**
 * Moments of what a layer hides, as if it were a segment of the lens with this first moment.
 * (Second moments summed over the layer's fragments instead give bars at 12 px 0.8 dB more, but a
 * veil 0.7 dB less, and take 5 to 7 % of the frame.)
 * @param hidden of T, >= 0 @param x,y first moment of what is hidden
 */
template <class Real>
SURFELSPLATTING_INLINE LensMoments<Real> MomentsOfSegment(
  const Real& hidden, const Real& x, const Real& y)
{
  const Real squared = x * x + y * y, perLength = InverseRoot(Larger(squared, Real(1e-30f)));
  const Real length = squared * perLength;
  const Real c = Smaller(length / Larger(hidden, Real(1e-12f)), Real(1.0f));
  const Real second = SecondMomentPerCentroid(c), perSquare = second * perLength;
  return { x, y, second * length, perSquare * (x * x - y * y), perSquare * (2.0f * (x * y)) };
}

/// The quadratic reconstruction of T has this share of its second-degree terms, of which clipping
/// takes a part away. (With all of them, a dragon blurred by 24 px has 0.1 dB more, and a lion 0.1
/// dB less.)
constexpr float ShareOfQuadratic = 0.5f;

/// Means over a fragment's footprint of 2 (2 |u|^2 - 1), 4 (u_x^2 - u_y^2) and 8 u_x u_y.
template <class Real>
struct SquaresOnLens
{
  Real Rim, Across, Diagonal;
};

/// About lens points 2 u = (x, y), with covariance (1 - share) / 4 of u.
template <class Real>
SURFELSPLATTING_INLINE SquaresOnLens<Real> SquaresAt(const Real& x, const Real& y, float share)
{
  const Real xx = x * x, yy = y * y;
  return { xx + yy - 2.0f * share, xx - yy, (x + x) * y };
}

/// The terms of the second degree of T at a lens point: the means over the lens of the squares of
/// 2 |u|^2 - 1, u_x^2 - u_y^2 and 2 u_x u_y are 1/3, 1/6 and 1/6.
template <class Real, class Squares>
SURFELSPLATTING_INLINE Real QuadraticPart(const LensMoments<Real>& t, const Squares& at)
{
  return (1.5f * ShareOfQuadratic) *
    (t.Rim * at.Rim + t.Across * at.Across + t.Diagonal * at.Diagonal);
}

/// What a fragment hides. @tparam Real lanes or numbers
template <class Real>
struct HiddenPart
{
  Real OfT;    ///< a T(u), within Frechet's bounds
  Real Slopes; ///< a, at most LargestSlope a T(u) / T
  Real Fades;  ///< (1 - l) a T(u) / T, [0, 1]
  Real Kept;   ///< 1 - a T(u) / T, [0, 1]
};

/**
 * Moments of T behind a fragment, whose light comes through points u + d, d of covariance
 * (1 - L) / 4. With T linear about u, T(u + d) = T(u) + 4 t1.d, the fragment hides, of opacity a,
 *
 *   of T         a T(u)
 *   of t1        a (T(u) u + v),   v = (1 - L) t1
 *   of u u' T    a (T(u) (u u' + (1 - L) / 4) + u v' + v u')
 *
 * The second moments beyond those of a linear T fade with the mean share 1 - l of what is hidden.
 * What has no border on the lens hides the same share of the second moments as of T.
 * @param t      before @param at of the fragment (ShareOfLens::MomentsAt)
 * @param border SharpnessOfBorder, [0, 1]
 */
template <class Real>
SURFELSPLATTING_INLINE LensMoments<Real> MomentsBehind(const LensMoments<Real>& t,
  const ShareOfLens& share, const LensMoments<Real>& at, const HiddenPart<Real>& part, float border)
{
  const Real &hides = part.OfT, &slopes = part.Slopes;
  Real x, y;
  share.Rest(t, x, y);
  const Real left = t.X - hides * at.X - slopes * x, top = t.Y - hides * at.Y - slopes * y;
  if (!(border > 0.0f))
  {
    return { left, top, part.Kept * t.Rim, part.Kept * t.Across, part.Kept * t.Diagonal };
  }
  // The border's share loses what is about the lens point, the rest as much as T.
  const Real keep = part.Kept + border * ((1.0f - part.Kept) - part.Fades);
  const Real about = border * hides, slope = (2.0f * border) * slopes;
  const Real xx = at.X * x, yy = at.Y * y;
  return { left, top, keep * t.Rim - about * at.Rim - slope * (2.0f * (xx + yy)),
    keep * t.Across - about * at.Across - slope * (xx - yy),
    keep * t.Diagonal - about * at.Diagonal - slope * (at.X * y + at.Y * x) };
}

/// T beside and behind an ellipse on the lens.
template <class Real>
struct EllipseOnLens
{
  Real Opacity; ///< v, [0, 1]
  Real Seen;    ///< T(u)
};

/// By which the border of the ellipse is softened, in q: 1 +- 1/4.
constexpr float EllipseSlope = 2.0f;

/**
 * T(u) where what is hidden is one shape on the lens, such as a leaf before its middle. The ellipse
 * has the moments of 1 - T:
 *
 *   h = 1 - mean,  m = mean of u (1 - T) / h,  S = mean of u u' (1 - T) / h - m m'
 *   a = 4 sqrt(det S)   its share of the lens (the whole lens has S = I / 4), limited to [h, 1]
 *   T = 1 - v inside, v = h / a;  1 outside;  q = (u - m)' S^-1 (u - m) / 4 is 1 at the border
 *
 * q is scaled where a is limited. v near 1 says that there is one shape, and that it is opaque; v
 * near h that what is hidden is all over the lens.
 * @param mean of T, [0, 1]
 */
template <class Real>
SURFELSPLATTING_INLINE EllipseOnLens<Real> ReconstructEllipse(
  const Real& mean, const LensMoments<Real>& t, const Real& x, const Real& y)
{
  const Real one(1.0f), none(0.0f);
  const Real h = Larger(1.0f - mean, Real(1e-4f)), squared = h * h;
  // All in units of h: moments of 1 - T, h^2 S, h (u - m).
  const Real trace = 0.25f * h * (h - t.Rim), across = 0.5f * h * t.Across;
  const Real least = 1e-4f * squared;
  const Real xx = Larger(trace - across - t.X * t.X, least);
  const Real yy = Larger(trace + across - t.Y * t.Y, least);
  const Real xy = -0.5f * h * t.Diagonal - t.X * t.Y;
  const Real determinant = Larger(xx * yy - xy * xy, 1e-7f * squared * squared);
  const Real perRoot = InverseRoot(determinant), cubed = squared * h;
  const Real perCubed = 1.0f / cubed; // while the rest is waited for
  const Real opacity = Smaller(Larger(0.25f * cubed * perRoot, h), one);
  const Real dx = h * x + t.X, dy = h * y + t.Y;
  const Real distance = yy * dx * dx + xx * dy * dy - 2.0f * xy * dx * dy;
  const Real q = distance * perCubed * (opacity * perRoot);
  const Real inside = Smaller(Larger(0.5f + EllipseSlope * (1.0f - q), none), one);
  return { opacity, 1.0f - opacity * inside };
}

/// A weight of less is not worth an ellipse; larger ones rise from 0 there. With 0.2, a lion at 12
/// px of blur loses 0.5 dB; with 1/32, frames at 4 and 8 px of blur take 6 % longer.
constexpr float LeastEllipse = 0.1f;

/**
 * Weight of an ellipse of opacity 1. What a thin or hardly blurred Gaussian hides has no border on
 * the lens.
 * @param share l, [0, 1] @param opacity o of the Gaussian in focus, [0, 1]
 */
SURFELSPLATTING_INLINE float WeightOfEllipse(float share, float opacity)
{
  const float bordered = share * opacity;
  const float weight = (bordered * bordered - LeastEllipse) * (1.0f / (1.0f - LeastEllipse));
  return weight > 0.0f ? weight : 0.0f;
}

/// How much of what a Gaussian hides of the second moments has a border on the lens. It rises from
/// 0 as well: what follows reads them. @param weight of an ellipse of opacity 1, [0, 1]
SURFELSPLATTING_INLINE float SharpnessOfBorder(float weight)
{
  return weight < 0.25f ? 4.0f * weight : 1.0f;
}

/**
 * T(u) of a ramp and of an ellipse. What either of them hides is hidden.
 * @param weight of the ellipse, [0, 1]
 */
template <class Real>
SURFELSPLATTING_INLINE Real SeenBetween(const Real& ramp, const Real& ellipse, const Real& weight)
{
  return ramp + weight * Smaller(ellipse - ramp, Real(0.0f));
}

/// The sums of a layer that decide how much of it is seen.
template <class Real>
struct LayerCoverage
{
  Real Filled;  ///< sum w over LargestCoverOfLayer
  Real Opacity; ///< sum w o
  Real Seen;    ///< sum w o T(u)
};

/// The part of the lens through which a layer is seen, [0, T]: within Frechet's bounds for the
/// overlap of the layer with T. @param through mean of T
template <class Real>
SURFELSPLATTING_INLINE Real VisibleShare(const Real& through, const LayerCoverage<Real>& layer)
{
  const Real scale = 1.0f / Larger(layer.Filled, Real(1.0f));
  const Real alpha = scale * layer.Opacity;
  const Real least = Larger(through + alpha - 1.0f, Real(0.0f));
  return Smaller(Larger(scale * layer.Seen, least), Smaller(through, alpha));
}

/// Width of Frechet's bounds for the visible share: how much of it is not known without the
/// moments.
template <class Real>
SURFELSPLATTING_INLINE Real ShareInterval(const Real& through, const LayerCoverage<Real>& layer)
{
  const Real alpha = layer.Opacity / Larger(layer.Filled, Real(1.0f));
  return Smaller(through, alpha) - Larger(through + alpha - 1.0f, Real(0.0f));
}

/**
 * Mean of |T(u) - T| over the lens behind a layer; the visible share of what follows is no more
 * uncertain than this. A layer of opacity o that covers the share f of the lens makes differences
 * smaller as it does T, and adds its own, 2 f (1 - f) o T. A veil that covers all adds none.
 * @param variation before the layer @param before T there @param after T behind the layer
 * @param cover f
 */
template <class Real>
SURFELSPLATTING_INLINE Real VariationBehind(
  const Real& variation, const Real& before, const Real& after, const Real& cover)
{
  const Real taken = Larger(before - after, Real(0.0f));
  return variation * (1.0f - taken / Larger(before, Real(1e-6f))) + 2.0f * taken * (1.0f - cover);
}
}
