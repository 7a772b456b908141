// SPDX-License-Identifier: BSD-3-Clause
/**
 * Gaussians in space in the A-buffer: each fragment is a layer of its own, composited at once, for
 * a block of 16 pixels at a time.
 *
 * What of the surfels' open layers lies in front of a fragment leaks before it (LayerMerging.h);
 * the rest is then seen behind it.
 *
 * Included by the translation units of the raster's targets (RasterTarget.h), whose own this code
 * is.
 */
#pragma once

#include "Core/Lens/GaussianFootprint.h"
#include "Core/Raster/BlockPixels.h"
#include "Core/Raster/KernelEvaluation.h"
#include "Core/Raster/LayerMerging.h"
#include "Core/Simd/LanePair.h"

namespace SurfelSplatting
{
namespace
{
/// The finished layers of two blocks. What blurred fragments do to one is a long chain of
/// operations; two such chains together take hardly longer.
struct TwoBlocks
{
  using Real = LanePair;
  FinishedLayers &A, &B;

  SURFELSPLATTING_INLINE Real Load(FinishedField f) const
  {
    return { Lanes::Load(this->A.*f), Lanes::Load(this->B.*f) };
  }
  SURFELSPLATTING_INLINE void Store(FinishedField f, const Real& x) const
  {
    x.A.Store(this->A.*f);
    x.B.Store(this->B.*f);
  }
};

/// Opacity of a footprint (Splat.h). @param depth w k
template <class Real>
SURFELSPLATTING_INLINE Real OpacityInSpace(const Real& depth, float absorbs)
{
  const Real held = Smaller(depth, Real(MaxOpacity));
  if (absorbs <= 0.0f)
  {
    return held;
  }
  constexpr float perDepth = -1.44269504f;
  const Real absorbed = 1.0f - TimesPowerOfTwo(1.0f, perDepth * Smaller(depth, Real(80.0f)));
  return absorbs >= 1.0f ? absorbed : held + absorbs * (absorbed - held);
}

/// Fragments of a Gaussian in a block or in two.
template <class Real>
struct GaussianFragments
{
  decltype(Real() < Real()) Inside;
  Real Alpha;
  Real Red, Green, Blue;
  float Depth;          ///< world units along the view direction
  LensMoments<Real> At; ///< lens points and means over the footprint
  ShareOfLens Share;    ///< L
  float MeanShare;      ///< l
  float OfRamp;         ///< weight of the ramp for T; the rest is linear
  float OfEllipse;      ///< weight of an ellipse of opacity 1 for T
};

/// A colour at a fragment, at least 0. @param x,y its change per px
template <bool OnLens, class Real>
SURFELSPLATTING_INLINE Real ColorInSpace(float color, float x, float y, const BlockPixels<Real>& d)
{
  return OnLens ? Larger(color + x * d.X + y * d.Y, Real(0.0f)) : Real(color);
}

/// The lens's share L of a Gaussian. Of a lens that is an ellipse of shape S, all is in points of
/// the unit disc: S^(1/2) L S^(1/2).
SURFELSPLATTING_INLINE ShareOfLens ShareOf(const SplatCopy& splat)
{
  const Splat& s = splat.S;
  const float quarter = splat.Footprint.Quarter, square = 4.0f * quarter * quarter;
  const float xy = square * (s.A * s.K);
  const ShareOfLens share{ square * s.A, xy, xy * s.K + square * s.B };
  const RasterSettings& settings = splat.Settings;
  if (settings.IsLensRound())
  {
    return share;
  }
  const float rootXX = settings.RootXX, rootXY = settings.RootXY, rootYY = settings.RootYY;
  const float a = rootXX * share.XX + rootXY * share.XY, b = rootXX * share.XY + rootXY * share.YY;
  const float c = rootXY * share.XX + rootYY * share.XY, d = rootXY * share.XY + rootYY * share.YY;
  return { a * rootXX + b * rootXY, a * rootXY + b * rootYY, c * rootXY + d * rootYY };
}

/// From the lens points of a disc to those of an ellipse of shape S with its area, as points of the
/// unit disc: S^(1/2) u.
template <class Real>
SURFELSPLATTING_INLINE void MapToDisc(const RasterSettings& settings, Real& x, Real& y)
{
  const float xx = settings.RootXX, xy = settings.RootXY, yy = settings.RootYY;
  const Real along = xx * x + xy * y;
  y = xy * x + yy * y;
  x = along;
}

/// Fragments of a Gaussian in space.
template <bool OnLens, class Real>
SURFELSPLATTING_INLINE GaussianFragments<Real> MakeFragments(
  const SplatCopy& splat, const BlockPixels<Real>& d)
{
  const Splat& s = splat.S;
  const auto inside = d.Q < s.DepthX;
  const Real depth = s.Weight * EvaluateInSpace<Real>(s.Shape, d.Q, s.DepthX);
  const SpaceFootprint& lens = splat.Footprint;
  const float quarter = lens.Quarter;
  Real x = (quarter * s.A) * (d.X + s.K * d.Y);
  Real y = s.K * x + (quarter * s.B) * d.Y;
  if (!splat.Settings.IsLensRound())
  {
    MapToDisc(splat.Settings, x, y);
  }
  const ShareOfLens share = ShareOf(splat);
  const float mean = share.Mean();
  return { inside, Select(inside, OpacityInSpace<Real>(depth, s.Opacity), Real(0.0f)),
    ColorInSpace<OnLens>(s.Red, lens.RedX, lens.RedY, d),
    ColorInSpace<OnLens>(s.Green, lens.GreenX, lens.GreenY, d),
    ColorInSpace<OnLens>(s.Blue, lens.BlueX, lens.BlueY, d), s.Near, share.MomentsAt<Real>(x, y),
    share, mean, WeightOfRamp(mean), WeightOfEllipse(mean, lens.Opacity) };
}

/// Lets the layers leak that end in front of a depth.
SURFELSPLATTING_INLINE void LeakBefore(PixelTile& tile, int block,
  const GaussianFragments<Lanes>& f, const RasterSettings& settings,
  const RasterCallbacks& callbacks)
{
  OpenLayers& open = tile.Open[block];
  const Lanes far = Lanes::Load(open.Far), weight = Lanes::Load(open.Weight);
  const LaneMask ended = f.Inside & (weight > LeastLeakingWeight) & (far < f.Depth);
  if (!Any(ended))
  {
    return;
  }
  const Lanes behind = Larger(f.Depth - far, 0.0f) * GapOfLayer(weight);
  // A Gaussian is not of the layer's surface, whose length says nothing here.
  const Lanes gap = behind * (1.0f / BandOf({ f.Depth, f.Depth }, false, settings).Length);
  const Lanes keep = Select(gap < LargestGap, ExpOfMinus(Smaller(gap, LargestGap)), 0.0f);
  LeakLayers<false>(tile, block, ended, keep, settings, callbacks);
  AddTo(open.Gaps, Select(ended, Lanes::Load(open.Weight) * (f.Depth - far), 0.0f));
  Select(ended, f.Depth, far).Store(open.Far);
}

/// What becomes of the open layers behind fragments: of T before, the part after shines on them.
SURFELSPLATTING_INLINE void DimOpenLayers(
  PixelTile& tile, int block, const Lanes& before, const Lanes& after, bool becomesTilted)
{
  OpenLayers& open = tile.Open[block];
  LensLayers& lens = tile.Lens[block];
  float* const colors[] = { open.Red, open.Green, open.Blue };
  if (becomesTilted)
  {
    const Lanes seen = after * Lanes::Load(open.Opacity);
    const Lanes toSeen = seen / Larger(Lanes::Load(open.Weight), 1e-30f);
    seen.Store(lens.Seen);
    (toSeen * Lanes::Load(lens.FillX)).Store(lens.SeenX);
    (toSeen * Lanes::Load(lens.FillY)).Store(lens.SeenY);
  }
  const Lanes rest = becomesTilted ? after : after / Larger(before, 1e-30f);
  for (float* color : colors)
  {
    MultiplyBy(color, rest);
  }
  if (!becomesTilted)
  {
    MultiplyBy(lens.Seen, rest);
    MultiplyBy(lens.SeenX, rest);
    MultiplyBy(lens.SeenY, rest);
  }
}

/// Takes what the fragments hide from the moments of T.
/// @param hides of T
/// @return the squared length of the first moment
template <class Blocks, class Real = typename Blocks::Real>
SURFELSPLATTING_INLINE Real HideMoments(const Blocks& done, const GaussianFragments<Real>& f,
  const Real& hides, const Real& before, const Real& after)
{
  const Real perBefore = 1.0f / Larger(before, Real(1e-6f)); // before hides is known
  const HiddenPart<Real> part{ hides, Smaller(hides * (LargestSlope * perBefore), f.Alpha),
    Smaller(hides * ((1.0f - f.MeanShare) * perBefore), Real(1.0f)), after * perBefore };
  return StoreMoments(done,
    MomentsBehind<Real>(MomentsOf(done), f.Share, f.At, part, SharpnessOfBorder(f.OfEllipse)),
    after);
}

/// Takes what the fragments hide from the moments of T and from the open layers.
/// @param hides of T
template <bool OnLens>
SURFELSPLATTING_INLINE void HideThroughLens(PixelTile& tile, int block,
  const GaussianFragments<Lanes>& f, const Lanes& hides, const Lanes& before, bool hasLayers)
{
  const bool wasTilted = IsTilted(tile, block);
  if (!OnLens && !wasTilted)
  {
    return;
  }
  const Lanes after = Lanes::Load(tile.Finished[block].Transmittance);
  const OneBlock done{ tile.Finished[block] };
  const bool isLong = AreLong(HideMoments(done, f, hides, before, after));
  const bool becomesTilted = isLong && !wasTilted;
  if (becomesTilted)
  {
    tile.Tilted |= std::uint64_t{ 1 } << block;
  }
  if (becomesTilted || (wasTilted && hasLayers))
  {
    DimOpenLayers(tile, block, before, after, becomesTilted);
  }
}

/// What is seen of T at the lens points of a Gaussian's fragments, in tilted blocks.
template <class Blocks, class Real = typename Blocks::Real>
SURFELSPLATTING_INLINE Real SeenOnLens(
  const Blocks& done, const GaussianFragments<Real>& f, const Real& before)
{
  const LensMoments<Real> t = MomentsOf(done);
  const Real dot = t.X * f.At.X + t.Y * f.At.Y;
  const Real line = before + 4.0f * dot;
  if (f.OfRamp == 0.0f)
  {
    return line;
  }
  Real x, y;
  f.Share.Rest(t, x, y);
  const RampMoments<Real> moments{ t.X * t.X + t.Y * t.Y, dot, t.X * x + t.Y * y };
  const Real ramp =
    line + f.OfRamp * (ReconstructRamp<Real>(before, moments, BlurOfRamp(f.MeanShare)) - line);
  if (f.OfEllipse == 0.0f)
  {
    return ramp;
  }
  const EllipseOnLens<Real> ellipse = ReconstructEllipse(before, t, f.At.X, f.At.Y);
  return SeenBetween<Real>(ramp, ellipse.Seen, f.OfEllipse * ellipse.Opacity);
}

/// What a Gaussian's fragments hide of T in tilted blocks, within Frechet's bounds (VisibleShare).
template <class Blocks, class Real = typename Blocks::Real>
SURFELSPLATTING_INLINE Real HiddenOnLens(
  const Blocks& done, const GaussianFragments<Real>& f, const Real& before)
{
  const Real hides = f.Alpha * SeenOnLens(done, f, before);
  const Real least = Larger(before + f.Alpha - 1.0f, Real(0.0f));
  return Smaller(Larger(hides, least), Smaller(before, f.Alpha));
}

/**
 * Adds the doubt about the fragments of a Gaussian. One hides too little to be in doubt, but many
 * do: how much of what the lens blurs hides the same share of the lens is not known, so that the
 * interval's width is the lens's share of what is hidden so far, at most T. The contrast is to the
 * mean of what is in front.
 * @param hides of T
 */
SURFELSPLATTING_INLINE void AddGaussianDoubt(DoubtedLayers& doubted,
  const GaussianFragments<Lanes>& f, const Lanes& hides, const Lanes& before)
{
  const Lanes after = Larger(before - hides, 0.0f), width = Lanes::Load(doubted.Width);
  const Lanes doubt = width * hides / Larger(before, 1e-6f);
  const Lanes share = hides / Larger(1.0f - after, 1e-6f);
  const Lanes* const colors[] = { &f.Red, &f.Green, &f.Blue };
  float* means[] = { doubted.Red, doubted.Green, doubted.Blue };
  float* drifts[] = { doubted.RedDrift, doubted.GreenDrift, doubted.BlueDrift };
  for (int c = 0; c < 3; ++c)
  {
    const Lanes contrast = *colors[c] - Lanes::Load(means[c]);
    AddTo(drifts[c], doubt * contrast);
    AddTo(means[c], share * contrast);
  }
  Smaller(width + f.MeanShare * hides, after).Store(doubted.Width);
  const Lanes variation = VariationBehind<Lanes>(
    Lanes::Load(doubted.Variation), before, after, Lanes(1.0f - f.MeanShare));
  Smaller(variation, 2.0f * after * (1.0f - after)).Store(doubted.Variation);
}

/// Composites the fragments of a Gaussian.
template <bool OnLens>
SURFELSPLATTING_INLINE void CompositeGaussian(PixelTile& tile, int block, const Splat& s,
  const GaussianFragments<Lanes>& f, const RasterSettings& settings,
  const RasterCallbacks& callbacks)
{
  FinishedLayers& done = tile.Finished[block];
  const Lanes before = Lanes::Load(done.Transmittance);
  const LaneMask visible = f.Inside & (Lanes::Load(done.OccluderDepth) >= f.Depth);
  const bool tilted = OnLens && IsTilted(tile, block);
  const Lanes hides =
    Select(visible, tilted ? HiddenOnLens(OneBlock{ done }, f, before) : before * f.Alpha, 0.0f);
  const Lanes after = Larger(before - hides, 0.0f);
  const Lanes red = hides * f.Red, green = hides * f.Green, blue = hides * f.Blue;
  AddTo(done.Red, red);
  AddTo(done.Green, green);
  AddTo(done.Blue, blue);
  StoreThrough(tile, block, before, after, f.Depth);
  if (settings.Doubts)
  {
    AddGaussianDoubt(tile.Doubted[block], f, hides, before);
  }
  if (callbacks.Leaked)
  {
    LeakedLayers leaked;
    red.Store(leaked.Red);
    green.Store(leaked.Green);
    blue.Store(leaked.Blue);
    hides.Store(leaked.Alpha);
    Lanes(f.Depth).Store(leaked.Depth);
    f.Alpha.Store(leaked.Coverage);
    Lanes(s.Far - s.Near).Store(leaked.Spread);
    callbacks.Leaked(callbacks.User, tile, block, visible.ToBits(), leaked);
    AddTo(done.Fragments, Select(f.Inside, 1.0f, 0.0f));
  }
  if (settings.LensRadius > 0.0f)
  {
    HideThroughLens<OnLens>(tile, block, f, hides, before, settings.HasLayers);
  }
}

/// Adds a Gaussian in space to a block.
template <bool OnLens>
SURFELSPLATTING_INLINE void AddGaussianToBlock(PixelTile& tile, int block, const SplatCopy& splat,
  const BlockPixels<Lanes>& d, const RasterCallbacks& callbacks)
{
  const GaussianFragments<Lanes> fragments = MakeFragments<OnLens>(splat, d);
  if (splat.Settings.HasLayers)
  {
    LeakBefore(tile, block, fragments, splat.Settings, callbacks);
  }
  CompositeGaussian<OnLens>(tile, block, splat.S, fragments, splat.Settings, callbacks);
}

/// Adds a Gaussian to one or two tilted blocks that have nothing but finished layers.
template <class Blocks, class Real = typename Blocks::Real>
SURFELSPLATTING_INLINE void AddGaussianToFinished(
  const Blocks& done, const SplatCopy& splat, const BlockPixels<Real>& d)
{
  const GaussianFragments<Real> f = MakeFragments<true>(splat, d);
  const Real before = done.Load(&FinishedLayers::Transmittance);
  const auto visible = f.Inside & (done.Load(&FinishedLayers::OccluderDepth) >= f.Depth);
  const Real hides = Select(visible, HiddenOnLens(done, f, before), Real(0.0f));
  const Real after = before - hides; // never less than 0
  const Splat& s = splat.S;
  const SpaceFootprint& lens = splat.Footprint;
  const auto add = [&](FinishedField field, float color, float x, float y) {
    done.Store(field, done.Load(field) + hides * ColorInSpace<true>(color, x, y, d));
  };
  add(&FinishedLayers::Red, s.Red, lens.RedX, lens.RedY);
  add(&FinishedLayers::Green, s.Green, lens.GreenX, lens.GreenY);
  add(&FinishedLayers::Blue, s.Blue, lens.BlueX, lens.BlueY);
  const auto median = (before > 0.5f) & (after <= 0.5f);
  done.Store(
    &FinishedLayers::Depth, Select(median, Real(f.Depth), done.Load(&FinishedLayers::Depth)));
  done.Store(&FinishedLayers::Transmittance, after);
  HideMoments(done, f, hides, before, after);
}
}
}
