// SPDX-License-Identifier: BSD-3-Clause
/**
 * The open layers of a block while splats and tents are added to it: they stay in registers. What
 * begins behind them lets them leak; what joins them adds to their sums.
 *
 * Included by the translation units of the raster's targets (RasterTarget.h), whose own this code
 * is.
 */
#pragma once

#include "Core/Raster/LayerMerging.h"

namespace SurfelSplatting
{
namespace
{
/// Fields of RasterTarget.h that are kept in registers while a block is added to: its open layers.
/// Sums of u are doubled, so that 4 f1.u is a product of two of them.
template <bool OnLens, RasterPass Pass>
struct BlockLayers
{
  Lanes Far, Weight, Opacity, Red, Green, Blue, Depth;
  Lanes FillX, FillY;                                           // OnLens only
  Lanes Seen, SeenX, SeenY;                                     // if tilted
  Lanes Near, HalfRange, SquaredDepth, CubedDepth, FourthDepth; // of coarse grids
  bool Tilted;

  SURFELSPLATTING_INLINE void Load(const PixelTile& tile, int block)
  {
    const OpenLayers& open = tile.Open[block];
    const LensLayers& lens = tile.Lens[block];
    if (Pass == RasterPass::Collect)
    {
      const CoarseLayers& coarse = tile.Coarse[block];
      this->Near = Lanes::Load(coarse.Near);
      this->HalfRange = Lanes::Load(coarse.HalfRange);
      this->SquaredDepth = Lanes::Load(coarse.SquaredDepth);
      this->CubedDepth = Lanes::Load(coarse.CubedDepth);
      this->FourthDepth = Lanes::Load(coarse.FourthDepth);
    }
    else
    {
      this->Near = this->HalfRange = 0.0f; // unused
      this->SquaredDepth = this->CubedDepth = this->FourthDepth = 0.0f;
    }
    this->Far = Lanes::Load(open.Far);
    this->Weight = Lanes::Load(open.Weight);
    this->Opacity = Lanes::Load(open.Opacity);
    this->Red = Lanes::Load(open.Red);
    this->Green = Lanes::Load(open.Green);
    this->Blue = Lanes::Load(open.Blue);
    this->Depth = Lanes::Load(open.Depth);
    this->Tilted = OnLens && Pass == RasterPass::Layers && IsTilted(tile, block);
    if (OnLens)
    {
      this->FillX = 2.0f * Lanes::Load(lens.FillX);
      this->FillY = 2.0f * Lanes::Load(lens.FillY);
    }
    if (this->Tilted)
    {
      this->Seen = Lanes::Load(lens.Seen);
      this->SeenX = 2.0f * Lanes::Load(lens.SeenX);
      this->SeenY = 2.0f * Lanes::Load(lens.SeenY);
    }
    else
    {
      this->Seen = this->SeenX = this->SeenY = 0.0f; // unused
    }
  }

