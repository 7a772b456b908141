// SPDX-License-Identifier: BSD-3-Clause
/**
 * The loops of RasterTarget.h; included once for each instruction set. Splats go block by block
 * through their kernels (KernelEvaluation.h) into the layers of the pixels (LayerMerging.h).
 */
#include "Core/Raster/BatchRaster.h"
#include "Core/Raster/BroadGaussians.h"
#include "Core/Raster/GaussianLayers.h"
#include "Core/Raster/GaussiansInFocus.h"
#include "Core/Raster/RasterTarget.h"
#include "Core/Raster/RunLayers.h"

namespace SurfelSplatting
{
namespace
{
/// Two blocks at a time take twice as many registers, which only AVX-512 has.
constexpr bool AddsPairs = LanesPerPart == LaneCount;

/// Adds a Gaussian in space.
template <bool OnLens>
std::uint64_t AddBlocks(PixelTile& tile, const Splat& splat, const LensFootprint* lens,
  const TilePlace& place, const RasterSettings& shared, const RasterCallbacks& callbacks)
{
  // Copies, because the compiler must assume that writes to the tile can change the originals.
  const Splat s = splat;
  const SpaceFootprint footprint = OnLens ? SpaceFootprintOf(*lens) : SpaceFootprint{};
  const RasterSettings settings = shared;
  const SplatCopy copy{ s, footprint, settings };
  const Lanes rampX = Lanes::Load(RampX) + (0.5f - place.X);
  const Lanes rampY = Lanes::Load(RampY) + (0.5f - place.Y);
  const auto pixels = [&](int block) { return PixelsAt(s, rampX, rampY, block); };
  const bool isFinished =
    OnLens && !settings.HasLayers && !callbacks.Leaked && settings.LensRadius > 0.0f;
  std::uint64_t fragments = 0, tilted = 0;
  std::uint64_t blocks =
    BlocksOfSplat(s, place, s.DepthX, FewPixels) & ~(settings.ShortCuts ? tile.Opaque : 0);
  const std::uint64_t linear = isFinished ? BlocksWithLinear(tile, copy, blocks) : 0;
  if (linear != 0)
  {
    fragments += AddBroad(tile, copy, place, linear);
  }
  const std::uint64_t paired = AddsPairs && isFinished && !settings.Doubts ? tile.Tilted : 0;
  for (blocks &= ~linear; blocks != 0; blocks &= blocks - 1)
  {
    const int block = __builtin_ctzll(blocks);
    const BlockPixels<Lanes> d = pixels(block);
    const unsigned int inside = (d.Q < s.DepthX).ToBits();
    fragments += static_cast<std::uint64_t>(__builtin_popcount(inside));
    if ((paired >> block & 1) != 0)
    {
      tilted |= static_cast<std::uint64_t>(inside != 0 ? 1 : 0) << block;
    }
    else if (inside != 0)
    {
      AddGaussianToBlock<OnLens>(tile, block, copy, d, callbacks);
      if (isFinished)
      {
        MarkDark(tile, block);
      }
    }
  }
  for (; (tilted & (tilted - 1)) != 0; tilted &= tilted - 1)
  {
    const int first = __builtin_ctzll(tilted);
    tilted &= tilted - 1;
    const int second = __builtin_ctzll(tilted);
    const BlockPixels<Lanes> a = pixels(first), b = pixels(second);
    AddGaussianToFinished(TwoBlocks{ tile.Finished[first], tile.Finished[second] }, copy,
      BlockPixels<LanePair>{ { a.X, b.X }, { a.Y, b.Y }, { a.Q, b.Q } });
    MarkDark(tile, first);
    MarkDark(tile, second);
  }
  if (tilted != 0)
  {
    const int block = __builtin_ctzll(tilted);
    AddGaussianToFinished(OneBlock{ tile.Finished[block] }, copy, pixels(block));
    MarkDark(tile, block);
  }
  return fragments;
}

/// RasterTarget::AddGaussian.
std::uint64_t AddGaussian(PixelTile& tile, const Splat& splat, const LensFootprint* lens,
  const TilePlace& place, const RasterSettings& settings, const RasterCallbacks& callbacks)
{
  if (lens)
  {
    return AddBlocks<true>(tile, splat, lens, place, settings, callbacks);
  }
  if (IsInFocus(splat, settings, callbacks))
  {
    return splat.Opacity > 0.0f ? AddInFocus<true>(tile, splat, place, settings.ShortCuts)
                                : AddInFocus<false>(tile, splat, place, settings.ShortCuts);
  }
  return AddBlocks<false>(tile, splat, lens, place, settings, callbacks);
}

/// Pixels of a block that nothing which begins behind a depth can change by more than
/// MinTransmittance.
unsigned int HiddenFrom(
  const PixelTile& tile, int block, float near, const RasterSettings& settings)
{
  const OpenLayers& open = tile.Open[block];
  const Lanes through = Lanes::Load(tile.Finished[block].Transmittance);
  const LaneMask done = through <= MinTransmittance;
  // Of a layer that covers all, keep^4 < MinTransmittance is not composited over this gap.
  constexpr float gap = 1.6f, keep = 0.2019f; // exp(-gap)
  Lanes last = Lanes::Load(open.Far);
  if (HasTents(tile, block))
  {
    last = Larger(Lanes::Load(tile.Tents[block].Farther), last);
  }
  const LayerExtent extent =
    ExtentOf(open, last, Lanes::Load(open.Weight), Lanes::Load(open.Depth));
  const LaneMask ended =
    last < near - gap * LeakBand(BandOf({ near, near }, false, settings), extent);
  if (!Any(ended))
  {
    return done.ToBits();
  }
  const LayerCoverage<Lanes> layer = CoverageOf(tile, block, settings.LensRadius > 0.0f);
  const Lanes after = Leak(through, layer, Lanes(keep)).Through;
  return (Select(ended, after, through) <= MinTransmittance).ToBits();
}

/// RasterTarget::FindBright.
BrightBlocks FindBright(const PixelTile& tile, const float* behind, const BrightLimits& limits)
{
  BrightBlocks bright{};
  for (int i = 0; i < BlocksPerTile; ++i)
  {
    const Lanes through = behind[i] * Lanes::Load(tile.Finished[i].Transmittance);
    const Lanes squared = through * through, pairs = squared + Swap(squared, 1);
    alignas(64) float sums[LaneCount];
    (pairs + Swap(pairs, 2)).Store(sums); // of four lanes each
    const float mean = ((sums[0] + sums[4]) + (sums[8] + sums[12])) * (1.0f / PixelsPerBlock);
    bright.MeanSquare[i] = mean;
    const bool isLarge = Any(through >= limits.Largest);
    const bool isBright = mean >= limits.RootMeanSquare * limits.RootMeanSquare;
    bright.ByLargest |= static_cast<std::uint64_t>(isLarge ? 1 : 0) << i;
    bright.ByMean |= static_cast<std::uint64_t>(isBright ? 1 : 0) << i;
  }
  return bright;
}

void CloseAll(PixelTile& tile, const RasterSettings& settings, const RasterCallbacks& callbacks)
{
  for (int i = 0; i < BlocksPerTile; ++i)
  {
    if (settings.Pass == RasterPass::Collect)
    {
      CollectLayers(tile, i, AllLanes(), 0.0f, callbacks);
    }
    else
    {
      EndLayers(tile, i, settings, callbacks);
    }
  }
}
}
}
