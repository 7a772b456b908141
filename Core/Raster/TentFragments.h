// SPDX-License-Identifier: BSD-3-Clause
/**
 * Adds the fragments of a tent (Tent.h) to the open layers of a block. A layer of a cell may hold
 * two surfaces, and that of the next one of them: where the tents of both meet, the layer has two
 * ends, and not all of a tent has room in it.
 *
 * Included by the translation units of the raster's targets (RasterTarget.h), whose own this code
 * is.
 */
#pragma once

#include "Core/Raster/BlockLayers.h"

namespace SurfelSplatting
{
namespace
{
/// What a tent adds to a layer. It may be as heavy as a layer, so it is added as if in many small
/// parts, of which each counts the square of the room. What neighbouring cells add then hardly
/// depends on their order.
/// @param free what is left up to FullOfTents at the tent's lens point, >= 0
SURFELSPLATTING_INLINE Lanes LimitTent(const Lanes& weight, const Lanes& free)
{
  constexpr float knee = RippleOfTents;
  const Lanes whole = Smaller(weight, Larger(free - knee, 0.0f));
  const Lanes rest = weight - whole, left = Smaller(free, knee);
  return whole + left * left * rest / (knee * knee + left * rest);
}

/// Ends of a layer that are no more than this apart, in bands, are one at their mean: a leak hardly
/// tells them apart. These are a sixth to four fifths of all, and take less time.
constexpr float SmallSpread = 1.0f / 8.0f;

/// Adds the end of a tent to the ends of its layers (LayerEnds).
/// @param begin BeginItem @param small SmallSpread, world units @param weight of the tent, 0
/// outside
template <bool OnLens, RasterPass Pass>
SURFELSPLATTING_INLINE void AddEndOfTent(BlockLayers<OnLens, Pass>& open, const BatchBlock& at,
  const Lanes& begin, float end, float small, const Lanes& weight)
{
  const Lanes farther = HasTents(at.Tile, at.Block)
    ? Larger(Lanes::Load(at.Tile.Tents[at.Block].Farther), begin)
    : begin;
  const LaneMask adds = weight > 0.0f;
  const Lanes spread = Larger(farther, end) - Smaller(begin, end);
  if (!Any(adds & (open.Weight > 0.0f) & (spread > small)))
  {
    const Lanes share = weight / Larger(open.Weight + weight, 1e-30f);
    open.Far = Select(adds, begin + share * (end - begin), open.Far);
    return;
  }
  TentLayers& tents = TentsOf(at.Tile, at.Block);
  const Lanes ofFarther = Lanes::Load(tents.FartherWeight);
  const LayerEnds<Lanes> ends =
    AddEnd({ begin, farther, ofFarther }, open.Weight, Lanes(end), weight);
  open.Far = Select(adds, ends.Far, open.Far);
  Select(adds, ends.Farther, Lanes::Load(tents.Farther)).Store(tents.Farther);
  Select(adds, ends.Weight, ofFarther).Store(tents.FartherWeight);
}

/// Refused weights of less are left out: they would only take time.
constexpr float LeastRefused = 1.0f / 4096.0f;

/// Sheets of one surface that overlap find no room either, so that half counts. With all of it,
/// foliage of such sheets is 0.08 dB worse, and 0.2 % brighter; with none it is like that with
/// half, but crowns have dark rims.
constexpr float ShareOfRefused = 0.5f;

/// Sums up what of a tent its layers have no room for. The layer holds two surfaces, of which the
/// cells of the lens may see either: the contrast of their colours is in doubt (DoubtfulTiles.h).
template <bool OnLens, RasterPass Pass>
SURFELSPLATTING_INLINE void Refuse(const BlockLayers<OnLens, Pass>& open, const BatchBlock& at,
  const Tent& tent, const Lanes& refused)
{
  TentLayers& tents = TentsOf(at.Tile, at.Block);
  const Lanes counts = ShareOfRefused * refused;
  AddTo(tents.Refused, counts);
  AddTo(tents.RefusedX, counts * tent.PointX);
  AddTo(tents.RefusedY, counts * tent.PointY);
  if (!at.Settings.Doubts)
  {
    return;
  }
  const Lanes perSeen = 1.0f / Larger(open.Tilted ? open.Seen : open.Opacity, 1e-6f);
  const auto contrast = [&](float color, const Lanes& sum) {
    const Lanes off = color - perSeen * sum;
    return Larger(off, 0.0f - off);
  };
  const Lanes largest = Larger(contrast(tent.Red, open.Red),
    Larger(contrast(tent.Green, open.Green), contrast(tent.Blue, open.Blue)));
  const Lanes seen =
    (tent.Opacity * refused) * Lanes::Load(at.Tile.Finished[at.Block].Transmittance);
  AddTo(at.Tile.Doubted[at.Block].Doubt, seen * Smaller(largest, 1.0f));
}

/// Adds a tent's fragments, seen through the linear reconstruction of T over all of its lens
/// points; returns the lanes that it covers. (Summing the tents that follow one another in a block,
/// four at a time, before their layer takes them costs as much as it saves.)
template <bool OnLens, RasterPass Pass>
SURFELSPLATTING_INLINE unsigned int AddTentToBlock(
  BlockLayers<OnLens, Pass>& open, const BatchBlock& at, const BatchItem& item)
{
  const Tent& s = *item.Cell;
  const Lanes dx = at.X - item.Place.X, dy = at.Y - item.Place.Y;
  const Lanes share = Larger(1.0f - s.InverseCell * Larger(dx, 0.0f - dx), 0.0f) *
    Larger(1.0f - s.InverseCell * Larger(dy, 0.0f - dy), 0.0f);
  const Lanes weight = s.Weight * share;
  const LaneMask inside = weight > 0.0f;
  const unsigned int bits = inside.ToBits();
  if (bits == 0)
  {
    return 0;
  }
  const ZRange range{ s.Near, s.Far };
  const float band = BandOf(range, true, at.Settings).Length; // the least
  // Over smaller gaps layers stay open (LayerGaps): most tents need no leak then.
  const ItemRange place{ range, s.Near - LeastGap * band };
  const Lanes begin = BeginItem(open, at, item, place, weight, inside);
  AddEndOfTent(open, at, begin, s.Far, SmallSpread * band, weight);
  const LensPoints u{ 2.0f * s.PointX, 2.0f * s.PointY };
  const Lanes added =
    LimitTent(weight, UnitOfRoom<OnLens> * Larger(FindRoom(open, u, FullOfTents), 0.0f));
  const Lanes refused = weight - added;
  if (__builtin_expect(Any(refused > LeastRefused), 0))
  {
    Refuse(open, at, s, refused);
  }
  const Lanes visible = AddCoverage(open, at, { added, s.Opacity, s.Depth, u }, [&] {
    const float xx = s.XX + s.PointX * s.PointX, yy = s.YY + s.PointY * s.PointY;
    const float xy = s.XY + s.PointX * s.PointY;
    return SquaresOnLens<float>{ 4.0f * (xx + yy) - 2.0f, 4.0f * (xx - yy), 8.0f * xy };
  });
  WeightedColors c{ visible * s.Red, visible * s.Green, visible * s.Blue };
  if (OnLens && open.Tilted)
  {
    const FinishedLayers& done = at.Tile.Finished[at.Block];
    const Lanes opaque = (4.0f * SeenSlopeOfTents * s.Opacity) * added;
    const Lanes x = opaque * Lanes::Load(done.ThroughX), y = opaque * Lanes::Load(done.ThroughY);
    c.Red += x * s.RedX + y * s.RedY;
    c.Green += x * s.GreenX + y * s.GreenY;
    c.Blue += x * s.BlueX + y * s.BlueY;
    open.SeenX += 2.0f * (x * s.XX + y * s.XY);
    open.SeenY += 2.0f * (x * s.XY + y * s.YY);
  }
  open.Red += c.Red;
  open.Green += c.Green;
  open.Blue += c.Blue;
  return bits;
}
}
}
