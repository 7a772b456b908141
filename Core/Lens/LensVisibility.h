// SPDX-License-Identifier: BSD-3-Clause
/**
 * What is seen through a lens behind and within blurred layers, by mean and first moments over the
 * lens. (Ours; Documentation/Method.md derives it.)
 *
 * A fragment d px from the centre of its splat passes the lens, a unit disc, on average at
 *
 *   u = m + M d,   M = C / (4 sqrt(det W)),   C signed: negative in front of the focus
 *
 * where m is the mean aperture point of its surfel (Lens.h): the regression of C u, of variance C^2
 * / 4, on the footprint's W. In a wide blur u is on one side of the lens. A function f on the lens
 * is kept as its mean f0 and its first moment f1 = mean of u f(u); its linear reconstruction is
 *
 *   f(u) = f0 + 4 f1.u       (the mean of u_x^2 is 1/4)
 *
 * Two such functions decide what a fragment adds to the picture: T(u), what shines through the
 * finished layers, and the coverage of its own layer so far.
 *
 * Real is double, or Lanes of floats.
 */
#pragma once

#include "Core/Simd/RealLanes.h"

namespace SurfelSplatting
{
/// Where the light of a splat's fragments passes through the lens: u = (MeanX, MeanY) + PerPixel
/// (dx, dy). The offset (dx, dy) from the centre is in px, or in cells of a coarse grid.
struct alignas(16) LensFootprint
{
  float MeanX, MeanY;
  float PerPixel;
};

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
 * Largest mean of a function with values in [0, 1] whose centroid is c away from the centre: the
 * area of a segment of the disc, from LargestMoment(a) = c a by two steps of a fixed point. It is
 * up to 0.031 too large, where a segment has c = 0.9, and 0.001 too small.
 * @param c [0, 1], units of the lens's radius
 */
template <class Real>
SURFELSPLATTING_INLINE Real LargestCover(const Real& c)
{
  Real a = 1.0f - c;
  for (int step = 0; step < 2; ++step)
  {
    const Real p = Larger(a * (1.0f - a), Real(0.0f));
    a = Larger(1.0f - c * (1.0f + 0.355f * SquareRoot(p)), Real(0.01f));
  }
  return a;
}

/// Centroids of a layer's fragments this close to the centre are noise of the sampling.
constexpr float MinLensCentroid = 0.02f;

/// The excess of a layer's weights over full coverage is assumed this far off the lens's centre: a
/// fully covered lens with a second surface in front of half of it is no less covered.
constexpr float ExcessCentroid = 0.5f;

/// LargestCover(c) is at least 1 - CoverLossPerCentroid c.
constexpr float CoverLossPerCentroid = 1.18f;

/**
 * Share of the lens that a layer can cover at most. Surfaces that cover one another through the
 * same side of the lens have a sum of weights that their centroid does not allow.
 * @param weight sum w, > 0
 * @param moment length of sum w u
 */
template <class Real>
SURFELSPLATTING_INLINE Real LargestCoverOfLayer(const Real& weight, const Real& moment)
{
  const Real excess = Larger(weight - 1.0f, Real(0.0f));
  const Real centroid = Larger(moment - ExcessCentroid * excess, Real(0.0f)) /
    Larger(Smaller(weight, Real(1.0f)), Real(1e-30f));
  const Real beyond = (centroid - MinLensCentroid) * (1.0f / (1.0f - MinLensCentroid));
  return LargestCover(Smaller(Larger(beyond, Real(0.0f)), Real(1.0f)));
}

/// A fragment adds nothing where its layer is full: one that arrives at coverage f through its lens
/// point counts (full - f) / FullKnee, within [0, 1]. Weights of one surface ripple about 1: more
/// through a lens than in focus, and more on coarse grids, whose cells are averaged afterwards.
constexpr float FullInFocus = 1.1f, FullThroughLens = 1.2f, FullOnCoarseGrid = 1.3f;
constexpr float FullKnee = 0.1f;

/// @param fill coverage of the layer at the fragment's lens point
template <class Real>
SURFELSPLATTING_INLINE Real RoomInLayer(const Real& fill, float full)
{
  return Smaller(Larger((full - fill) * (1.0f / FullKnee), Real(0.0f)), Real(1.0f));
}

/// Where a kernel is less than this share of its peak, the splat's z-range is shorter.
constexpr float FullReach = 0.05f;

/// What is seen at a lens point is at least this share of what is seen on average: something of a
/// layer that covers all of the lens is seen.
constexpr float LeastSeen = 0.02f;

/// T at a lens point from its linear reconstruction. @param mean of T
template <class Real>
SURFELSPLATTING_INLINE Real LimitSeen(const Real& seen, const Real& mean)
{
  return Smaller(Larger(seen, LeastSeen * mean), Real(1.0f));
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
SURFELSPLATTING_INLINE Real VisibleShare(
  const Real& through, const LayerCoverage<Real>& layer, const Real& keep)
{
  const Real scale = keep / Larger(keep * layer.Filled, Real(1.0f));
  const Real alpha = scale * layer.Opacity;
  const Real least = Larger(through + alpha - 1.0f, Real(0.0f));
  return Smaller(Larger(scale * layer.Seen, least), Smaller(through, alpha));
}

/// What of a layer joins the finished ones.
template <class Real>
struct LayerLeak
{
  Real Share;   ///< of the layer's sums that is composited
  Real Through; ///< T', what then shines through
  Real Rest;    ///< T' / T: by which the share of the sums that stays is seen less
};

/// A layer that leaves less than this share of the light behind it ends the more, the less it
/// leaves: of an opaque one nothing stays. Else rounding would decide, where both T - v and T - v'
/// are 0.
constexpr float LeastLeft = 1.0f / 512.0f;

/**
 * A layer does not end at once where the next fragment begins behind it: the share keep of it stays
 * open. The rest is composited so that the picture, if nothing else came, is the same:
 *
 *   T' - v' = T - v,   v, v' = VisibleShare of the layer and of the share that stays
 *
 * where the sums that stay see T' instead of T.
 * @param keep [0, 1); if it is exp(-gap / band), splats of hardly any weight within a gap change
 * nothing
 */
template <class Real>
SURFELSPLATTING_INLINE LayerLeak<Real> Leak(
  const Real& through, const LayerCoverage<Real>& layer, const Real& keep)
{
  const Real all = VisibleShare(through, layer, Real(1.0f));
  const Real kept = VisibleShare(through, layer, keep);
  const Real left = through - all;
  const Real stays = Smaller(left / Larger(LeastLeft * through, Real(1e-30f)), Real(1.0f));
  const Real rest = stays * Smaller(left / Larger(through - kept, Real(1e-12f)), Real(1.0f));
  return { Larger(all - rest * kept, Real(0.0f)) / Larger(layer.Seen, Real(1e-30f)),
    Larger(rest * through, Real(0.0f)), rest };
}

/// The same with keep = 0: the layer ends.
template <class Real>
SURFELSPLATTING_INLINE LayerLeak<Real> End(const Real& through, const LayerCoverage<Real>& layer)
{
  const Real all = VisibleShare(through, layer, Real(1.0f));
  return { all / Larger(layer.Seen, Real(1e-30f)), Larger(through - all, Real(0.0f)), Real(0.0f) };
}
}
