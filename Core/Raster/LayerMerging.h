// SPDX-License-Identifier: BSD-3-Clause
/**
 * Where the layers of the A-buffer merge (the rule is in ABuffer.h, its formulas in
 * LayerLeaks.h), for a block of 16 pixels at a time: a splat joins the open layer of a pixel,
 * and open layers are composited front to back.
 *
 * Included by the translation units of the raster's targets (RasterTarget.h), whose own this code
 * is.
 */
#pragma once

#include "Core/Raster/CellTents.h"
#include "Core/Raster/FinishedMoments.h"
#include "Core/Raster/LayerGaps.h"
#include "Core/Raster/RasterTarget.h"
#include "Core/Simd/Lanes.h"

namespace SurfelSplatting
{
namespace
{
constexpr float Infinity = __builtin_inff();

/// By how much the weights of one surface ripple about 1.
template <bool OnLens>
constexpr float Ripple = OnLens ? RippleThroughLens : RippleInFocus;

/// The room in a layer (FindRoom) is measured in this unit, which saves a product.
template <bool OnLens>
constexpr float UnitOfRoom = OnLens ? FillSlope : 1.0f;

/// The room with which a fragment counts wholly.
template <bool OnLens>
constexpr float RoomToFill = Ripple<OnLens> / UnitOfRoom<OnLens>;

/// Adds lanes to sixteen floats.
SURFELSPLATTING_INLINE void AddTo(float* sum, const Lanes& x)
{
  (Lanes::Load(sum) + x).Store(sum);
}

SURFELSPLATTING_INLINE void MultiplyBy(float* sum, const Lanes& x)
{
  (Lanes::Load(sum) * x).Store(sum);
}

/// Puts a number into the chosen ones of sixteen floats.
SURFELSPLATTING_INLINE void Put(float* values, const LaneMask& chosen, float x)
{
  Select(chosen, x, Lanes::Load(values)).Store(values);
}

SURFELSPLATTING_INLINE Lanes LengthOf(const Lanes& x, const Lanes& y)
{
  return SquareRoot(x * x + y * y);
}

/// Points of the lens, in units of its radius.
struct LensPoints
{
  Lanes X, Y;
};

SURFELSPLATTING_INLINE bool IsTilted(const PixelTile& tile, int block)
{
  return (tile.Tilted >> block & 1) != 0;
}

SURFELSPLATTING_INLINE bool HasTents(const PixelTile& tile, int block)
{
  return (tile.WithTents >> block & 1) != 0;
}

SURFELSPLATTING_INLINE void Empty(TentLayers& tents, const LaneMask& chosen)
{
  Put(tents.Farther, chosen, NoFar);
  float* const sums[] = { tents.FartherWeight, tents.Refused, tents.RefusedX, tents.RefusedY };
  for (float* sum : sums)
  {
    Put(sum, chosen, 0.0f);
  }
}

/// A block's TentLayers, which begin here if it has none.
SURFELSPLATTING_INLINE TentLayers& TentsOf(PixelTile& tile, int block)
{
  TentLayers& tents = tile.Tents[block];
  if (!HasTents(tile, block))
  {
    tile.WithTents |= std::uint64_t{ 1 } << block;
    Empty(tents, AllLanes());
  }
  return tents;
}

/// Takes what leaks from the moments of T; true if the first one is so long that it matters.
/// @param x,y first moment of what leaks @param before,after T
SURFELSPLATTING_INLINE bool HideLeak(
  FinishedLayers& done, const Lanes& x, const Lanes& y, const Lanes& before, const Lanes& after)
{
  const OneBlock block{ done };
  const LensMoments<Lanes> t = MomentsOf(block),
                           h = MomentsOfSegment(Larger(before - after, 0.0f), x, y);
  return AreLong(StoreMoments(block,
    { t.X - h.X, t.Y - h.Y, t.Rim - h.Rim, t.Across - h.Across, t.Diagonal - h.Diagonal }, after));
}

/// The lens's side of a leak. Once the moments of T matter, the block becomes tilted: sums are
/// weighted with T from then on.
/// @param before T in front of the layer
/// @return whether it has become so
SURFELSPLATTING_INLINE bool LeakThroughLens(
  PixelTile& tile, int block, const LayerLeak<Lanes>& leak, const Lanes& seen, const Lanes& before)
{
  LensLayers& lens = tile.Lens[block];
  FinishedLayers& done = tile.Finished[block];
  if (IsTilted(tile, block))
  {
    HideLeak(done, leak.Share * Lanes::Load(lens.SeenX), leak.Share * Lanes::Load(lens.SeenY),
      before, leak.Through);
    return false;
  }
  const Lanes toSeen = seen / Larger(Lanes::Load(tile.Open[block].Weight), 1e-30f);
  const LensPoints moment{ toSeen * Lanes::Load(lens.FillX), toSeen * Lanes::Load(lens.FillY) };
  if (!HideLeak(done, leak.Share * moment.X, leak.Share * moment.Y, before, leak.Through))
  {
    return false;
  }
  tile.Tilted |= std::uint64_t{ 1 } << block;
  seen.Store(lens.Seen);
  moment.X.Store(lens.SeenX);
  moment.Y.Store(lens.SeenY);
  return true;
}

/// Adds the share of the open layers to the colours of the finished ones.
SURFELSPLATTING_INLINE void CompositeColors(PixelTile& tile, int block, const Lanes& share,
  const Lanes& seen, float largestColor, LeakedLayers& leaked)
{
  const OpenLayers& open = tile.Open[block];
  FinishedLayers& done = tile.Finished[block];
  const Lanes brightest = largestColor * seen;
  const float* from[] = { open.Red, open.Green, open.Blue };
  float* to[] = { done.Red, done.Green, done.Blue };
  float* part[] = { leaked.Red, leaked.Green, leaked.Blue };
  // Sums of blocks that are not tilted are not weighted with T.
  const Lanes visible = IsTilted(tile, block) ? Lanes(1.0f) : Lanes::Load(done.Transmittance);
  for (int c = 0; c < 3; ++c)
  {
    const Lanes color = share * Smaller(Larger(visible * Lanes::Load(from[c]), 0.0f), brightest);
    color.Store(part[c]);
    AddTo(to[c], color);
  }
}

/// Pixels whose finished layers let something through. At others, layers need not leak.
SURFELSPLATTING_INLINE LaneMask SeenPixels(const PixelTile& tile, int block)
{
  return Lanes::Load(tile.Finished[block].Transmittance) > MinTransmittance;
}

SURFELSPLATTING_INLINE void MarkOpaque(PixelTile& tile, int block)
{
  tile.Opaque |= static_cast<std::uint64_t>(Any(SeenPixels(tile, block)) ? 0 : 1) << block;
}

/// Stores T behind fragments, and their depth where T passes one half.
/// @param before T in front of them @param after T behind them
SURFELSPLATTING_INLINE void StoreThrough(
  PixelTile& tile, int block, const Lanes& before, const Lanes& after, const Lanes& depth)
{
  FinishedLayers& done = tile.Finished[block];
  const LaneMask median = (before > 0.5f) & (after <= 0.5f);
  Select(median, depth, Lanes::Load(done.Depth)).Store(done.Depth);
  after.Store(done.Transmittance);
  MarkOpaque(tile, block);
}

/// Stores the transmittance behind the layers.
SURFELSPLATTING_INLINE void StoreTransmittance(
  PixelTile& tile, int block, const Lanes& after, bool wantsDepth, LeakedLayers& leaked)
{
  const OpenLayers& open = tile.Open[block];
  FinishedLayers& done = tile.Finished[block];
  const Lanes before = Lanes::Load(done.Transmittance);
  const LaneMask median = (before > 0.5f) & (after <= 0.5f);
  if (wantsDepth || Any(median))
  {
    const Lanes depth = Lanes::Load(open.Depth) / Larger(Lanes::Load(open.Weight), 1e-30f);
    depth.Store(leaked.Depth);
    Select(median, depth, Lanes::Load(done.Depth)).Store(done.Depth);
  }
  after.Store(done.Transmittance);
  MarkOpaque(tile, block);
}

/// The open layers' weights over the largest share of the lens that they can cover. What tents had
/// no room for says as well where the layer is: a wall behind half a leaf covers all of the lens,
/// though it only adds to the other half.
SURFELSPLATTING_INLINE Lanes FilledShare(const PixelTile& tile, int block)
{
  const LensLayers& lens = tile.Lens[block];
  const Lanes weight = Lanes::Load(tile.Open[block].Weight);
  Lanes offered = weight, x = Lanes::Load(lens.FillX), y = Lanes::Load(lens.FillY);
  if (HasTents(tile, block))
  {
    const TentLayers& tents = tile.Tents[block];
    offered += Lanes::Load(tents.Refused);
    x += Lanes::Load(tents.RefusedX);
    y += Lanes::Load(tents.RefusedY);
  }
  const Lanes squared = x * x + y * y;
  // No limit is met where weight <= 1 - CoverLossPerCentroid moment / weight.
  const Lanes free = Larger(offered - offered * offered, 0.0f);
  constexpr float loss = CoverLossPerCentroid * CoverLossPerCentroid;
  if (!Any(loss * squared > free * free))
  {
    return weight;
  }
  return weight / LargestCoverOfLayer(offered, SquareRoot(squared));
}

/// The open layers' coverage, which decides how much of them is seen.
SURFELSPLATTING_INLINE LayerCoverage<Lanes> CoverageOf(
  const PixelTile& tile, int block, bool hasLens)
{
  const OpenLayers& open = tile.Open[block];
  const Lanes weight = Lanes::Load(open.Weight), opacity = Lanes::Load(open.Opacity);
  return { hasLens ? FilledShare(tile, block) : weight, opacity,
    IsTilted(tile, block) ? Lanes::Load(tile.Lens[block].Seen)
                          : Lanes::Load(tile.Finished[block].Transmittance) * opacity };
}

/// What becomes of the sums of layers after a leak.
struct KeptShares
{
  Lanes Weight, Opacity; ///< of what is not weighted with T
  Lanes Seen;            ///< of what is weighted with T
  Lanes Colors;
};

SURFELSPLATTING_INLINE void Keep(PixelTile& tile, int block, const KeptShares& keep, bool hasLens)
{
  OpenLayers& open = tile.Open[block];
  LensLayers& lens = tile.Lens[block];
  if (hasLens)
  {
    const Lanes length = LengthOf(Lanes::Load(lens.FillX), Lanes::Load(lens.FillY));
    const Lanes shrink =
      Select(keep.Weight < 1.0f, ShrinkMoment(Lanes::Load(open.Weight), length, keep.Weight), 1.0f);
    MultiplyBy(lens.FillX, shrink);
    MultiplyBy(lens.FillY, shrink);
  }
  if (HasTents(tile, block))
  {
    TentLayers& tents = tile.Tents[block];
    MultiplyBy(tents.FartherWeight, keep.Weight);
    MultiplyBy(tents.Refused, keep.Weight);
    MultiplyBy(tents.RefusedX, keep.Weight);
    MultiplyBy(tents.RefusedY, keep.Weight);
  }
  MultiplyBy(open.Weight, keep.Weight);
  MultiplyBy(open.Depth, keep.Weight);
  MultiplyBy(open.Gaps, keep.Weight);
  MultiplyBy(open.Opacity, keep.Opacity);
  MultiplyBy(open.Red, keep.Colors);
  MultiplyBy(open.Green, keep.Colors);
  MultiplyBy(open.Blue, keep.Colors);
  if (IsTilted(tile, block))
  {
    MultiplyBy(lens.Seen, keep.Seen);
    MultiplyBy(lens.SeenX, keep.Seen);
    MultiplyBy(lens.SeenY, keep.Seen);
  }
}

/// Empties the chosen open layers.
SURFELSPLATTING_INLINE void Empty(PixelTile& tile, int block, const LaneMask& chosen, bool hasLens)
{
  OpenLayers& open = tile.Open[block];
  LensLayers& lens = tile.Lens[block];
  float* const sums[] = { open.Weight, open.Opacity, open.Depth, open.Gaps, open.Red, open.Green,
    open.Blue };
  for (float* sum : sums)
  {
    Put(sum, chosen, 0.0f);
  }
  Put(open.Far, chosen, NoFar);
  if (hasLens)
  {
    Put(lens.FillX, chosen, 0.0f);
    Put(lens.FillY, chosen, 0.0f);
  }
  if (HasTents(tile, block))
  {
    Empty(tile.Tents[block], chosen);
  }
  if (IsTilted(tile, block))
  {
    Put(lens.Seen, chosen, 0.0f);
    Put(lens.SeenX, chosen, 0.0f);
    Put(lens.SeenY, chosen, 0.0f);
  }
}

/// Share of the lens that layers cover, whatever their opacity. @param weight sum w
SURFELSPLATTING_INLINE Lanes CoverOf(const LayerCoverage<Lanes>& layer, const Lanes& weight)
{
  return Smaller(weight / Larger(layer.Filled, 1.0f), 1.0f);
}

/// What decides the doubt about layers of which a part is composited.
struct DoubtedLeak
{
  LaneMask Chosen;
  Lanes Weight; ///< of the layers
  Lanes Kept;   ///< share of it that stays open
  Lanes Before; ///< T in front of them
};

/// Share of the lens that layers cover, and how far the interval of their visible share is open.
struct DoubtedShare
{
  Lanes Cover, Interval;
};

/// What is left of a layer after a leak: this share of its interval is in doubt. With 0, seven
/// cells take 0.8 times as long, but lose 0.6 dB on a bunny at 36 px; with 1, they take 1.2 times
/// as long.
constexpr float DoubtAboutRest = 0.1f;

/// Cover and interval of layers. What is left of an earlier leak counts as the whole did then.
SURFELSPLATTING_INLINE DoubtedShare ShareInDoubt(
  DoubtedLayers& doubted, const LayerCoverage<Lanes>& layer, const DoubtedLeak& leak)
{
  const Lanes old = Lanes::Load(doubted.LeftWeight);
  const Lanes left = Smaller(old / Larger(leak.Weight, 1e-30f), 1.0f);
  const auto mix = [&](float* whole, const Lanes& share, const Lanes& now) {
    const Lanes before = Lanes::Load(whole), mixed = now + share * (before - now);
    Select(leak.Chosen, mixed, before).Store(whole);
    return mixed;
  };
  Select(leak.Chosen, leak.Kept * leak.Weight, old).Store(doubted.LeftWeight);
  const Lanes interval = ShareInterval(leak.Before, layer);
  return { mix(doubted.LeftCover, left, CoverOf(layer, leak.Weight)),
    mix(doubted.LeftInterval, (1.0f - DoubtAboutRest) * left,
      Smaller(interval, Lanes::Load(doubted.Variation))) };
}

/// Adds the doubt about layers of which a part is composited: how far the interval of the visible
/// share of the layers before is open, times the contrast to what is seen instead.
/// @param share of the layers
SURFELSPLATTING_INLINE void AddDoubt(DoubtedLayers& doubted, const DoubtedShare& share,
  const Lanes& layerSeen, const Lanes& before, const LayerLeak<Lanes>& leak,
  const LeakedLayers& leaked)
{
  const Lanes variation = Lanes::Load(doubted.Variation);
  VariationBehind(variation, before, leak.Through, share.Cover).Store(doubted.Variation);
  const Lanes seen = leak.Share * layerSeen;
  constexpr float least = 1.0f / 256.0f; // less is seen of it than a picture of eight bits shows
  const LaneMask counts = seen > least;
  if (!Any(counts))
  {
    return;
  }
  const float* from[] = { leaked.Red, leaked.Green, leaked.Blue };
  float* last[] = { doubted.Red, doubted.Green, doubted.Blue };
  const Lanes perSeen = 1.0f / Larger(seen, least);
  Lanes contrast = 0.0f;
  for (int c = 0; c < 3; ++c)
  {
    const Lanes color = perSeen * Lanes::Load(from[c]), old = Lanes::Load(last[c]);
    contrast = Larger(contrast, Larger(color - old, old - color));
    Select(counts, color, old).Store(last[c]);
  }
  const Lanes part = Smaller(seen / Larger(before, 1e-6f), 1.0f),
              width = Lanes::Load(doubted.Width);
  const Lanes doubt = Lanes::Load(doubted.Doubt);
  Select(counts, doubt + width * contrast * part, doubt).Store(doubted.Doubt);
  Select(counts, Larger(share.Interval, width * (1.0f - part)), width).Store(doubted.Width);
}

/// Composites the open layers of the chosen pixels behind the finished ones, but for the share that
/// stays open.
/// @param keep unused if Ends: nothing stays
template <bool Ends>
void LeakLayers(PixelTile& tile, int block, const LaneMask& chosen, const Lanes& keep,
  const RasterSettings& settings, const RasterCallbacks& callbacks)
{
  const OpenLayers& open = tile.Open[block];
  const FinishedLayers& done = tile.Finished[block];
  const bool hasLens = settings.LensRadius > 0.0f;
  const LayerCoverage<Lanes> layer = CoverageOf(tile, block, hasLens);
  const Lanes before = Lanes::Load(done.Transmittance);
  LayerLeak<Lanes> leak = Ends ? End(before, layer) : Leak(before, layer, keep);
  // A layer behind an opaque prop contributes nothing.
  const LaneMask visible = chosen &
    (Lanes::Load(open.Depth) <=
      Lanes::Load(done.OccluderDepth) * Larger(Lanes::Load(open.Weight), 1e-30f));
  leak.Share = Select(visible, leak.Share, 0.0f);
  leak.Through = Select(visible, leak.Through, before);
  leak.Seen = Select(visible, leak.Seen, leak.Opacity);
  LeakedLayers leaked;
  CompositeColors(tile, block, leak.Share, layer.Seen, settings.LargestColor, leaked);
  (leak.Share * layer.Seen).Store(leaked.Alpha);
  if (settings.Doubts)
  {
    DoubtedLayers& doubted = tile.Doubted[block];
    const DoubtedLeak whole{ chosen, Lanes::Load(open.Weight), Ends ? Lanes(0.0f) : leak.Weight,
      before };
    AddDoubt(doubted, ShareInDoubt(doubted, layer, whole), layer.Seen, before, leak, leaked);
  }
  StoreTransmittance(tile, block, leak.Through, callbacks.Leaked != nullptr, leaked);
  if (callbacks.Leaked)
  {
    const Lanes alpha = leak.Share * layer.Seen;
    const Lanes seen = Larger(before * layer.Opacity, 1e-30f);
    Smaller(alpha * Lanes::Load(open.Weight) / seen, 1.0f).Store(leaked.Coverage);
    Lanes(0.0f).Store(leaked.Spread);
    callbacks.Leaked(callbacks.User, tile, block, visible.ToBits(), leaked);
  }
  const bool tilts = hasLens && LeakThroughLens(tile, block, leak, layer.Seen, before);
  if (Ends && !tilts)
  {
    Empty(tile, block, chosen, hasLens);
    return;
  }
  const Lanes opacity = Select(chosen, leak.Opacity, 1.0f), seen = Select(chosen, leak.Seen, 1.0f);
  // Colours of a block that has just become tilted are not weighted with T yet.
  Keep(tile, block,
    { Select(chosen, leak.Weight, 1.0f), opacity, seen,
      tilts                     ? seen * before
        : IsTilted(tile, block) ? seen
                                : opacity },
    hasLens);
}

/// Composites all open layers of a block and empties them.
SURFELSPLATTING_INLINE void EndLayers(
  PixelTile& tile, int block, const RasterSettings& settings, const RasterCallbacks& callbacks)
{
  OpenLayers& open = tile.Open[block];
  if (Any(Lanes::Load(open.Weight) > 0.0f))
  {
    LeakLayers<true>(tile, block, AllLanes(), 0.0f, settings, callbacks);
  }
  Put(open.Far, AllLanes(), NoFar);
  tile.WithTents &= ~(std::uint64_t{ 1 } << block);
}

/// Layers of a coarse grid whose weight and colours are less, such as tails of kernels between two
/// surfaces, are left out in front of others: a tenth to a fifth of all. From 1/4096 on, seven
/// cells lose 0.3 dB on a bunny at 36 px.
constexpr float LeastTent = 1.0f / 8192.0f;

/// Hands the layers of the chosen pixels of a coarse grid over and empties them.
/// @param least of weight and colours; those of less are only emptied
SURFELSPLATTING_INLINE void CollectLayers(
  PixelTile& tile, int block, const LaneMask& chosen, float least, const RasterCallbacks& callbacks)
{
  OpenLayers& open = tile.Open[block];
  LensLayers& lens = tile.Lens[block];
  CoarseLayers& c = tile.Coarse[block];
  const Lanes color =
    Larger(Larger(Lanes::Load(open.Red), Lanes::Load(open.Green)), Lanes::Load(open.Blue));
  const Lanes weight = Lanes::Load(open.Weight);
  const LaneMask kept = chosen & (weight > 0.0f) & (Larger(weight, color) > least);
  if (Any(kept))
  {
    CellTents tents;
    MakeTents(tile, block, tents);
    callbacks.Closed(callbacks.User, tile, block, kept.ToBits(), tents);
  }
  float* const sums[] = { open.Weight, open.Opacity, open.Depth, open.Red, open.Green, open.Blue,
    lens.FillX, lens.FillY, c.RedX, c.RedY, c.GreenX, c.GreenY, c.BlueX, c.BlueY, c.XX, c.XY, c.YY,
    c.HalfRange, c.SquaredDepth, c.CubedDepth, c.FourthDepth, c.PointDepthX, c.PointDepthY,
    c.OpacityDepth, c.RedDepth, c.GreenDepth, c.BlueDepth };
  for (float* sum : sums)
  {
    Put(sum, chosen, 0.0f);
  }
  Put(open.Far, chosen, NoFar);
  Put(c.Near, chosen, Infinity);
}

/// Lets the chosen layers leak.
SURFELSPLATTING_INLINE void LeakOver(PixelTile& tile, int block, const Lanes& keep,
  const LaneMask& chosen, const RasterSettings& settings, const RasterCallbacks& callbacks)
{
  if (!Any(chosen & (keep > 0.0f)))
  {
    LeakLayers<true>(tile, block, chosen, 0.0f, settings, callbacks);
    return;
  }
  LeakLayers<false>(tile, block, chosen, keep, settings, callbacks);
}
}
}
