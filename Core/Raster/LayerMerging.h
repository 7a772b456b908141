// SPDX-License-Identifier: BSD-3-Clause
/**
 * Where the layers of the A-buffer merge (the rule is in ABuffer.h), for a block of 16 pixels at a
 * time: a splat joins the open layer of a pixel or closes it, and closed layers are composited
 * front to back.
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

/// Adds lanes to sixteen floats.
SURFELSPLATTING_INLINE void AddTo(float* sum, const Lanes& x)
{
  (Lanes::Load(sum) + x).Store(sum);
}

/// Puts a number into the chosen ones of sixteen floats.
SURFELSPLATTING_INLINE void Put(float* values, const LaneMask& chosen, float x)
{
  Select(chosen, x, Lanes::Load(values)).Store(values);
}

/// out += share times the sum, clamped to [0, largest].
SURFELSPLATTING_INLINE void AddClamped(
  float* out, const Lanes& share, const float* sum, const Lanes& largest)
{
  AddTo(out, share * Min(Max(Lanes::Load(sum), 0.0f), largest));
}

/// Largest share of the lens that fragments with this mean point can cover.
SURFELSPLATTING_INLINE Lanes LargestCover(const Lanes& weight, const float* x, const float* y)
{
  const Lanes mx = Lanes::Load(x), my = Lanes::Load(y);
  const Lanes c =
    Min(Max((Max(Sqrt(mx * mx + my * my) - SP[12] * Max(weight - 1.0f, 0.0f), 0.0f) / Max(Min(weight, 1.0f), 1e-30f) - SP[11]) * (1.0f / (1.0f - SP[11])), 0.0f), 1.0f);
  Lanes a = 1.0f - c;
  a = Max(1.0f - c * (1.0f + 0.355f * Sqrt(Max(a * (1.0f - a), 0.0f))), 0.0f);
  a = Max(1.0f - c * (1.0f + 0.355f * Sqrt(Max(a * (1.0f - a), 0.0f))), 0.01f);
  return a;
}

/// Linear function on the lens, clamped to [0, 1], with the mean and moment of T(u).
SURFELSPLATTING_INLINE void NoteSeen(FinishedLayers& done, const Lanes& t, const Lanes& limit, const Lanes& x, const Lanes& y)
{
  if (SP[7] == 0.0f)
  {
    t.Store(done.SeenMean);
    (4.0f * x).Store(done.SeenX);
    (4.0f * y).Store(done.SeenY);
    return;
  }
  const Lanes length = Sqrt(x * x + y * y);
  const Lanes r = Min(length / Max(limit, 1e-20f), 1.0f), r2 = r * r;
  const Lanes s = 4.0f * t * (1.0f - t);
  const Lanes a = Min(Max((s - 0.69f) * (1.0f / 0.18f), 0.0f), 1.0f);
  const Lanes b = Min(Max((s - 0.87f) * (1.0f / 0.13f), 0.0f), 1.0f);
  const Lanes rest = (1.0f - r2) * (1.0f + a * r2 + b * r2 * r2);
  const Lanes k = 4.0f * length / Sqrt(Max(rest, 1e-6f));
  const Lanes slope = Min(k, SP[7]);
  const Lanes e = 1.0f - 2.0f * t, e2 = e * e;
  const Lanes edge = 0.5f - slope * e * (0.785f + 0.215f * e2 * e2);
  const Lanes mean = Select(t < 0.5f, Min(t, edge), Max(t, edge));
  const Lanes scale = slope / Max(length, 1e-20f);
  mean.Store(done.SeenMean);
  (scale * x).Store(done.SeenX);
  (scale * y).Store(done.SeenY);
}

/// The part of a pixel's lens through which an open layer is seen, [0, T].
SURFELSPLATTING_INLINE Lanes VisibleShare(
  const Lanes& through, const Lanes& weight, const Lanes& opacity, const Lanes& seen, const Lanes& cover)
{
  const Lanes coverage = Max(weight / cover, 1.0f);
  const Lanes alpha = opacity / coverage;
  return Min(Max(seen / coverage, Max(through + alpha - 1.0f, 0.0f)), Min(through, alpha));
}

/// Composites the share 1 - keep of the open layers of the chosen pixels behind the finished ones.
SURFELSPLATTING_INLINE void LeakLayers(PixelTile& tile, int block, const LaneMask& close,
  const Lanes& keep, const RasterSettings& settings)
{
  OpenLayers& open = tile.Open[block];
  FinishedLayers& done = tile.Finished[block];
  const Lanes weight = Lanes::Load(open.Weight), opacity = Lanes::Load(open.Opacity);
  const Lanes seen = Lanes::Load(open.Seen);
  const Lanes depth = Lanes::Load(open.Depth) / Max(weight, 1e-30f);
  // A layer behind an opaque prop contributes nothing.
  const LaneMask visible = close & (depth <= Lanes::Load(done.OccluderDepth));
  const Lanes before = Lanes::Load(done.Transmittance);
  const Lanes cover = SP[10] != 0.0f ? LargestCover(weight, open.FillX, open.FillY) : Lanes(1.0f);
  const Lanes all = VisibleShare(before, weight, opacity, seen, cover);
  const Lanes kept = VisibleShare(before, keep * weight, keep * opacity, keep * seen, cover);
  const Lanes scale =
    Select(visible, Min((before - all) / Max(before - kept, 1e-12f), 1.0f), 1.0f);
  const Lanes share = Select(visible, Max(all - scale * kept, 0.0f) / Max(seen, 1e-30f), 0.0f);
  const Lanes brightest = settings.LargestColor * seen;
  AddClamped(done.Red, share, open.Red, brightest);
  AddClamped(done.Green, share, open.Green, brightest);
  AddClamped(done.Blue, share, open.Blue, brightest);
  const Lanes after = Max(scale * before, 0.0f);
  const LaneMask median = (before > 0.5f) & (after <= 0.5f);
  Select(median, depth, Lanes::Load(done.Depth)).Store(done.Depth);
  after.Store(done.Transmittance);
  const Lanes x = Lanes::Load(done.ThroughX) - share * Lanes::Load(open.SeenX);
  const Lanes y = Lanes::Load(done.ThroughY) - share * Lanes::Load(open.SeenY);
  const Lanes p = Max(after * (1.0f - after), 0.0f);
  const Lanes limit = p / (1.0f + 0.355f * Sqrt(p));
  const Lanes shorten = Min(limit / Max(Sqrt(x * x + y * y), 1e-20f), 1.0f);
  (x * shorten).Store(done.ThroughX);
  (y * shorten).Store(done.ThroughY);
  NoteSeen(done, after, limit, x * shorten, y * shorten);
  if (!Any(after > MinTransmittance))
  {
    tile.Opaque |= std::uint64_t{ 1 } << block;
  }
  const Lanes k = Select(close, keep, 1.0f);
  float* raw[] = { open.Weight, open.Opacity, open.Depth, open.FillX, open.FillY };
  for (float* sum : raw)
  {
    (k * Lanes::Load(sum)).Store(sum);
  }
  const Lanes ks = k * scale;
  float* sums[] = { open.Seen, open.SeenX, open.SeenY, open.Red, open.Green, open.Blue };
  for (float* sum : sums)
  {
    (ks * Lanes::Load(sum)).Store(sum);
  }
}

/// Multiplies all sums of coarse layers.
SURFELSPLATTING_INLINE void ScaleSums(PixelTile& tile, int block, const Lanes& k)
{
  OpenLayers& open = tile.Open[block];
  OpenMoments& m = tile.Moments[block];
  float* sums[] = { open.Weight, open.Opacity, open.Depth, open.FillX, open.FillY, open.Seen,
    open.SeenX, open.SeenY, open.Red, open.Green, open.Blue, m.RedX, m.RedY, m.GreenX, m.GreenY,
    m.BlueX, m.BlueY, m.XX, m.XY, m.YY, m.HalfRange, m.Spread };
  for (float* sum : sums)
  {
    (k * Lanes::Load(sum)).Store(sum);
  }
}

/// Composites the open layers of the chosen pixels behind the finished ones, and empties them.
SURFELSPLATTING_INLINE void CloseLayers(
  PixelTile& tile, int block, const LaneMask& close, const RasterSettings& settings)
{
  if (settings.Collect)
  {
    ScaleSums(tile, block, Select(close, 0.0f, 1.0f));
  }
  else
  {
    LeakLayers(tile, block, close, 0.0f, settings);
  }
  Put(tile.Finished[block].Near, close, Infinity);
  Put(tile.Open[block].Far, close, -Infinity);
}

/// The z-range of a splat or tent, world units along the view direction.
struct ZRange
{
  float Near, Far;
};

/// Prepares the open layers of a block for a splat or tent of this z-range: closes layers that end
/// in front of it, and extends the z-ranges of the rest.
SURFELSPLATTING_INLINE void PrepareLayers(PixelTile& tile, int block, const ZRange& range,
  const LaneMask& inside, const RasterSettings& settings, const CloseCallback& callback,
  const Lanes& reach)
{
  OpenLayers& open = tile.Open[block];
  const LaneMask ended =
    inside & (Lanes::Load(open.Weight) > 0.0f) & (Lanes::Load(open.Far) < range.Near);
  const unsigned int bits = ended.ToBits();
  if (bits != 0)
  {
    if (callback.Function && !(settings.Collect && false))
    {
      callback.Function(callback.User, tile, block, bits, nullptr);
      CloseLayers(tile, block, ended, settings);
    }
    else
    {
      const float z = 0.5f * (range.Near + range.Far);
      const float blur = __builtin_fabsf(z * settings.BlurPerDepth - settings.LensRadius);
      const float band = SP[3] * blur + SP[4] * (range.Far - range.Near) + 1e-30f;
      const Lanes gap = Max(range.Near - Lanes::Load(open.Far), 0.0f) * (1.0f / band);
      const Lanes keep = ExpOfMinus(Min(gap, 80.0f));
      if (settings.Collect)
      {
        const LaneMask much = ended & (keep < 0.98f);
        const unsigned int emit = much.ToBits();
        if (emit != 0)
        {
          alignas(64) float k[PixelsPerBlock];
          keep.Store(k);
          callback.Function(callback.User, tile, block, emit, k);
          ScaleSums(tile, block, Select(much, keep, 1.0f));
        }
      }
      else
      {
        LeakLayers(tile, block, ended, keep, settings);
      }
    }
  }
  const Lanes far = Lanes::Load(open.Far);
  Select(inside, Max(far, range.Near + reach * (range.Far - range.Near)), far).Store(open.Far);
  if (callback.Function)
  {
    float* nearest = tile.Finished[block].Near;
    const Lanes near = Lanes::Load(nearest);
    Select(inside, Min(near, range.Near), near).Store(nearest);
    AddTo(tile.Finished[block].Fragments, Select(inside, 1.0f, 0.0f));
  }
}

/// Where a fragment passes the lens, in units of its radius.
struct LensPoints
{
  Lanes X, Y;
};

/// Linear reconstruction of a function on the lens from its mean and its first moments.
SURFELSPLATTING_INLINE Lanes AtLensPoint(
  const Lanes& mean, const float* x, const float* y, const LensPoints& u)
{
  return mean + 4.0f * (Lanes::Load(x) * u.X + Lanes::Load(y) * u.Y);
}

/// Adds a splat or tent to the sums of open layers, but for its colours. Returns w s.
SURFELSPLATTING_INLINE Lanes AddCoverage(PixelTile& tile, int block, Lanes weight,
  float opacity, const Lanes& depth, const LensPoints& u, float focus, bool collect)
{
  OpenLayers& open = tile.Open[block];
  const FinishedLayers& done = tile.Finished[block];
  const Lanes through = Lanes::Load(done.Transmittance), before = Lanes::Load(open.Weight);
  const Lanes fill = before + SP[6] * 4.0f * (Lanes::Load(open.FillX) * u.X + Lanes::Load(open.FillY) * u.Y);
  const float limit = collect ? 1.0f + SP[15] : 1.0f + SP[0] * (focus < 0.0f ? 0.0f : focus) + SP[1] * (1.0f - (focus < 0.0f ? 0.0f : focus));
  if (!collect || SP[15] != 0.0f) weight = weight * Min(Max((limit - fill) * (1.0f / SP[2]), 0.0f), 1.0f);
  Lanes seen = through;
  if (collect)
  {
    seen = 1.0f;
  }
  else if (SP[5] != 0.0f)
  {
    if (focus < 0.0f) seen = AtLensPoint(through, done.ThroughX, done.ThroughY, u);
    else seen = Lanes::Load(done.SeenMean) + Lanes::Load(done.SeenX) * u.X + Lanes::Load(done.SeenY) * u.Y;
    if (SP[7] != 0.0f && focus >= 0.0f) seen = through + (1.0f - focus) * (Min(Max(seen, 0.0f), 1.0f) - through);
    seen = Min(Max(seen, 0.02f * through), 1.0f);
  }
  (before + weight).Store(open.Weight);
  AddTo(open.Opacity, weight * opacity);
  AddTo(open.Depth, weight * depth);
  const float share = 1.0f;
  AddTo(open.FillX, weight * (share * u.X));
  AddTo(open.FillY, weight * (share * u.Y));
  const Lanes visible = weight * seen * opacity;
  AddTo(open.Seen, visible);
  AddTo(open.SeenX, visible * u.X);
  AddTo(open.SeenY, visible * u.Y);
  return visible;
}

/// @param opaque the weight times the opacity times the visibility
template <typename SplatOrTent>
SURFELSPLATTING_INLINE void AddColors(OpenLayers& open, const SplatOrTent& s, const Lanes& opaque)
{
  AddTo(open.Red, opaque * s.Red);
  AddTo(open.Green, opaque * s.Green);
  AddTo(open.Blue, opaque * s.Blue);
}
}
}
