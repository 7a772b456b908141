// SPDX-License-Identifier: BSD-3-Clause
/**
 * The loops of RasterTarget.h; included once for each instruction set. A splat goes block by block
 * through its kernel (KernelEvaluation.h) into the layers of the pixels (LayerMerging.h).
 */
#include "Core/Raster/KernelEvaluation.h"
#include "Core/Raster/LayerMerging.h"
#include "Core/Raster/RasterTarget.h"

namespace SurfelSplatting
{
namespace
{
/// Pixels of a block as a splat sees them.
struct BlockPixels
{
  Lanes X, Y; // px from the splat's centre
  Lanes Q;    // squared radius in the kernel's own unit
};

/// Data that a splat is drawn from: the copies that AddBlocks makes.
struct SplatCopy
{
  const Splat& S;
  const SplatGradient& Gradient; // these two where the template's flags say so
  const LensSlope& Slope;
  const RasterSettings& Settings;
};

/// For the z-buffer: depth of the splat's plane behind its centre, limited to +- the splat's size,
/// the length of its z-range.
SURFELSPLATTING_INLINE Lanes EvaluatePlane(const Splat& s, const BlockPixels& d)
{
  const float range = s.Far - s.Near;
  return Min(Max(s.DepthX * d.X + s.DepthY * d.Y, -range), range);
}

/// Adds a splat to the depths of the z-buffer: its plane, farther by half its z-range. Its inner
/// part hides, so that tails at silhouettes do not.
SURFELSPLATTING_INLINE void AddDepths(
  OpenLayers& open, const SplatCopy& splat, const BlockPixels& d)
{
  const Lanes far = Lanes::Load(open.Far);
  Select(
    d.Q < 0.35f * splat.Settings.Support, Min(far, splat.S.Far + EvaluatePlane(splat.S, d)), far)
    .Store(open.Far);
}

/// Adds a splat to a block; returns the lanes that it covers.
template <bool HasGradient, bool OnLens, RasterPass Pass>
SURFELSPLATTING_INLINE unsigned int AddToBlock(PixelTile& tile, int block, const SplatCopy& splat,
  const BlockPixels& d, const CloseCallback& callback)
{
  OpenLayers& open = tile.Open[block];
  const Splat& s = splat.S;
  const float support = splat.Settings.Support;
  if (Pass == RasterPass::Depths)
  {
    AddDepths(open, splat, d);
    return 0;
  }
  LaneMask inside = d.Q < support;
  if (Pass == RasterPass::Nearest)
  {
    inside = inside & (Lanes::Load(open.Far) >= s.Near + EvaluatePlane(s, d));
  }
  const unsigned int bits = inside.ToBits();
  if (bits == 0)
  {
    return 0;
  }
  Lanes slope;
  const Lanes kernel = HasGradient ? EvaluateSlope(s.Shape, d.Q, support, slope)
                             : EvaluateKernel(s.Shape, d.Q, support);
  const Lanes weight = Select(inside, s.Weight * kernel, 0.0f);
  if (Pass == RasterPass::Layers)
  {
    const Lanes reach = Lanes(1.0f);
    PrepareLayers(tile, block, { s.Near, s.Far }, inside, splat.Settings, callback, reach);
  }
  LensPoints u{ 0.0f, 0.0f };
  float focus = 1.0f;
  if (OnLens)
  {
    u = { SP[14] * splat.Slope.MeanX + splat.Slope.Point * d.X, SP[14] * splat.Slope.MeanY + splat.Slope.Point * d.Y };
    focus = 1.0f - splat.Slope.TiltX;
  }
  const float depth = 0.5f * (s.Near + s.Far);
  const Lanes visible = AddCoverage(
    tile, block, weight, s.Opacity, depth + s.DepthX * d.X + s.DepthY * d.Y, u, focus, splat.Settings.Collect);
  Lanes red = visible * s.Red, green = visible * s.Green, blue = visible * s.Blue;
  if (HasGradient)
  {
    const Lanes tilt = Select(inside, visible * slope / Max(kernel, 1e-6f), 0.0f);
    const SplatGradient& g = splat.Gradient;
    red += tilt * (g.RedX * d.X + g.RedY * d.Y);
    green += tilt * (g.GreenX * d.X + g.GreenY * d.Y);
    blue += tilt * (g.BlueX * d.X + g.BlueY * d.Y);
  }
  AddTo(open.Red, red);
  AddTo(open.Green, green);
  AddTo(open.Blue, blue);
  if (splat.Settings.Collect)
  {
    OpenMoments& m = tile.Moments[block];
    AddTo(m.RedX, red * u.X);
    AddTo(m.RedY, red * u.Y);
    AddTo(m.GreenX, green * u.X);
    AddTo(m.GreenY, green * u.Y);
    AddTo(m.BlueX, blue * u.X);
    AddTo(m.BlueY, blue * u.Y);
    AddTo(m.XX, visible * u.X * u.X);
    AddTo(m.XY, visible * u.X * u.Y);
    AddTo(m.YY, visible * u.Y * u.Y);
    const Lanes z = depth + s.DepthX * d.X + s.DepthY * d.Y - Lanes::Load(tile.Finished[block].Near);
    AddTo(m.Spread, Select(inside, weight * z * z, 0.0f));
    AddTo(m.HalfRange, Select(inside, weight * (0.5f * (s.Far - s.Near)), 0.0f));
  }
  return bits;
}

/// Columns and rows of a block's pixels.
alignas(64) constexpr float RampX[LaneCount] = { 0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3 };
alignas(64) constexpr float RampY[LaneCount] = { 0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3 };
alignas(
  64) constexpr float Ramp[LaneCount] = { 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15 };

/// Blocks of each row that a splat's support can touch, [Begin, End).
struct BlockRanges
{
  int Begin[BlocksPerRow], End[BlocksPerRow];
};

/// Selects all blocks of a span.
SURFELSPLATTING_INLINE void SelectAll(const PixelBox& span, BlockRanges& ranges)
{
  const int begin = span.X0 / BlockSize, end = (span.X1 + BlockSize - 1) / BlockSize;
  for (int j = 0; j < BlocksPerRow; ++j)
  {
    ranges.Begin[j] = begin;
    ranges.End[j] = end;
  }
}

/// Narrows the ranges to blocks between the support's ends, |dx + K dy| < sqrt((support - B dy^2) /
/// A), in any of a block's four rows of pixels; sixteen rows of pixels at a time.
SURFELSPLATTING_INLINE void Narrow(
  const Splat& s, const TilePlace& place, float support, BlockRanges& ranges)
{
  constexpr int rowsOfBlocks = LaneCount / BlockSize;
  const float across = 1.0f / s.A;
  for (int j = place.Span.Y0 / LaneCount * rowsOfBlocks; j * BlockSize < place.Span.Y1;
       j += rowsOfBlocks)
  {
    const Lanes dy = Lanes::Load(Ramp) + (static_cast<float>(j * BlockSize) + 0.5f - place.Y);
    const Lanes half = Sqrt(Max(support - s.B * dy * dy, 0.0f) * across);
    const Lanes center = (place.X - 0.5f) - s.K * dy;
    alignas(64) float low[LaneCount], high[LaneCount];
    // One pixel more on either side, for rounding. NaN becomes the whole row or nothing: no pixel
    // outside of the tile is ever touched.
    Min(SmallestOfFour(Max(center - half - 1.0f, 0.0f)), TileSize).Store(low);
    Max(Min(LargestOfFour(center + half + 1.0f), TileSize - 1.0f), -1.0f).Store(high);
    for (int i = 0; i < rowsOfBlocks; ++i)
    {
      const int begin = static_cast<int>(low[i * BlockSize]) / BlockSize;
      const int end = static_cast<int>(high[i * BlockSize] + BlockSize) / BlockSize;
      ranges.Begin[j + i] = begin > ranges.Begin[j + i] ? begin : ranges.Begin[j + i];
      ranges.End[j + i] = end < ranges.End[j + i] ? end : ranges.End[j + i];
    }
  }
}

/// Narrower spans are not worth narrowing.
constexpr int FewPixels = 3 * BlockSize;

template <bool HasGradient, bool OnLens, RasterPass Pass = RasterPass::Layers>
std::uint64_t AddBlocks(PixelTile& tile, const SplatData& splat, const TilePlace& place,
  const RasterSettings& shared, const CloseCallback& callback)
{
  // Copies, because the compiler must assume that writes to the tile can change the originals.
  const Splat s = splat.Body;
  const SplatGradient gradient = HasGradient ? *splat.Gradient : SplatGradient{};
  const LensSlope slope = OnLens ? *splat.Slope : LensSlope{};
  const RasterSettings settings = shared;
  const SplatCopy copy{ s, gradient, slope, settings };
  const PixelBox& span = place.Span;
  const Lanes rampX = Lanes::Load(RampX) + (0.5f - place.X);
  const Lanes rampY = Lanes::Load(RampY) + (0.5f - place.Y);
  const int end = (span.Y1 + BlockSize - 1) / BlockSize;
  const std::uint64_t hidden = settings.SkipHidden ? tile.Opaque : 0;
  BlockRanges ranges;
  SelectAll(span, ranges);
  if (span.X1 - span.X0 > FewPixels)
  {
    Narrow(s, place, settings.Support, ranges);
  }
  std::uint64_t fragments = 0;
  for (int j = span.Y0 / BlockSize; j < end; ++j)
  {
    const Lanes dy = rampY + static_cast<float>(j * BlockSize);
    const Lanes q0 = s.B * dy * dy;
    const Lanes u0 = rampX + s.K * dy;
    for (int i = ranges.Begin[j]; i < ranges.End[j]; ++i)
    {
      const int block = j * BlocksPerRow + i;
      if ((hidden >> block & 1) != 0)
      {
        continue;
      }
      const Lanes u = u0 + static_cast<float>(i * BlockSize);
      const BlockPixels d{ rampX + static_cast<float>(i * BlockSize), dy, s.A * u * u + q0 };
      fragments += static_cast<std::uint64_t>(__builtin_popcount(
        AddToBlock<HasGradient, OnLens, Pass>(tile, block, copy, d, callback)));
    }
  }
  return fragments;
}

/// Adds a cell of a coarse grid, interpolated.
std::uint64_t AddTent(PixelTile& tile, const Tent& tent, const TilePlace& place,
  const RasterSettings& shared, const CloseCallback& callback)
{
  const Tent s = tent; // copies, as in AddBlocks
  const RasterSettings settings = shared;
  const PixelBox& span = place.Span;
  const Lanes rampX = Lanes::Load(RampX) + (0.5f - place.X);
  const Lanes rampY = Lanes::Load(RampY) + (0.5f - place.Y);
  const std::uint64_t hidden = settings.SkipHidden ? tile.Opaque : 0;
  std::uint64_t fragments = 0;
  for (int j = span.Y0 / BlockSize; j < (span.Y1 + BlockSize - 1) / BlockSize; ++j)
  {
    const Lanes dy = rampY + static_cast<float>(j * BlockSize);
    const Lanes weightOfRow = s.Weight * (1.0f - s.InverseCell * Max(dy, 0.0f - dy));
    for (int i = span.X0 / BlockSize; i < (span.X1 + BlockSize - 1) / BlockSize; ++i)
    {
      const int block = j * BlocksPerRow + i;
      const Lanes dx = rampX + static_cast<float>(i * BlockSize);
      const Lanes across = 1.0f - s.InverseCell * Max(dx, 0.0f - dx);
      const LaneMask inside = (weightOfRow > 0.0f) & (across > 0.0f);
      const unsigned int bits = (hidden >> block & 1) != 0 ? 0 : inside.ToBits();
      if (bits == 0)
      {
        continue;
      }
      fragments += static_cast<std::uint64_t>(__builtin_popcount(bits));
      const Lanes weight = Select(inside, weightOfRow * across, 0.0f);
      PrepareLayers(tile, block, { s.Near, s.Far }, inside, settings, callback, 1.0f);
      OpenLayers& open = tile.Open[block];
      const FinishedLayers& done = tile.Finished[block];
      Lanes w = weight;
      if (SP[13] != 0.0f)
      {
        const Lanes fill = Lanes::Load(open.Weight) +
          4.0f * SP[6] * (Lanes::Load(open.FillX) * s.PointX + Lanes::Load(open.FillY) * s.PointY);
        w = Min(w, Max(1.0f + SP[1] - fill, 0.0f));
      }
      const Lanes visible = AddCoverage(
        tile, block, w, s.Opacity, s.Depth, { s.PointX, s.PointY }, -1.0f, settings.Collect);
      AddColors(open, s, visible);
      const Lanes gx = 4.0f * w * s.Opacity * Lanes::Load(done.ThroughX);
      const Lanes gy = 4.0f * w * s.Opacity * Lanes::Load(done.ThroughY);
      AddTo(open.Red, gx * s.ColorX[0] + gy * s.ColorY[0]);
      AddTo(open.Green, gx * s.ColorX[1] + gy * s.ColorY[1]);
      AddTo(open.Blue, gx * s.ColorX[2] + gy * s.ColorY[2]);
      AddTo(open.SeenX, gx * s.XX + gy * s.XY);
      AddTo(open.SeenY, gx * s.XY + gy * s.YY);
    }
  }
  return fragments;
}

/// Chooses the loop that has only what the splat needs.
std::uint64_t AddSplat(PixelTile& tile, const SplatData& splat, const TilePlace& place,
  const RasterSettings& settings, const CloseCallback& callback)
{
  const bool gradient = splat.Gradient != nullptr;
  if (settings.Pass == RasterPass::Depths)
  {
    return AddBlocks<false, false, RasterPass::Depths>(tile, splat, place, settings, callback);
  }
  if (settings.Pass == RasterPass::Nearest)
  {
    return gradient
      ? AddBlocks<true, false, RasterPass::Nearest>(tile, splat, place, settings, callback)
      : AddBlocks<false, false, RasterPass::Nearest>(tile, splat, place, settings, callback);
  }
  if (splat.Slope)
  {
    return gradient ? AddBlocks<true, true>(tile, splat, place, settings, callback)
                    : AddBlocks<false, true>(tile, splat, place, settings, callback);
  }
  return gradient ? AddBlocks<true, false>(tile, splat, place, settings, callback)
                  : AddBlocks<false, false>(tile, splat, place, settings, callback);
}

/// Pixels of a block that nothing behind a depth can change.
unsigned int HiddenFrom(
  const PixelTile& tile, int block, float near, const RasterSettings& settings)
{
  const OpenLayers& open = tile.Open[block];
  const Lanes through = Lanes::Load(tile.Finished[block].Transmittance);
  const Lanes weight = Lanes::Load(open.Weight);
  const Lanes after =
    through - VisibleShare(through, weight, Lanes::Load(open.Opacity), Lanes::Load(open.Seen), 1.0f);
  const float blur = __builtin_fabsf(near * settings.BlurPerDepth - settings.LensRadius);
  const LaneMask ended = Lanes::Load(open.Far) < near - 0.5f * SP[3] * blur;
  const Lanes rest = Select(ended, 4.0f * after, through);
  return (Min(rest, through) <= MinTransmittance).ToBits();
}

void CloseAll(PixelTile& tile, const RasterSettings& settings)
{
  for (int i = 0; i < BlocksPerTile; ++i)
  {
    CloseLayers(tile, i, AllLanes(), settings);
  }
}
}
}