  SURFELSPLATTING_INLINE void Store(PixelTile& tile, int block) const
  {
    OpenLayers& open = tile.Open[block];
    LensLayers& lens = tile.Lens[block];
    if (Pass == RasterPass::Collect)
    {
      CoarseLayers& coarse = tile.Coarse[block];
      this->Near.Store(coarse.Near);
      this->HalfRange.Store(coarse.HalfRange);
      this->SquaredDepth.Store(coarse.SquaredDepth);
      this->CubedDepth.Store(coarse.CubedDepth);
      this->FourthDepth.Store(coarse.FourthDepth);
    }
    this->Far.Store(open.Far);
    this->Weight.Store(open.Weight);
    this->Opacity.Store(open.Opacity);
    this->Red.Store(open.Red);
    this->Green.Store(open.Green);
    this->Blue.Store(open.Blue);
    this->Depth.Store(open.Depth);
    if (OnLens)
    {
      (0.5f * this->FillX).Store(lens.FillX);
      (0.5f * this->FillY).Store(lens.FillY);
    }
    if (this->Tilted)
    {
      this->Seen.Store(lens.Seen);
      (0.5f * this->SeenX).Store(lens.SeenX);
      (0.5f * this->SeenY).Store(lens.SeenY);
    }
  }
};

/// A block, the pixels' places in the tile, and what all items of a batch share.
struct BatchBlock
{
  PixelTile& Tile;
  int Block;
  Lanes X, Y; // centres of the pixels, px in the tile
  RasterSettings& Settings;
  const RasterCallbacks& Callbacks;
};

/// Lets layers leak, or hands them over; a call, since few items need it.
/// @param keep share that stays open; unused on coarse grids
template <RasterPass Pass>
__attribute__((noinline)) void LeakBeforeItem(PixelTile& tile, int block, const LaneMask& chosen,
  const Lanes& keep, const RasterSettings& settings, const RasterCallbacks& callbacks)
{
  if (Pass == RasterPass::Collect)
  {
    CollectLayers(tile, block, chosen, LeastTent, callbacks);
    return;
  }
  LeakOver(tile, block, keep, chosen, settings, callbacks);
}

/// So many lengths behind a layer of a coarse grid there is another surface, even if something
/// light reaches from one to the other. A length is that from the layer's nearest splat to the mean
/// end of its splats. With 1.5, a floor that recedes has 0.4 dB less.
constexpr float LargestStep = 2.0f;

/// The open layers that may end in front of an item which begins at a depth; some of them have
/// hardly any weight. Those of a coarse grid end only if the item begins behind their mean end:
/// with tents of all the tails that begin surfaces, a lion at 91 px would take 1.6 times as long.
template <bool OnLens, RasterPass Pass>
SURFELSPLATTING_INLINE LaneMask FindEnded(const BlockLayers<OnLens, Pass>& open, float near)
{
  if (Pass != RasterPass::Collect)
  {
    return open.Far < near;
  }
  const Lanes length = open.Depth + open.HalfRange; // times weights, from the near end on
  return open.Weight * (near - open.Near) - length >
    Select(open.Far < near, 0.0f, LargestStep * length);
}

/// exp(-LeastGap).
constexpr float KeepOfLeastGap = 0.969233f;

/// What stays open of layers over the gaps in front of an item. A share of them may go on farther
/// (LayerEnds).
/// @param near,band of the item @param weight of its fragments @param gaps behind Far
template <bool OnLens, RasterPass Pass>
SURFELSPLATTING_INLINE Lanes KeepOverGaps(const BlockLayers<OnLens, Pass>& open,
  const BatchBlock& at, float near, const ItemBand& band, const Lanes& weight,
  const LayerGaps& gaps)
{
  const Lanes ended = KeepOver(gaps.Bands);
  if (!HasTents(at.Tile, at.Block))
  {
    return ended;
  }
  TentLayers& tents = at.Tile.Tents[at.Block];
  const Lanes ofFarther = Lanes::Load(tents.FartherWeight);
  const LaneMask two = gaps.Leaks & (ofFarther > 0.0f);
  if (!Any(two))
  {
    return ended;
  }
  const Lanes farther = Larger(Lanes::Load(tents.Farther), open.Far);
  const LayerExtent extent = ExtentOf(at.Tile.Open[at.Block], farther, open.Weight, open.Depth);
  const LayerGaps second = FindGaps(near, band, extent, weight);
  const Lanes share =
    Smaller((1.0f / ShareOfJoint) * ofFarther / Larger(open.Weight, 1e-30f), 1.0f);
  const Lanes goesOn = share * KeepOver(second.Bands), keep = (1.0f - share) * ended + goesOn;
  const Lanes left = goesOn / Larger(keep, 1e-30f); // of the part that stays
  const LaneMask leaks = two & (keep < KeepOfLeastGap);
  Select(leaks, left * open.Weight, ofFarther).Store(tents.FartherWeight);
  Select(leaks, Larger(farther, near - second.Rest), Lanes::Load(tents.Farther))
    .Store(tents.Farther);
  return Select(two, keep, ended);
}

/// Layers beside an item, in its block, that end with those that it covers: by WidestGap in front
/// of it. What comes to their pixels later begins hardly nearer, and would end them. So a surface
/// ends about once in a block, not once for each splat of the next one: bars and veils leak 0.3 to
/// 0.4 times as often. (With 16 bands a veil leaks 0.7 times as often, but pixels of a room change
/// by 0.02.)
/// @param weight of its fragments @param perBand LayerGaps
template <bool OnLens, RasterPass Pass>
SURFELSPLATTING_INLINE LaneMask EndBeside(const BlockLayers<OnLens, Pass>& open,
  const BatchBlock& at, float near, const Lanes& weight, const Lanes& perBand)
{
  Lanes last = open.Far;
  if (HasTents(at.Tile, at.Block))
  {
    last = Larger(Lanes::Load(at.Tile.Tents[at.Block].Farther), last);
  }
  const Lanes gap = (near - last) * GapOfLayer(open.Weight) * perBand;
  return (weight <= 0.0f) & (gap > WidestGap) & SeenPixels(at.Tile, at.Block);
}

/// Lets the layers that end in front of an item leak.
/// @param weight of the item's fragments @return where what the item adds to z-ranges begins there:
/// layers stay open over the rest of their gaps
template <bool OnLens, RasterPass Pass>
SURFELSPLATTING_INLINE Lanes LeakEnded(BlockLayers<OnLens, Pass>& open, const BatchBlock& at,
  const BatchItem& item, const ZRange& range, const Lanes& weight, const LaneMask& ended)
{
  constexpr bool collects = Pass == RasterPass::Collect;
  OpenLayers& stored = at.Tile.Open[at.Block];
  const Lanes far = open.Far;
  const ItemBand band = BandOf(range, item.Cell != nullptr, at.Settings);
  const LayerGaps gaps = collects
    ? LayerGaps{ 0.0f, 0.0f, ended, 0.0f }
    : FindGaps(range.Near, band, ExtentOf(stored, far, open.Weight, open.Depth), weight);
  const LaneMask leaks = ended & gaps.Leaks;
  // A fifth to two fifths of such items leave all gaps open: nothing needs to be stored then.
  if (Any(leaks))
  {
    Lanes keep = collects ? Lanes(0.0f) : KeepOverGaps(open, at, range.Near, band, weight, gaps);
    LaneMask chosen = leaks & (keep < KeepOfLeastGap);
    if (Any(chosen))
    {
      if (!collects && at.Settings.ShortCuts)
      {
        const LaneMask beside = EndBeside(open, at, range.Near, weight, gaps.PerBand);
        keep = Select(beside, 0.0f, keep);
        chosen = chosen | beside;
      }
      open.Store(at.Tile, at.Block);
      at.Settings.LargestColor = item.LargestColor;
      LeakBeforeItem<Pass>(at.Tile, at.Block, chosen, keep, at.Settings, at.Callbacks);
      open.Load(at.Tile, at.Block);
    }
  }
  if (collects)
  {
    return range.Near;
  }
  const Lanes begin = Select(open.Weight > LeastLeakingWeight, range.Near - gaps.Rest, range.Near);
  AddTo(stored.Gaps, Select(ended, open.Weight * (begin - far), 0.0f));
  return begin;
}

/// Where an item lies, world units along the view direction.
struct ItemRange
{
  ZRange Range;
  float End; ///< layers that end before this depth may leak
};

/// Prepares the open layers for an item: those that end in front of it leak.
/// @param weight of its fragments, 0 outside @return where what it adds to z-ranges begins
template <bool OnLens, RasterPass Pass>
SURFELSPLATTING_INLINE Lanes BeginItem(BlockLayers<OnLens, Pass>& open, const BatchBlock& at,
  const BatchItem& item, const ItemRange& place, const Lanes& weight, const LaneMask& inside)
{
  const ZRange& range = place.Range;
  Lanes begin = Select(open.Far >= place.End, open.Far, range.Near); // Far may be NoFar
  LaneMask ended = inside & FindEnded(open, place.End);
  if (Pass != RasterPass::Collect && __builtin_expect(Any(ended), 0))
  {
    ended = ended & (open.Weight > LeastLeakingWeight) & SeenPixels(at.Tile, at.Block);
  }
  if (__builtin_expect(Any(ended), 0))
  {
    begin = Select(ended, LeakEnded(open, at, item, range, weight, ended), begin);
  }
  if (__builtin_expect(at.Callbacks.Leaked != nullptr, 0))
  {
    AddTo(at.Tile.Finished[at.Block].Fragments, Select(inside, 1.0f, 0.0f));
  }
  return begin;
}

/// Fragments that layers take.
struct LayerFragments
{
  Lanes Weight; ///< coverage, 0 outside of the support
  float Opacity;
  Lanes Depth;      ///< world units along the view direction; in cells from the layer's near end
  LensPoints Twice; ///< 2 u, where they pass the lens; unused without OnLens
};

/// Adds fragments to the sums of the open layers, but for their colours; returns the weight of
/// these.
/// @param squares function(): SquaresOnLens of the fragments; not called without OnLens
template <bool OnLens, RasterPass Pass, class Function>
SURFELSPLATTING_INLINE Lanes AddCoverage(BlockLayers<OnLens, Pass>& open, const BatchBlock& at,
  const LayerFragments& add, const Function& squares)
{
  const LensPoints& u = add.Twice;
  open.Weight += add.Weight;
  open.Depth += add.Weight * add.Depth;
  Lanes visible = add.Weight * add.Opacity;
  open.Opacity += visible;
  if (OnLens)
  {
    open.FillX += add.Weight * u.X;
    open.FillY += add.Weight * u.Y;
  }
  if (OnLens && open.Tilted)
  {
    const OneBlock done{ at.Tile.Finished[at.Block] };
    const Lanes through = done.Load(&FinishedLayers::Transmittance);
    const LensMoments<Lanes> t = MomentsOf(done);
    const Lanes slope = t.X * u.X + t.Y * u.Y;
    const Lanes bend = QuadraticPart(t, squares());
    visible *= LimitSeen(through + (2.0f * SeenSlope) * slope + bend, through);
    open.Seen += visible;
    open.SeenX += visible * u.X;
    open.SeenY += visible * u.Y;
  }
  return visible;
}

/// What is left up to `full` of a layer where fragments arrive, over UnitOfRoom.
/// @param u 2 u, where they pass the lens; unused without OnLens
template <bool OnLens, RasterPass Pass>
SURFELSPLATTING_INLINE Lanes FindRoom(
  const BlockLayers<OnLens, Pass>& open, const LensPoints& u, float full)
{
  constexpr float perUnit = 1.0f / UnitOfRoom<OnLens>;
  Lanes room = perUnit * full - perUnit * open.Weight;
  if (OnLens)
  {
    room = room - open.FillX * u.X - open.FillY * u.Y;
  }
  return room;
}

/// Colours of a block's fragments, or these times their weights.
struct WeightedColors
{
  Lanes Red, Green, Blue;
};
}
}
