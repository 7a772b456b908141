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

namespace SurfelSplatting
{
namespace
{
/// The kernel of a Gaussian in space at q < reach, 1 at q = 0.
SURFELSPLATTING_INLINE Lanes EvaluateInSpace(float shape, const Lanes& q, float reach)
{
  if (shape >= 0.0f)
  {
    return EvaluateKernel(shape, q, reach);
  }
  const Lanes gaussian = ExpOfMinus(Smaller(0.5f * q, 80.0f));
  if (shape <= -1.0f)
  {
    return gaussian;
  }
  const Lanes x = Larger(1.0f - q * static_cast<float>(1.0 / FocusBellReach), 0.0f);
  const Lanes bell = x * (Edge + (1.0f - Edge) * (x * x * x));
  return (1.0f + shape) * static_cast<float>(FocusBellPeak) * bell - shape * gaussian;
}

/// Opacity of a footprint (Splat.h). @param depth w k
SURFELSPLATTING_INLINE Lanes OpacityInSpace(const Lanes& depth, float absorbs)
{
  const Lanes held = Smaller(depth, MaxOpacity);
  if (absorbs <= 0.0f)
  {
    return held;
  }
  const Lanes absorbed = 1.0f - ExpOfMinus(Smaller(depth, 80.0f));
  return absorbs >= 1.0f ? absorbed : held + absorbs * (absorbed - held);
}

/// Fragments of a Gaussian in a block.
struct GaussianFragments
{
  LaneMask Inside;
  Lanes Alpha;
  float Depth; ///< world units along the view direction
  LensPoints U;
  float Quarter; ///< C / 4, px
};

/// Lets the layers leak that end in front of a depth.
SURFELSPLATTING_INLINE void LeakBefore(PixelTile& tile, int block, const GaussianFragments& f,
  const RasterSettings& settings, const RasterCallbacks& callbacks)
{
  OpenLayers& open = tile.Open[block];
  const Lanes far = Lanes::Load(open.Far);
  const LaneMask ended =
    f.Inside & (Lanes::Load(open.Weight) > LeastLeakingWeight) & (far < f.Depth);
  if (!Any(ended))
  {
    return;
  }
  const Lanes gap = Larger(f.Depth - far, 0.0f) * (1.0f / LeakBand({ f.Depth, f.Depth }, settings));
  const Lanes keep = Select(gap < LargestGap, ExpOfMinus(Smaller(gap, LargestGap)), 0.0f);
  LeakLayers<false>(tile, block, ended, keep, settings, callbacks);
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

/// Takes what the fragments hide from the moments of T and from the open layers.
/// @param hides of T
template <bool OnLens>
SURFELSPLATTING_INLINE void HideThroughLens(
  PixelTile& tile, int block, const LensPoints& u, const Lanes& hides, const Lanes& before)
{
  const Lanes after = Lanes::Load(tile.Finished[block].Transmittance);
  const bool wasTilted = IsTilted(tile, block);
  const bool isLong = (OnLens || wasTilted) &&
    StoreMoment(tile.Finished[block], hides, OnLens ? u : LensPoints{ 0.0f, 0.0f }, after);
  const bool becomesTilted = isLong && !wasTilted;
  if (becomesTilted)
  {
    tile.Tilted |= std::uint64_t{ 1 } << block;
  }
  if (wasTilted || becomesTilted)
  {
    DimOpenLayers(tile, block, before, after, becomesTilted);
  }
}

/// Composites the fragments of a Gaussian.
template <bool OnLens>
SURFELSPLATTING_INLINE void CompositeGaussian(PixelTile& tile, int block, const Splat& s,
  const GaussianFragments& f, const RasterSettings& settings, const RasterCallbacks& callbacks)
{
  FinishedLayers& done = tile.Finished[block];
  const Lanes before = Lanes::Load(done.Transmittance);
  Lanes seen = before;
  if (OnLens && IsTilted(tile, block))
  {
    const LensPoints moment{ Lanes::Load(done.ThroughX), Lanes::Load(done.ThroughY) };
    const Lanes length = LengthOf(moment.X, moment.Y), per = 1.0f / Larger(length, 1e-20f);
    const Lanes nx = moment.X * per, ny = moment.Y * per, across = nx + s.K * ny;
    const Lanes lens = (4.0f * f.Quarter * f.Quarter) * (s.A * across * across + s.B * ny * ny);
    seen = LimitSeen(
      ReconstructRamp(before, length, nx * f.U.X + ny * f.U.Y, Smaller(lens, 1.0f)), before);
  }
  const LaneMask visible = f.Inside & (Lanes::Load(done.OccluderDepth) >= f.Depth);
  const LayerCoverage<Lanes> layer{ 1.0f, f.Alpha, f.Alpha * seen };
  const Lanes hides = Select(visible, VisibleShare(before, layer), 0.0f);
  const Lanes after = Larger(before - hides, 0.0f);
  const Lanes red = hides * s.Red, green = hides * s.Green, blue = hides * s.Blue;
  AddTo(done.Red, red);
  AddTo(done.Green, green);
  AddTo(done.Blue, blue);
  const LaneMask median = (before > 0.5f) & (after <= 0.5f);
  Select(median, f.Depth, Lanes::Load(done.Depth)).Store(done.Depth);
  after.Store(done.Transmittance);
  if (!Any(after > MinTransmittance))
  {
    tile.Opaque |= std::uint64_t{ 1 } << block;
  }
  if (settings.Doubts || callbacks.Leaked)
  {
    LeakedLayers leaked;
    red.Store(leaked.Red);
    green.Store(leaked.Green);
    blue.Store(leaked.Blue);
    hides.Store(leaked.Alpha);
    Lanes(f.Depth).Store(leaked.Depth);
    f.Alpha.Store(leaked.Coverage);
    if (settings.Doubts)
    {
      const Lanes share = hides / Larger(layer.Seen, 1e-30f);
      AddDoubt(tile.Doubted[block], layer, before, { share, after, 0.0f, 0.0f, 0.0f }, leaked);
    }
    if (callbacks.Leaked)
    {
      callbacks.Leaked(callbacks.User, tile, block, visible.ToBits(), leaked);
      AddTo(done.Fragments, Select(f.Inside, 1.0f, 0.0f));
    }
  }
  if (settings.LensRadius > 0.0f)
  {
    HideThroughLens<OnLens>(tile, block, f.U, hides, before);
  }
}

/// Adds a Gaussian in space to a block; returns the lanes that it covers.
template <bool OnLens>
SURFELSPLATTING_INLINE unsigned int AddGaussianToBlock(PixelTile& tile, int block,
  const SplatCopy& splat, const BlockPixels& d, const RasterCallbacks& callbacks)
{
  const Splat& s = splat.S;
  const LaneMask inside = d.Q < s.DepthX;
  const unsigned int bits = inside.ToBits();
  if (bits == 0)
  {
    return 0;
  }
  const Lanes depth = s.Weight * EvaluateInSpace(s.Shape, d.Q, s.DepthX);
  const LensFootprint& lens = splat.Footprint;
  const float quarter = lens.PerPixel;
  const Lanes ux = (quarter * s.A) * (d.X + s.K * d.Y);
  const GaussianFragments fragments{ inside, Select(inside, OpacityInSpace(depth, s.Opacity), 0.0f),
    s.Near, { ux, splat.S.K * ux + (quarter * splat.S.B) * d.Y }, quarter };
  LeakBefore(tile, block, fragments, splat.Settings, callbacks);
  CompositeGaussian<OnLens>(tile, block, s, fragments, splat.Settings, callbacks);
  return bits;
}
}
}
