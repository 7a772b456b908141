// SPDX-License-Identifier: BSD-3-Clause
/**
 * Included by the translation units of RasterKernel.h, once for each instruction set.
 */
#include "RasterKernel.h"

namespace SurfelSplatting
{
namespace
{
constexpr float Infinity = __builtin_inff();

/// Composites the open layers of the marked lanes over what is finished and empties them.
SURFELSPLATTING_INLINE void CloseLayers(PixelBlock& b, const LaneMask& close)
{
  Lanes coverage = b.Weight, divisor = b.Weight;
  Max(coverage, Lanes{} + 1.0f);
  Max(divisor, Lanes{} + 1e-30f);
  const Lanes depth = b.Depth / divisor;
  // A layer behind an opaque prop contributes nothing.
  const LaneMask visible = close & (depth <= b.Limit);
  const Lanes before = b.Transmittance;
  const Lanes share = visible ? before / coverage : Lanes{};
  b.OutRed += share * b.Red;
  b.OutGreen += share * b.Green;
  b.OutBlue += share * b.Blue;
  Lanes after = before - share * b.Opacity;
  Max(after, Lanes{});
  const LaneMask median = (before > 0.5f) & (after <= 0.5f);
  b.OutDepth = median ? depth : b.OutDepth;
  b.Transmittance = after;

  b.Near = close ? Lanes{} + Infinity : b.Near;
  b.Far = close ? Lanes{} - Infinity : b.Far;
  b.Weight = close ? Lanes{} : b.Weight;
  b.Opacity = close ? Lanes{} : b.Opacity;
  b.Red = close ? Lanes{} : b.Red;
  b.Green = close ? Lanes{} : b.Green;
  b.Blue = close ? Lanes{} : b.Blue;
  b.Depth = close ? Lanes{} : b.Depth;
}

/// A splat's footprint over a row of a tile, in columns of the tile.
struct RowSpan
{
  float Offset; ///< u = column + Offset, so that q = A u^2 + Q0
  float Q0;
  float Depth0; ///< depth at column 0
  int BlockBegin, BlockEnd;
};

/// The kernel at q, 1 at q = 0 (ResamplingKernel.h); anything where q >= support.
SURFELSPLATTING_INLINE void EvaluateKernel(float shape, const Lanes& q, float support, Lanes& k)
{
  if (shape < 0.0f)
  {
    k = 0.5f * q;
    Min(k, Lanes{} + 80.0f);
    ExpOfMinus(k);
    return;
  }
  k = 1.0f - q * (1.0f / support);
  Max(k, Lanes{});
  if (shape == 0.0f)
  {
    k = Lanes{} + 1.0f;
  }
  else if (shape == 2.0f)
  {
    k *= k;
  }
  else if (shape == 3.0f)
  {
    k *= k * k;
  }
  else if (shape == 4.0f)
  {
    k *= k;
    k *= k;
  }
  else if (shape < 1.0f)
  {
    Sqrt(k);
    if (shape < 0.5f)
    {
      Sqrt(k);
    }
  }
}

/// Adds a splat to eight pixels, closing first the layers that end before it begins.
SURFELSPLATTING_INLINE void AddToBlock(PixelBlock& b, int index, const Splat& s, const RowSpan& row,
  const Lanes& column, float support, LaneMask& fragments, const CloseCallback& callback)
{
  const Lanes u = column + row.Offset;
  const Lanes q = s.A * u * u + row.Q0;
  const LaneMask inside = q < support;
  if (!Any(inside))
  {
    return;
  }
  fragments -= inside;
  Lanes weight;
  EvaluateKernel(s.Shape, q, support, weight);
  weight = inside ? s.Weight * weight : Lanes{};

  const LaneMask ended = inside & (b.Weight > 0.0f) & (b.Far < s.Near);
  if (Any(ended))
  {
    if (callback.Function)
    {
      callback.Function(callback.User, b, index, ended);
    }
    CloseLayers(b, ended);
  }

  Lanes near = b.Near, far = b.Far;
  Min(near, Lanes{} + s.Near);
  Max(far, Lanes{} + s.Far);
  b.Near = inside ? near : b.Near;
  b.Far = inside ? far : b.Far;
  const Lanes opaque = weight * s.Opacity;
  b.Weight += weight;
  b.Opacity += opaque;
  b.Red += opaque * s.Red;
  b.Green += opaque * s.Green;
  b.Blue += opaque * s.Blue;
  b.Depth += weight * (row.Depth0 + s.DepthX * column);
}

/// NaN becomes low: no pixel outside of the tile is ever touched.
SURFELSPLATTING_INLINE float Clamp(float x, float low, float high)
{
  return x > low ? (x < high ? x : high) : low;
}

std::uint64_t AddSplat(PixelBlock* blocks, const Splat& s, int rowBegin, int rowEnd, float x,
  float y, float support, const CloseCallback& callback)
{
  const Lanes ramp = { 0, 1, 2, 3, 4, 5, 6, 7 };
  LaneMask fragments = {};
  for (int j = rowBegin; j < rowEnd; ++j)
  {
    const float dy = static_cast<float>(j) + 0.5f - y;
    const float q0 = s.B * dy * dy;
    if (!(q0 < support))
    {
      continue;
    }
    // u = dx + K dy with dx = column + 1/2 - x; inside where |u| < sqrt((support - q0) / A).
    RowSpan row;
    row.Offset = 0.5f - x + s.K * dy;
    row.Q0 = q0;
    row.Depth0 = s.Depth + s.DepthX * (0.5f - x) + s.DepthY * dy;
    const float half = __builtin_sqrtf((support - q0) / s.A);
    row.BlockBegin = static_cast<int>(Clamp(-row.Offset - half, 0.0f, TileSize)) / LaneCount;
    row.BlockEnd =
      (static_cast<int>(Clamp(-row.Offset + half, -1.0f, TileSize - 1.0f) + 1.0f) + LaneCount - 1) /
      LaneCount;
    for (int i = row.BlockBegin; i < row.BlockEnd; ++i)
    {
      const int index = j * BlocksPerRow + i;
      AddToBlock(blocks[index], index, s, row, ramp + static_cast<float>(i * LaneCount), support,
        fragments, callback);
    }
  }
  std::uint64_t sum = 0;
  for (int l = 0; l < LaneCount; ++l)
  {
    sum += static_cast<std::uint32_t>(fragments[l]);
  }
  return sum;
}

void CloseAll(PixelBlock* blocks)
{
  for (int i = 0; i < BlocksPerTile; ++i)
  {
    CloseLayers(blocks[i], LaneMask{} - 1);
  }
}
}
}
