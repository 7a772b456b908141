// SPDX-License-Identifier: BSD-3-Clause
/**
 * Gaussians through the lens over which T is linear: those that are wider than the blur, and all
 * where hardly any light is left. Neither ramp nor ellipse (GaussianLayers.h) is needed, a fragment
 * of opacity a hides the share a of the second moments, and moments hardly get too long: what
 * follows limits them. That takes two thirds of the time.
 *
 * Included by the translation units of the raster's targets (RasterTarget.h), whose own this code
 * is.
 */
#pragma once

#include "Core/Raster/BlocksOfSplats.h"
#include "Core/Raster/GaussianLayers.h"

namespace SurfelSplatting
{
namespace
{
/// Blocks of which no pixel lets more through are dark: what is behind hardly shows.
constexpr float DarkTransmittance = 1.0f / 32.0f;

/// Marks a block that is dark or opaque.
SURFELSPLATTING_INLINE void MarkDark(PixelTile& tile, int block)
{
  const Lanes through = Lanes::Load(tile.Finished[block].Transmittance);
  const std::uint64_t bit = std::uint64_t{ 1 } << block;
  tile.Opaque |= Any(through > MinTransmittance) ? 0 : bit;
  tile.Dark |= Any(through > DarkTransmittance) ? 0 : bit;
}

/// A Gaussian is not divided for fewer dark blocks: that would take the time that it saves.
constexpr int FewDarkBlocks = 3;

/// Those of a Gaussian's blocks in which T is taken for linear.
SURFELSPLATTING_INLINE std::uint64_t BlocksWithLinear(
  const PixelTile& tile, const SplatCopy& splat, std::uint64_t blocks)
{
  if (WeightOfRamp(ShareOf(splat).Mean()) == 0.0f)
  {
    return blocks;
  }
  const std::uint64_t dark = blocks & tile.Dark;
  return dark == blocks || __builtin_popcountll(dark) >= FewDarkBlocks ? dark : 0;
}

/// Composites the fragments of a Gaussian into a block.
/// @param after T behind them
/// @param doubted or null
/// @return the squared length of the first moment of T
SURFELSPLATTING_INLINE Lanes CompositeBroad(
  FinishedLayers& done, const GaussianFragments<Lanes>& f, Lanes& after, DoubtedLayers* doubted)
{
  const Lanes before = Lanes::Load(done.Transmittance);
  const LaneMask visible = f.Inside & (Lanes::Load(done.OccluderDepth) >= f.Depth);
  const Lanes alpha = Select(visible, f.Alpha, 0.0f), keep = 1.0f - alpha;
  const Lanes x = Lanes::Load(done.ThroughX), y = Lanes::Load(done.ThroughY);
  const Lanes seen = alpha * (before + 4.0f * (x * f.At.X + y * f.At.Y));
  // Frechet's bounds: T behind is never less than 0.
  const Lanes least = Larger(before - keep, 0.0f), most = Smaller(before, alpha);
  const Lanes hides = Smaller(Larger(seen, least), most);
  after = before - hides;
  if (doubted)
  {
    AddGaussianDoubt(*doubted, f, hides, before);
  }
  const ShareOfLens& l = f.Share;
  const Lanes ofX = alpha * (l.XX * x + l.XY * y) - hides * f.At.X;
  const Lanes ofY = alpha * (l.XY * x + l.YY * y) - hides * f.At.Y;
  const Lanes tiltX = keep * x + ofX, tiltY = keep * y + ofY;
  tiltX.Store(done.ThroughX);
  tiltY.Store(done.ThroughY);
  MultiplyBy(done.ThroughRim, keep);
  MultiplyBy(done.ThroughAcross, keep);
  MultiplyBy(done.ThroughDiagonal, keep);
  AddTo(done.Red, hides * f.Red);
  AddTo(done.Green, hides * f.Green);
  AddTo(done.Blue, hides * f.Blue);
  const LaneMask median = (before > 0.5f) & (after <= 0.5f);
  Select(median, f.Depth, Lanes::Load(done.Depth)).Store(done.Depth);
  after.Store(done.Transmittance);
  return tiltX * tiltX + tiltY * tiltY;
}

/// Adds a Gaussian to blocks that have nothing but finished layers. A function of its own, so that
/// its constants stay in registers.
__attribute__((noinline)) std::uint64_t AddBroad(
  PixelTile& tile, const SplatCopy& shared, const TilePlace& place, std::uint64_t blocks)
{
  const Splat s = shared.S;
  const SpaceFootprint footprint = shared.Footprint;
  const SplatCopy splat{ s, footprint, shared.Settings };
  const Lanes rampX = Lanes::Load(RampX) + (0.5f - place.X);
  const Lanes rampY = Lanes::Load(RampY) + (0.5f - place.Y);
  std::uint64_t fragments = 0, opaque = 0, dark = 0, tilted = tile.Tilted;
  for (; blocks != 0; blocks &= blocks - 1)
  {
    const int block = __builtin_ctzll(blocks);
    const BlockPixels<Lanes> d = PixelsAt(s, rampX, rampY, block);
    const GaussianFragments<Lanes> f = MakeFragments<true>(splat, d);
    fragments += static_cast<std::uint64_t>(__builtin_popcount(f.Inside.ToBits()));
    Lanes after;
    const Lanes squared = CompositeBroad(
      tile.Finished[block], f, after, splat.Settings.Doubts ? &tile.Doubted[block] : nullptr);
    const std::uint64_t bit = std::uint64_t{ 1 } << block;
    opaque |= Any(after > MinTransmittance) ? 0 : bit;
    dark |= Any(after > DarkTransmittance) ? 0 : bit;
    tilted |= (tilted & bit) == 0 && AreLong(squared) ? bit : 0;
  }
  tile.Opaque |= opaque;
  tile.Dark |= dark;
  tile.Tilted = tilted;
  return fragments;
}
}
}
