// SPDX-License-Identifier: BSD-3-Clause
/**
 * Where the layers of the A-buffer merge (the rule is in ABuffer.h, its formulas in
 * LensVisibility.h), for a block of 16 pixels at a time: a splat joins the open layer of a pixel,
 * and open layers are composited front to back.
 *
 * Included by the translation units of the raster's targets (RasterTarget.h), whose own this code
 * is.
 */
#pragma once

#include "Core/Raster/RasterTarget.h"
#include "Core/Simd/Lanes.h"

namespace SurfelSplatting
{
namespace
{
constexpr float Infinity = __builtin_inff();

/// Where all lanes keep less of a layer than this, it ends.
constexpr float MinKeep = 1.0f / 1024.0f;

/// A block whose first moments of T change what is seen by less than this has none.
constexpr float MinTilt = 1.0f / 512.0f;

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

/// The linear part of a function on the lens, 4 f1.u.
SURFELSPLATTING_INLINE Lanes LinearPart(const float* x, const float* y, const LensPoints& u)
{
  return 4.0f * (Lanes::Load(x) * u.X + Lanes::Load(y) * u.Y);
}

SURFELSPLATTING_INLINE bool IsTilted(const PixelTile& tile, int block)
{
  return (tile.Tilted >> block & 1) != 0;
}

/// The first moment of T after a leak, which can be no longer than that of a segment.
/// @param share of the layer's sums that is composited
SURFELSPLATTING_INLINE LensPoints MomentBehind(const FinishedLayers& done, const Lanes& share,
  const LensPoints& layer, const Lanes& after)
{
  const Lanes x = Lanes::Load(done.ThroughX) - share * layer.X;
  const Lanes y = Lanes::Load(done.ThroughY) - share * layer.Y;
  const Lanes limit = LargestMoment(after);
  const Lanes shorten = Smaller(limit / Larger(LengthOf(x, y), 1e-20f), 1.0f);
  return { x * shorten, y * shorten };
}

/// The lens's side of a leak: makes the block tilted once its moments matter.
/// @param toSeen factor from the layers' sums to those weighted with T
/// @return whether the block has become tilted
SURFELSPLATTING_INLINE bool LeakThroughLens(
  PixelTile& tile, int block, const LayerLeak<Lanes>& leak, const Lanes& seen, const Lanes& after)
{
  LensLayers& lens = tile.Lens[block];
  FinishedLayers& done = tile.Finished[block];
  const bool tilted = IsTilted(tile, block);
  const Lanes weight = Lanes::Load(tile.Open[block].Weight);
  const Lanes toSeen = seen / Larger(weight, 1e-30f);
  const LensPoints moment = tilted
    ? LensPoints{ Lanes::Load(lens.SeenX), Lanes::Load(lens.SeenY) }
    : LensPoints{ toSeen * Lanes::Load(lens.FillX), toSeen * Lanes::Load(lens.FillY) };
  const LensPoints behind = MomentBehind(done, leak.Share, moment, after);
  behind.X.Store(done.ThroughX);
  behind.Y.Store(done.ThroughY);
  if (!tilted && Any(4.0f * LengthOf(behind.X, behind.Y) > MinTilt))
  {
    tile.Tilted |= std::uint64_t{ 1 } << block;
    seen.Store(lens.Seen);
    moment.X.Store(lens.SeenX);
    moment.Y.Store(lens.SeenY);
    return true;
  }
  return false;
}

/// Adds the share of the open layers to the finished ones.
SURFELSPLATTING_INLINE void Composite(PixelTile& tile, int block, const Lanes& share,
  const Lanes& seen, const Lanes& after, LeakedLayers& leaked)
{
  const OpenLayers& open = tile.Open[block];
  FinishedLayers& done = tile.Finished[block];
  const Lanes brightest = leaked.LargestColor * seen;
  const float* from[] = { open.Red, open.Green, open.Blue };
  float* to[] = { done.Red, done.Green, done.Blue };
  float* part[] = { leaked.Red, leaked.Green, leaked.Blue };
  const Lanes before = Lanes::Load(done.Transmittance);
  // Sums of blocks that are not tilted are not weighted with T.
  const Lanes visible = IsTilted(tile, block) ? Lanes(1.0f) : before;
  for (int c = 0; c < 3; ++c)
  {
    const Lanes color =
      share * Smaller(Larger(visible * Lanes::Load(from[c]), 0.0f), brightest);
    color.Store(part[c]);
    AddTo(to[c], color);
  }
  const Lanes depth = Lanes::Load(open.Depth) / Larger(Lanes::Load(open.Weight), 1e-30f);
  depth.Store(leaked.Depth);
  (before - after).Store(leaked.Alpha);
  const LaneMask median = (before > 0.5f) & (after <= 0.5f);
  Select(median, depth, Lanes::Load(done.Depth)).Store(done.Depth);
  after.Store(done.Transmittance);
  if (!Any(after > MinTransmittance))
  {
    tile.Opaque |= std::uint64_t{ 1 } << block;
  }
}

/// The open layers' coverage, to decide how much of them is seen.
SURFELSPLATTING_INLINE LayerCoverage<Lanes> CoverageOf(
  const PixelTile& tile, int block, bool hasLens)
{
  const OpenLayers& open = tile.Open[block];
  const LensLayers& lens = tile.Lens[block];
  LayerCoverage<Lanes> layer;
  layer.Weight = Lanes::Load(open.Weight);
  layer.Opacity = Lanes::Load(open.Opacity);
  layer.Seen = IsTilted(tile, block)
    ? Lanes::Load(lens.Seen)
    : Lanes::Load(tile.Finished[block].Transmittance) * layer.Opacity;
  layer.Largest = 1.0f;
  if (hasLens)
  {
    layer.Largest = LargestCoverOfLayer(
      layer.Weight, LengthOf(Lanes::Load(lens.FillX), Lanes::Load(lens.FillY)));
  }
  return layer;
}

/// Composites the open layers of the chosen pixels behind the finished ones, but for the share that
/// stays open.
void LeakLayers(PixelTile& tile, int block, const LaneMask& chosen, const Lanes& keep,
  const RasterSettings& settings, const RasterCallbacks& callbacks)
{
  OpenLayers& open = tile.Open[block];
  LensLayers& lens = tile.Lens[block];
  const FinishedLayers& done = tile.Finished[block];
  const bool hasLens = settings.LensRadius > 0.0f, wasTilted = IsTilted(tile, block);
  const LayerCoverage<Lanes> layer = CoverageOf(tile, block, hasLens);
  const Lanes before = Lanes::Load(done.Transmittance);
  LayerLeak<Lanes> leak = Leak(before, layer, keep);
  // A layer behind an opaque prop contributes nothing.
  const LaneMask visible = chosen &
    (Lanes::Load(open.Depth) <= Lanes::Load(done.OccluderDepth) * Larger(layer.Weight, 1e-30f));
  leak.Share = Select(visible, leak.Share, 0.0f);
  leak.Through = Select(visible, leak.Through, 1.0f);
  const Lanes after = Larger(leak.Through * before, 0.0f);
  LeakedLayers leaked;
  leaked.LargestColor = settings.LargestColor;
  Composite(tile, block, leak.Share, layer.Seen, after, leaked);
  if (callbacks.Leaked)
  {
    callbacks.Leaked(callbacks.User, tile, block, visible.ToBits(), leaked);
  }
  const bool tilts = hasLens && LeakThroughLens(tile, block, leak, layer.Seen, after);
  const Lanes kept = Select(chosen, keep, 1.0f);
  const Lanes keptSeen = kept * leak.Through;
  const Lanes colors = wasTilted ? keptSeen : tilts ? keptSeen * before : kept;
  float* const coverage[] = { open.Weight, open.Opacity, open.Depth };
  float* const sums[] = { open.Red, open.Green, open.Blue };
  for (int i = 0; i < 3; ++i)
  {
    MultiplyBy(coverage[i], kept);
    MultiplyBy(sums[i], colors);
  }
  if (hasLens)
  {
    MultiplyBy(lens.FillX, kept);
    MultiplyBy(lens.FillY, kept);
  }
  if (wasTilted || tilts)
  {
    MultiplyBy(lens.Seen, keptSeen);
    MultiplyBy(lens.SeenX, keptSeen);
    MultiplyBy(lens.SeenY, keptSeen);
  }
}

/// Composites all open layers of a block and empties them.
SURFELSPLATTING_INLINE void EndLayers(
  PixelTile& tile, int block, const RasterSettings& settings, const RasterCallbacks& callbacks)
{
  LeakLayers(tile, block, AllLanes(), 0.0f, settings, callbacks);
  Put(tile.Open[block].Far, AllLanes(), -Infinity);
}

/// Hands the layers of the chosen pixels of a coarse grid over and empties them.
SURFELSPLATTING_INLINE void CollectLayers(
  PixelTile& tile, int block, const LaneMask& chosen, const RasterCallbacks& callbacks)
{
  OpenLayers& open = tile.Open[block];
  LensLayers& lens = tile.Lens[block];
  CoarseLayers& c = tile.Coarse[block];
  callbacks.Closed(callbacks.User, tile, block, chosen.ToBits());
  float* const sums[] = { open.Weight, open.Opacity, open.Depth, open.Red, open.Green, open.Blue,
    lens.FillX, lens.FillY, c.RedX, c.RedY, c.GreenX, c.GreenY, c.BlueX, c.BlueY, c.XX, c.XY, c.YY,
    c.HalfRange, c.SquaredDepth };
  for (float* sum : sums)
  {
    Put(sum, chosen, 0.0f);
  }
  Put(c.Near, chosen, Infinity);
  Put(open.Far, chosen, -Infinity);
}

/// The z-range of a splat or tent, world units along the view direction.
struct ZRange
{
  float Near, Far;
};

/// How far behind a layer's end splats of the same surface may begin: what keeps of the layer falls
/// to 1/e there. Through the lens this is the width of the blurred footprint.
SURFELSPLATTING_INLINE float LeakBand(const ZRange& range, const RasterSettings& settings)
{
  const float depth = 0.5f * (range.Near + range.Far);
  const float blur = __builtin_fabsf(depth * settings.BlurPerDepth - settings.LensRadius);
  const float band = blur + (range.Far - range.Near);
  return band > 1e-30f ? band : 1e-30f;
}

/// Prepares the open layers of a block for a splat or tent of this z-range: layers that end in front
/// of it leak, and the z-ranges become longer.
template <RasterPass Pass>
SURFELSPLATTING_INLINE void PrepareLayers(PixelTile& tile, int block, const ZRange& range,
  const LaneMask& inside, const RasterSettings& settings, const RasterCallbacks& callbacks)
{
  OpenLayers& open = tile.Open[block];
  const Lanes far = Lanes::Load(open.Far);
  const LaneMask ended = inside & (Lanes::Load(open.Weight) > 0.0f) & (far < range.Near);
  if (Any(ended))
  {
    if (Pass == RasterPass::Collect)
    {
      CollectLayers(tile, block, ended, callbacks);
    }
    else
    {
      const float perBand = 1.0f / LeakBand(range, settings);
      const Lanes gap = Larger(range.Near - far, 0.0f) * perBand;
      const Lanes keep = ExpOfMinus(Smaller(gap, 80.0f));
      LeakLayers(tile, block, ended, Select(keep > MinKeep, keep, 0.0f), settings, callbacks);
    }
  }
  Select(inside, Larger(Lanes::Load(open.Far), range.Far), Lanes::Load(open.Far)).Store(open.Far);
  if (Pass == RasterPass::Collect)
  {
    float* near = tile.Coarse[block].Near;
    Select(inside, Smaller(Lanes::Load(near), range.Near), Lanes::Load(near)).Store(near);
  }
  else if (callbacks.Leaked)
  {
    AddTo(tile.Finished[block].Fragments, Select(inside, 1.0f, 0.0f));
  }
}

/// A fragment's part in its layer.
struct FragmentCoverage
{
  Lanes Weight; ///< its coverage, 0 outside of its support
  float Opacity;
  Lanes Depth;  ///< world units along the view direction
  float Full;   ///< coverage at which its layer is full (LensVisibility.h)
};

/// What of a fragment's coverage its layer has room for.
struct AddedCoverage
{
  Lanes Weight;
  Lanes Visible; ///< weight of its colour in the layer's sums
};

/// Adds a splat to the sums of open layers, but for its colours.
/// @param u where it passes the lens; unused without OnLens
template <bool OnLens>
SURFELSPLATTING_INLINE AddedCoverage AddCoverage(
  PixelTile& tile, int block, const FragmentCoverage& f, const LensPoints& u)
{
  OpenLayers& open = tile.Open[block];
  LensLayers& lens = tile.Lens[block];
  const Lanes before = Lanes::Load(open.Weight);
  Lanes fill = before;
  if (OnLens)
  {
    fill += LinearPart(lens.FillX, lens.FillY, u);
  }
  const Lanes weight = f.Weight * RoomInLayer(fill, f.Full);
  (before + weight).Store(open.Weight);
  AddTo(open.Depth, weight * f.Depth);
  Lanes visible = weight * f.Opacity;
  AddTo(open.Opacity, visible);
  if (OnLens)
  {
    AddTo(lens.FillX, weight * u.X);
    AddTo(lens.FillY, weight * u.Y);
  }
  if (IsTilted(tile, block))
  {
    const FinishedLayers& done = tile.Finished[block];
    const Lanes through = Lanes::Load(done.Transmittance);
    Lanes seen = through;
    if (OnLens)
    {
      seen = LimitSeen(through + LinearPart(done.ThroughX, done.ThroughY, u), through);
    }
    visible *= seen;
    AddTo(lens.Seen, visible);
    if (OnLens)
    {
      AddTo(lens.SeenX, visible * u.X);
      AddTo(lens.SeenY, visible * u.Y);
    }
  }
  return { weight, visible };
}
}
}
