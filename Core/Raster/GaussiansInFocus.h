// SPDX-License-Identifier: BSD-3-Clause
/**
 * Captures without a lens, in tiles that have nothing but finished layers: T has no
 * moments, and what a fragment hides is T times its opacity. The sums are those of
 * GaussianLayers.h, which has all else.
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
/// Whether it is of a capture, touches nothing but finished layers without moments, and nobody asks
/// for more. Leaves that merge are both opacity and optical depth, and few; volumes, which have an
/// extent in depth, round as GaussianLayers.h does.
SURFELSPLATTING_INLINE bool IsInFocus(
  const Splat& splat, const RasterSettings& settings, const RasterCallbacks& callbacks)
{
  return settings.LensRadius == 0.0f && !settings.HasLayers && !settings.Doubts &&
    !callbacks.Leaked && splat.Shape <= -1.0f &&
    (splat.Opacity <= 0.0f || (splat.Opacity >= 1.0f && splat.Far <= splat.Near));
}

/// A Gaussian in focus, and the pixels of a block as it sees them.
struct FocusedGaussian
{
  float A, K, B, Reach;
  float Weight, Depth;
  float Red, Green, Blue;
  Lanes FirstX, FirstY; // from its centre to the pixels of the tile's first block

  SURFELSPLATTING_INLINE FocusedGaussian(const Splat& s, const TilePlace& place)
    : A(s.A)
    , K(s.K)
    , B(s.B)
    , Reach(s.DepthX)
    , Weight(s.Weight)
    , Depth(s.Near)
    , Red(s.Red)
    , Green(s.Green)
    , Blue(s.Blue)
    , FirstX(Lanes::Load(RampX) + (0.5f - place.X))
    , FirstY(Lanes::Load(RampY) + (0.5f - place.Y))
  {
  }

  /// q.
  SURFELSPLATTING_INLINE Lanes RadiusSquared(int block) const
  {
    const Lanes dx = this->FirstX + FirstPixel[block % BlocksPerRow];
    const Lanes dy = this->FirstY + FirstPixel[block / BlocksPerRow];
    const Lanes u = dx + this->K * dy;
    return this->A * u * u + this->B * dy * dy;
  }
};

/// Composites the fragments of a Gaussian into a block.
/// @tparam IsDepth whether its weight is an optical depth
/// @return whether all of its pixels are opaque
template <bool IsDepth>
SURFELSPLATTING_INLINE bool CompositeInFocus(
  FinishedLayers& done, const FocusedGaussian& s, const Lanes& q, const LaneMask& inside)
{
  const Lanes before = Lanes::Load(done.Transmittance);
  constexpr float perSquare = -0.72134752f; // exp(-q/2) is a power of two
  const Lanes weight = TimesPowerOfTwo(s.Weight, perSquare * q);
  constexpr float perDepth = -1.44269504f;
  const Lanes opacity = IsDepth ? 1.0f - TimesPowerOfTwo(1.0f, perDepth * Smaller(weight, 80.0f))
                                : Smaller(weight, MaxOpacity);
  const LaneMask visible = inside & (Lanes::Load(done.OccluderDepth) >= s.Depth);
  const Lanes hides = Select(visible, before * opacity, 0.0f);
  const Lanes after = before - hides; // never less than 0
  AddTo(done.Red, hides * s.Red);
  AddTo(done.Green, hides * s.Green);
  AddTo(done.Blue, hides * s.Blue);
  const LaneMask median = (before > 0.5f) & (after <= 0.5f);
  Select(median, s.Depth, Lanes::Load(done.Depth)).Store(done.Depth);
  after.Store(done.Transmittance);
  return !Any(after > MinTransmittance);
}

/// Adds a Gaussian in focus. A function of its own, so that its constants stay in registers.
template <bool IsDepth>
__attribute__((noinline)) std::uint64_t AddInFocus(
  PixelTile& tile, const Splat& splat, const TilePlace& place, bool skipHidden)
{
  const FocusedGaussian s(splat, place);
  std::uint64_t fragments = 0, opaque = 0;
  for (std::uint64_t blocks =
         BlocksOfSplat(splat, place, s.Reach, FewPixels) & ~(skipHidden ? tile.Opaque : 0);
       blocks != 0; blocks &= blocks - 1)
  {
    // Without a branch for the blocks that are just beside it: it could not be predicted, and would
    // take longer than they do.
    const int block = __builtin_ctzll(blocks);
    const Lanes q = s.RadiusSquared(block);
    const LaneMask inside = q < s.Reach;
    fragments += static_cast<std::uint64_t>(__builtin_popcount(inside.ToBits()));
    const bool isOpaque = CompositeInFocus<IsDepth>(tile.Finished[block], s, q, inside);
    opaque |= static_cast<std::uint64_t>(isOpaque ? 1 : 0) << block;
  }
  tile.Opaque |= opaque;
  return fragments;
}
}
}
