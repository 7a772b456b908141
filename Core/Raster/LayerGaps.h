// SPDX-License-Identifier: BSD-3-Clause
/**
 * The gaps between the open layers of a block and what begins behind them, and how much of the
 * layers stays open over these (Core/Lens/LayerLeaks.h).
 *
 * Included by the translation units of the raster's targets (RasterTarget.h), whose own this code
 * is.
 */
#pragma once

#include "Core/Lens/LayerLeaks.h"
#include "Core/Raster/RasterTarget.h"
#include "Core/Simd/Lanes.h"

namespace SurfelSplatting
{
namespace
{
/// A layer ends, instead of leaking, at a gap of so many bands: less than a thousandth would stay.
constexpr float LargestGap = 7.0f;

/// Wider gaps count as one of so many bands: with thin bands, a fragment of hardly any weight would
/// end layers. One that makes its layer leak over a ninth of such a gap ends it, which takes less
/// time than a leak.
constexpr float WidestGap = 64.0f;

/// Layers do not leak over gaps of fewer bands, which stay open: every leak takes time. (With 1/64,
/// a lion at 12 px leaks 12 % more often; with 1/16, the corner of TestCoarseGrid.cxx loses 0.049
/// instead of 0.031 of its coverage.)
constexpr float LeastGap = 1.0f / 32.0f;

/// The z-range of a splat or tent, world units along the view direction.
struct ZRange
{
  float Near, Far;
};

/// How far open layers reach, without their gaps.
struct LayerExtent
{
  Lanes Far;    ///< of their z-ranges
  Lanes Weight; ///< sum w
  Lanes Depth;  ///< sum w z, as if there were no gaps in the layers
};

/// @param depth sum w z
SURFELSPLATTING_INLINE LayerExtent ExtentOf(
  const OpenLayers& open, const Lanes& far, const Lanes& weight, const Lanes& depth)
{
  return { far, weight, depth + Lanes::Load(open.Gaps) };
}

/// The share of the radius of an item's blur, in the world, that counts for its band. What covers
/// one another becomes one layer in a wide band, and adds up there; in a narrow one surfaces fall
/// apart. (With 0.3, a dragon blurred by 24 px has 0.5 dB less; with none, it has 0.4 dB more, but
/// blurred corners lose 0.045 of their coverage instead of 0.039.)
constexpr float BlurOfBand = 0.125f;

/// The share of the length of the layer, behind its mean depth, that counts for the band. Two
/// splats of different size that begin at nearly the same depth may swap: with 0.2 for splats,
/// pixels of a lion in motion pop by 3.8 levels instead of 2.7. Tents are means over many splats:
/// with 0.5 for them, a dragon blurred by 24 px has 0.5 dB less, and with none a plane between
/// grids is off by 0.037 of its coverage instead of 0.029.
constexpr float LayerOfBand = 0.5f, LayerOfBandOfTent = 0.2f;

/// What an item says of the band over which layers in front of it leak.
struct ItemBand
{
  float Length;  ///< the item's part, world units, > 0
  float OfLayer; ///< share of the layer's length that counts besides
};

SURFELSPLATTING_INLINE ItemBand BandOf(
  const ZRange& range, bool isTent, const RasterSettings& settings)
{
  const float depth = 0.5f * (range.Near + range.Far);
  const float blur = __builtin_fabsf(depth * settings.BlurPerDepth - settings.LensRadius);
  const float length = BlurOfBand * blur + 0.5f * (range.Far - range.Near);
  return { length > 1e-30f ? length : 1e-30f, isTent ? LayerOfBandOfTent : LayerOfBand };
}

/// How far behind a layer's end an item of the same surface may begin: of a layer that covers
/// little, 1/e stays open there. It is a share of the blur, half the item's z-range, and a share of
/// what of the layer's lies behind its mean depth, without its gaps. (With the item's alone, swaps
/// make pixels of a lion flash by 8 levels.)
SURFELSPLATTING_INLINE Lanes LeakBand(const ItemBand& item, const LayerExtent& layer)
{
  const Lanes behind = layer.Far - layer.Depth / Larger(layer.Weight, 1e-30f);
  return item.Length + item.OfLayer * Larger(behind, 0.0f);
}

/// The gaps between the ends of a block's open layers and an item that begins behind them.
struct LayerGaps
{
  Lanes Bands; ///< the part over which the layers leak, in bands, at most LargestGap
  Lanes Rest;  ///< the other part, over which they stay open, world units
  LaneMask Leaks;
  Lanes PerBand; ///< of what follows the layers, 1 / world units
};

/// @param near of the item @param weight of its fragments
SURFELSPLATTING_INLINE LayerGaps FindGaps(
  float near, const ItemBand& item, const LayerExtent& layer, const Lanes& weight)
{
  const Lanes perBand = 1.0f / LeakBand(item, layer);
  const Lanes behind = Larger(near - layer.Far, 0.0f) * GapOfLayer(layer.Weight);
  const Lanes share = LeakingShare(weight);
  const Lanes bands = Smaller(share * Smaller(behind * perBand, WidestGap), LargestGap);
  const LaneMask leaks = bands > LeastGap;
  return { bands, Select(leaks, behind - share * behind, behind), leaks, perBand };
}

/// The share of layers that stays open over gaps. @param bands at most LargestGap
SURFELSPLATTING_INLINE Lanes KeepOver(const Lanes& bands)
{
  return Select(bands < LargestGap, ExpOfMinus(bands), 0.0f);
}
}
}
