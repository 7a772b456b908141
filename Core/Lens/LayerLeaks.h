// SPDX-License-Identifier: BSD-3-Clause
/**
 * How long the layers of the A-buffer become, and what of them leaks where gaps open. Which layer a
 * fragment belongs to changes continuously with its depth and its weight. (Ours;
 * Documentation/Method.md derives it.)
 *
 * Weights are shares of a pixel, sums of them a layer's coverage. Real is double, or Lanes of
 * floats.
 */
#pragma once

#include "Core/Lens/LensVisibility.h"

namespace SurfelSplatting
{
/// A fragment of this weight (share of a pixel) makes its layer as long as the splat's z-range. One
/// of less takes the layer's end closer to the splat's by its share of it: two halves do nearly
/// what the whole does, so that nodes of the level of detail and their children make layers of
/// nearly the same length. (Ours; Documentation/Method.md has what other weights do.)
constexpr float WeightOfReach = 0.004f;

/// The same for splats in the cells of coarse grids, which are lighter. With 0.002 a bunny at 36 px
/// flips by 8 levels in a dolly instead of 5, and with 0.001 light things, such as blades of grass,
/// join a meadow's horizon to what is behind it. With 0.004 a floor of small surfels without level
/// of detail comes apart: 3 dB less.
constexpr float WeightOfReachInCell = 0.003f;

/// Through a lens, a kernel's tail below this value lengthens its layer less than its weight says,
/// once the layer covers something: wholly from CoverOfReach on. Such a tail may bridge the gap
/// between two surfaces. In motion it comes and goes within a frame, and without this limit pixels
/// of a lion flashed by 13 levels. Tails that begin a layer may bridge: a surface begins with
/// tails. (With 1/4, layers leak 6 % more often; with 1/8, a pixel still flashes. In focus the
/// limit would part the front of a ball from its back at silhouettes: the coverage of glass would
/// differ by 0.16 from that of what is opaque, instead of 0.055.)
constexpr float KernelOfReach = 0.2f, CoverOfReach = 0.5f;

/**
 * How much of its weight a fragment counts with for the length of its layer, [0, 1].
 * @param kernel at the fragment, 1 at the splat's centre
 * @param layer sum w before it
 */
template <class Real>
SURFELSPLATTING_INLINE Real ShareOfReach(const Real& kernel, const Real& layer)
{
  const Real begins = Larger(1.0f - (1.0f / CoverOfReach) * layer, Real(0.0f));
  return Smaller((1.0f / KernelOfReach) * kernel + begins, Real(1.0f));
}

/// Beyond the lens's rim nothing is seen: a tail of a kernel there would bridge the gap between two
/// surfaces that are seen through opposite sides of the lens. From |u|^2 = 1 on, a fragment
/// lengthens its layer less, and not at all from this on. (Without the limit, a dragon blurred by
/// 24 px has 99 pixels with edges of more than 7 levels instead of 88.)
constexpr float EndOfRim = 1.2f;

/// How much of its weight a fragment counts with for the length of its layer, [0, 1].
/// @param twice squared length of 2 u
template <class Real>
SURFELSPLATTING_INLINE Real ShareWithinRim(const Real& twice)
{
  constexpr float slope = 1.0f / (EndOfRim - 1.0f);
  return Smaller(Larger(slope * EndOfRim - 0.25f * slope * twice, Real(0.0f)), Real(1.0f));
}

/// Where a layer ends, world units along the view direction. A part of it may go on farther: in
/// one cell of a coarse grid splats between two surfaces may join them, and not in the next. Where
/// the tents of both overlap, the joint fades in from pixel to pixel.
template <class Real>
struct LayerEnds
{
  Real Far;
  Real Farther; ///< >= Far
  Real Weight;  ///< of the part that ends at Farther, sum w
};

/**
 * The ends of a layer to which a tent is added. It ends at three places then, of which two become
 * one, at their mean: those that take the least of the variance of ends with them. (Ours. With one
 * end, which a tent moves by three times its share of the layer, crowns of trees in seven cells
 * have 1.7 times the seams and 1.5 dB less. When the two closest are joined, they have 0.2 dB less,
 * and a lion has 1.2 times the seams.)
 * @param weight of the layer, sum w @param end of the tent @param added weight of the tent, > 0
 */
template <class Real>
SURFELSPLATTING_INLINE LayerEnds<Real> AddEnd(
  const LayerEnds<Real>& layer, const Real& weight, const Real& end, const Real& added)
{
  const Real none(0.0f), stops = Larger(weight - layer.Weight, none), sum = weight + added;
  const Real first = Smaller(layer.Far, end), last = Larger(layer.Farther, end);
  const Real middle = Larger(layer.Far, Smaller(layer.Farther, end));
  const Real ofFirst = Select(end < layer.Far, added, stops);
  const Real ofLast = Select(end > layer.Farther, added, layer.Weight);
  const Real ofMiddle = Larger(sum - ofFirst - ofLast, none);
  // Two ends a, b at a distance d lose a b / (a + b) d^2.
  const Real before = middle - first, behind = last - middle;
  const Real lostBefore = ofFirst * (ofMiddle + ofLast) * (before * before);
  const Real lostBehind = ofLast * (ofMiddle + ofFirst) * (behind * behind);
  const auto joinsFirst = lostBefore < lostBehind;
  const Real both = Larger(ofMiddle + Select(joinsFirst, ofFirst, ofLast), Real(1e-30f));
  const Real joint = Select(joinsFirst, before, behind) * (ofMiddle / both);
  const Real far = Select(joinsFirst, first + joint, first);
  const Real farther = Select(joinsFirst, last, last - joint);
  const auto isNew = weight <= none;
  return { Select(isNew, end, far), Select(isNew, end, farther),
    Select(isNew, none, Select(joinsFirst, ofLast, ofLast + ofMiddle)) };
}

/// From this share of a layer on, what goes on farther takes the whole layer with it. With 1, where
/// the grids of a tilted plane meet, it loses 2 % of its coverage instead of 1 %.
constexpr float ShareOfJoint = 1.0f / 3.0f;

/// A fragment of this weight makes its layer leak over 1 - 1 / e of the gap in front of it.
constexpr float LeakingWeight = 0.0005f;

/**
 * The share of the gap in front of a fragment over which its layer leaks: 1 - e^-x, x = w /
 * LeakingWeight, here 1 - (1 - x / 4)^4. A fragment of hardly any weight changes nothing, and two
 * do nearly what one of their weight does.
 * @param weight w, >= 0
 */
template <class Real>
SURFELSPLATTING_INLINE Real LeakingShare(const Real& weight)
{
  const Real root = Larger(1.0f - weight * (0.25f / LeakingWeight), Real(0.0f));
  const Real squared = root * root;
  return 1.0f - squared * squared;
}

/// Layers of less weight do not leak: they join the next one. Otherwise up to half of all leaks
/// would be theirs, and the tails of kernels that begin a surface would hide a part of it.
constexpr float LeastLeakingWeight = 1.0f / 256.0f;

/// For layers of this weight all of a gap counts. A single threshold would flicker: bars in an
/// orbit have 1 level instead of 0.5 then.
constexpr float FullyLeakingWeight = 1.0f / 64.0f;

/// The share of the gap behind a layer that counts. Over the rest it joins what follows.
/// @param weight sum w
template <class Real>
SURFELSPLATTING_INLINE Real GapOfLayer(const Real& weight)
{
  constexpr float perWeight = 1.0f / (FullyLeakingWeight - LeastLeakingWeight);
  return Smaller(
    Larger(perWeight * weight - perWeight * LeastLeakingWeight, Real(0.0f)), Real(1.0f));
}

/// What of a layer joins the finished ones.
template <class Real>
struct LayerLeak
{
  Real Share;   ///< of the layer's sums that is composited
  Real Through; ///< T', what then shines through
  Real Seen;    ///< factor of the sums that stay and are weighted with T
  Real Weight;  ///< factor of the weights that stay
  Real Opacity; ///< factor of the opacities that stay
};

/// Root of h^4 - s h^3 - l = 0 for s, l >= 0, s + l <= 1: off by 1e-7. With x = s^2 + sqrt(l),
/// h / sqrt(x) depends on p = s / sqrt(x) alone: a polynomial, 1 at p = 0 and 1, is off by 0.0021.
/// A step of Halley's method follows, which divides once; Newton's would need two.
template <class Real>
SURFELSPLATTING_INLINE Real LeakRoot(const Real& s, const Real& l)
{
  const Real none(1e-30f);
  const Real x = s * s + l * InverseRoot(Larger(l, none));
  const Real perRoot = InverseRoot(Larger(x, none)), p = s * perRoot, pp = p * p;
  const Real scaled = (1.0f + 0.330445f * p) + pp * (3.747756f * p - 1.385050f) +
    (pp * pp) * (2.982667f * p - 5.675818f);
  const Real h = x * perRoot * scaled;
  const Real cubed = h * h * h, off = cubed * (h - s) - l, steep = 4.0f * h - 3.0f * s;
  const Real below = cubed * (steep * steep) - 3.0f * off * (2.0f * h - s);
  return h - off * (h * steep) / Larger(below, none);
}

/**
 * A layer does not end at once where the next fragment begins behind it: a part of it stays open.
 * The rest is composited so that the picture, if nothing else came, is the same:
 *
 *   T' (1 - a') = T (1 - a),   a = v / T, the layer's coverage; a' of the part that stays
 *
 * Of a layer that covers little the share k = keep stays. If that held for all, one that covers all
 * would end at any gap, however small, and go on without one. Hence, with the gap s in bands,
 *
 *   dT / ds = -4 T a / (4 - 3 a):   T' = T h^4,  a' = k a / h,  h^4 - k a h^3 - (1 - a) = 0
 *
 * Of a layer that covers all, k^4 of the light stays. With k = exp(-s), several small gaps do what
 * one large gap does, and splats of hardly any weight within a gap change nothing. Where v is one
 * of Frechet's bounds, the sums that stay are such that they are seen as much as without the leak.
 * @param keep [0, 1)
 */
template <class Real>
SURFELSPLATTING_INLINE LayerLeak<Real> Leak(
  const Real& through, const LayerCoverage<Real>& layer, const Real& keep)
{
  const Real all = VisibleShare(through, layer);
  const Real left = 1.0f - Smaller(all / Larger(through, Real(1e-30f)), Real(1.0f));
  const Real stays = keep * (1.0f - left);
  const Real h = LeakRoot(stays, left);
  const Real rest = Smaller(h * h * (h * h), Real(1.0f));
  const Real weight = Smaller(keep / Larger(h, Real(1e-30f)), Real(1.0f));
  // Opacities are divided by max(1, Filled) when they are seen.
  const Real stay = weight * Larger(weight * layer.Filled, Real(1.0f));
  const Real perSeen = 1.0f / Larger(layer.Seen, Real(1e-30f));
  const Real scale = 1.0f / Larger(layer.Filled, Real(1.0f)); // VisibleShare has divided by it
  const Real seen = stay * rest * (all * perSeen);
  return { (1.0f - rest) * through * perSeen, rest * through, seen, weight, stay * scale };
}

/// Leak() with keep = 0: the layer ends.
template <class Real>
SURFELSPLATTING_INLINE LayerLeak<Real> End(const Real& through, const LayerCoverage<Real>& layer)
{
  const Real all = VisibleShare(through, layer);
  return { all / Larger(layer.Seen, Real(1e-30f)), Larger(through - all, Real(0.0f)), Real(0.0f),
    Real(0.0f), Real(0.0f) };
}
}
