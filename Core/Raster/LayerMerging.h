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

/// Updates Covered and Conflict (FinishedLayers). @param covered share of the lens that the layer
/// covers
SURFELSPLATTING_INLINE void NoteConflict(FinishedLayers& done, const LaneMask& visible,
  const Lanes& before, const Lanes& coverage, const Lanes& covered)
{
  const Lanes behind = Lanes::Load(done.Covered);
  Lanes conflict = Min(behind, 1.0f - behind) * Select(before > 0.0f, covered, 0.0f);
  conflict = Max(conflict, Select(visible, before * (1.0f - MaxRipple / coverage), 0.0f));
  Max(Lanes::Load(done.Conflict), conflict).Store(done.Conflict);
  AddTo(done.Covered, (1.0f - behind) * covered);
}

/// Composites the open layers of the chosen pixels behind the finished ones, and empties them.
SURFELSPLATTING_INLINE void CloseLayers(
  PixelTile& tile, int block, const LaneMask& close, const RasterSettings& settings)
{
  OpenLayers& open = tile.Open[block];
  FinishedLayers& done = tile.Finished[block];
  const Lanes weight = Lanes::Load(open.Weight), opacity = Lanes::Load(open.Opacity);
  const Lanes coverage = Max(weight, 1.0f);
  const Lanes depth = Lanes::Load(open.Depth) / Max(weight, 1e-30f);
  // A layer behind an opaque prop contributes nothing.
  const LaneMask visible = close & (depth <= Lanes::Load(done.OccluderDepth));
  const Lanes before = Lanes::Load(done.Transmittance);
  const Lanes share = Select(visible, before / coverage, 0.0f);
  if (settings.NoteConflicts)
  {
    NoteConflict(done, visible, before, coverage, Select(visible, weight / coverage, 0.0f));
  }
  const Lanes brightest = settings.LargestColor * opacity;
  AddClamped(done.Red, share, open.Red, brightest);
  AddClamped(done.Green, share, open.Green, brightest);
  AddClamped(done.Blue, share, open.Blue, brightest);
  const Lanes after = Max(before - share * opacity, 0.0f);
  const LaneMask median = (before > 0.5f) & (after <= 0.5f);
  Select(median, depth, Lanes::Load(done.Depth)).Store(done.Depth);
  after.Store(done.Transmittance);
  if (!Any(after > MinTransmittance))
  {
    tile.Opaque |= std::uint64_t{ 1 } << block;
  }

  Put(done.Near, close, Infinity);
  Put(open.Far, close, -Infinity);
  float* sums[] = { open.Weight, open.Opacity, open.Red, open.Green, open.Blue, open.Depth };
  for (float* sum : sums)
  {
    Put(sum, close, 0.0f);
  }
}

/// The z-range of a splat or tent, world units along the view direction.
struct ZRange
{
  float Near, Far;
};

/// Prepares the open layers of a block for a splat or tent of this z-range: closes layers that end
/// in front of it, and extends the z-ranges of the rest.
SURFELSPLATTING_INLINE void PrepareLayers(PixelTile& tile, int block, const ZRange& range,
  const LaneMask& inside, const RasterSettings& settings, const CloseCallback& callback)
{
  OpenLayers& open = tile.Open[block];
  const LaneMask ended =
    inside & (Lanes::Load(open.Weight) > 0.0f) & (Lanes::Load(open.Far) < range.Near);
  const unsigned int bits = ended.ToBits();
  if (bits != 0)
  {
    if (callback.Function)
    {
      callback.Function(callback.User, tile, block, bits);
    }
    CloseLayers(tile, block, ended, settings);
  }
  const Lanes far = Lanes::Load(open.Far);
  Select(inside, Max(far, range.Far), far).Store(open.Far);
  if (callback.Function)
  {
    float* nearest = tile.Finished[block].Near;
    const Lanes near = Lanes::Load(nearest);
    Select(inside, Min(near, range.Near), near).Store(nearest);
    AddTo(tile.Finished[block].Fragments, Select(inside, 1.0f, 0.0f));
  }
}

/// Adds a splat or tent to the sums of open layers, but for its colours.
/// @param weight its coverage, 0 outside its support
/// @param opaque the weight times the opacity
/// @param depth  world units along the view direction
SURFELSPLATTING_INLINE void AddCoverage(
  OpenLayers& open, const Lanes& weight, const Lanes& opaque, const Lanes& depth)
{
  AddTo(open.Weight, weight);
  AddTo(open.Opacity, opaque);
  AddTo(open.Depth, weight * depth);
}

/// @param opaque the weight times the opacity
template <typename SplatOrTent>
SURFELSPLATTING_INLINE void AddColors(OpenLayers& open, const SplatOrTent& s, const Lanes& opaque)
{
  AddTo(open.Red, opaque * s.Red);
  AddTo(open.Green, opaque * s.Green);
  AddTo(open.Blue, opaque * s.Blue);
}
}
}
