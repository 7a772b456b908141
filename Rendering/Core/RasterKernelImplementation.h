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

/// out += share times the sum, clamped to [0, largest].
SURFELSPLATTING_INLINE void AddClamped(
  Lanes& out, const Lanes& share, Lanes sum, const Lanes& largest)
{
  Max(sum, Lanes{});
  Min(sum, largest);
  out += share * sum;
}

/// Composites the open layers of the marked lanes over what is finished and empties them.
SURFELSPLATTING_INLINE void CloseLayers(
  PixelBlock& b, const LaneMask& close, const RasterSettings& settings)
{
  Lanes coverage = b.Weight, divisor = b.Weight;
  Max(coverage, Lanes{} + 1.0f);
  Max(divisor, Lanes{} + 1e-30f);
  const Lanes depth = b.Depth / divisor;
  // A layer behind an opaque prop contributes nothing.
  const LaneMask visible = close & (depth <= b.Limit);
  const Lanes before = b.Transmittance;
  const Lanes share = visible ? before / coverage : Lanes{};
  const Lanes limited = visible ? b.Weight / coverage : Lanes{};
  Lanes conflict = b.Covered;
  Min(conflict, 1.0f - b.Covered);
  conflict *= before > 0.0f ? limited : Lanes{};
  Max(conflict, visible ? before * (1.0f - MostRipple / coverage) : Lanes{});
  Max(b.Conflict, conflict);
  b.Covered += (1.0f - b.Covered) * limited;
  const Lanes brightest = settings.LargestColor * b.Opacity;
  AddClamped(b.OutRed, share, b.Red, brightest);
  AddClamped(b.OutGreen, share, b.Green, brightest);
  AddClamped(b.OutBlue, share, b.Blue, brightest);
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
  float Depth0;              ///< depth at column 0
  float Red0, Green0, Blue0; ///< colour gradient at column 0
  int BlockBegin, BlockEnd;
  // Of a sector of the lens: what multiplies the weight, at column 0 and per column.
  float Share0, ShareX; ///< f(s_x u_x) before it is clamped
  float ShareOfRow;     ///< 4 f(s_y u_y)
  float Tilt0;
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
  if (shape >= 16.0f)
  {
    k *= shape - 16.0f;
    Min(k, Lanes{} + 1.0f);
    k *= k * (3.0f - 2.0f * k);
  }
  else if (shape == 0.0f)
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

/// The kernel at q and its slope d = phi k without its constant (ResamplingKernel.h).
SURFELSPLATTING_INLINE void EvaluateSlope(
  float shape, const Lanes& q, float support, Lanes& k, Lanes& d)
{
  if (shape < 0.0f)
  {
    k = 0.5f * q;
    Min(k, Lanes{} + 80.0f);
    ExpOfMinus(k);
    d = k;
    return;
  }
  const Lanes s = 1.0f - q * (1.0f / support);
  if (shape >= 16.0f)
  {
    Lanes u = s * (shape - 16.0f);
    Max(u, Lanes{});
    Min(u, Lanes{} + 1.0f);
    k = u * u * (3.0f - 2.0f * u);
    d = u * (1.0f - u);
    return;
  }
  d = s;
  if (shape == 3.0f)
  {
    d = s * s;
  }
  else if (shape == 4.0f)
  {
    d = s * s * s;
  }
  k = s * d;
}

/// Makes the open layers of eight pixels ready for a splat: closes those that end before it begins,
/// and widens the others' z-ranges.
SURFELSPLATTING_INLINE void OpenLayers(PixelBlock& b, int index, const Splat& s,
  const LaneMask& inside, const RasterSettings& settings, const CloseCallback& callback)
{
  const LaneMask ended = inside & (b.Weight > 0.0f) & (b.Far < s.Near);
  if (Any(ended))
  {
    if (callback.Function)
    {
      callback.Function(callback.User, b, index, ended);
    }
    CloseLayers(b, ended, settings);
  }
  Lanes near = b.Near, far = b.Far;
  Min(near, Lanes{} + s.Near);
  Max(far, Lanes{} + s.Far);
  b.Near = inside ? near : b.Near;
  b.Far = inside ? far : b.Far;
}

/// Factor of the weight in a sector of the lens (LensSectors.h).
SURFELSPLATTING_INLINE void EvaluateSector(
  const LensSlope& slope, const RowSpan& row, const Lanes& column, Lanes& factor)
{
  factor = row.Share0 + row.ShareX * column;
  Max(factor, Lanes{});
  Min(factor, Lanes{} + 1.0f);
  Lanes tilt = row.Tilt0 + slope.TiltX * column;
  Max(tilt, Lanes{});
  factor *= row.ShareOfRow * tilt;
}

/// Adds a splat to eight pixels.
template <bool HasGradient, bool InSector>
SURFELSPLATTING_INLINE void AddToBlock(PixelBlock& b, int index, const Splat& s,
  const SplatGradient* g, const LensSlope* l, const RowSpan& row, const Lanes& column,
  const RasterSettings& settings, LaneMask& fragments, const CloseCallback& callback)
{
  const Lanes u = column + row.Offset;
  const Lanes q = s.A * u * u + row.Q0;
  LaneMask inside = q < settings.Support;
  Lanes share;
  if (InSector)
  {
    EvaluateSector(*l, row, column, share);
    inside &= share > 0.0f;
  }
  if (!Any(inside))
  {
    return;
  }
  fragments -= inside;
  Lanes weight, slope = {};
  if (HasGradient)
  {
    EvaluateSlope(s.Shape, q, settings.Support, weight, slope);
  }
  else
  {
    EvaluateKernel(s.Shape, q, settings.Support, weight);
  }
  if (InSector)
  {
    weight *= share;
    slope *= share;
  }
  weight = inside ? s.Weight * weight : Lanes{};
  OpenLayers(b, index, s, inside, settings, callback);
  const Lanes opaque = weight * s.Opacity;
  b.Weight += weight;
  b.Opacity += opaque;
  if (HasGradient)
  {
    const Lanes tilt = inside ? (s.Weight * s.Opacity) * slope : Lanes{};
    b.Red += opaque * s.Red + tilt * (row.Red0 + g->RedX * column);
    b.Green += opaque * s.Green + tilt * (row.Green0 + g->GreenX * column);
    b.Blue += opaque * s.Blue + tilt * (row.Blue0 + g->BlueX * column);
  }
  else
  {
    b.Red += opaque * s.Red;
    b.Green += opaque * s.Green;
    b.Blue += opaque * s.Blue;
  }
  b.Depth += weight * (row.Depth0 + s.DepthX * column);
}

/// Adds a tent's row to eight pixels: a cell of a coarse grid, interpolated.
SURFELSPLATTING_INLINE void AddTentToBlock(PixelBlock& b, int index, const Splat& s, float x,
  float weightOfRow, const Lanes& column, const RasterSettings& settings, LaneMask& fragments,
  const CloseCallback& callback)
{
  Lanes distance = column + (0.5f - x);
  distance = distance < 0.0f ? -distance : distance;
  Lanes weight = weightOfRow * (1.0f - s.A * distance);
  const LaneMask inside = weight > 0.0f;
  if (!Any(inside))
  {
    return;
  }
  fragments -= inside;
  weight = inside ? weight : Lanes{};
  OpenLayers(b, index, s, inside, settings, callback);
  const Lanes opaque = weight * s.Opacity;
  b.Weight += weight;
  b.Opacity += opaque;
  b.Red += opaque * s.Red;
  b.Green += opaque * s.Green;
  b.Blue += opaque * s.Blue;
  b.Depth += weight * s.B;
}

/// NaN becomes low: no pixel outside of the tile is ever touched.
SURFELSPLATTING_INLINE float Clamp(float x, float low, float high)
{
  return x > low ? (x < high ? x : high) : low;
}

SURFELSPLATTING_INLINE std::uint64_t Sum(const LaneMask& counts)
{
  std::uint64_t sum = 0;
  for (int l = 0; l < LaneCount; ++l)
  {
    sum += static_cast<std::uint32_t>(counts[l]);
  }
  return sum;
}

/// Of a row's span, what a sector of the lens takes; false: nothing.
SURFELSPLATTING_INLINE bool EnterSector(
  const LensSlope& slope, const LensSector& sector, float x, float dy, RowSpan& row)
{
  const float dx0 = 0.5f - x;
  row.ShareX = sector.X * slope.Point;
  row.Share0 = 0.5f + row.ShareX * dx0;
  row.ShareOfRow = 4.0f * Clamp(0.5f + sector.Y * slope.Point * dy, 0.0f, 1.0f);
  row.Tilt0 = 1.0f + slope.TiltX * dx0 + slope.TiltY * dy;
  return row.ShareOfRow > 0.0f;
}

template <bool HasGradient, bool InSector>
SURFELSPLATTING_INLINE std::uint64_t AddRows(PixelBlock* blocks, const Splat& s,
  const SplatGradient* g, const LensSlope* l, int rowBegin, int rowEnd, float x, float y,
  const RasterSettings& settings, const CloseCallback& callback)
{
  const float depth = 0.5f * (s.Near + s.Far);
  const Lanes ramp = { 0, 1, 2, 3, 4, 5, 6, 7 };
  LaneMask fragments = {};
  for (int j = rowBegin; j < rowEnd; ++j)
  {
    const float dy = static_cast<float>(j) + 0.5f - y;
    const float q0 = s.B * dy * dy;
    if (!(q0 < settings.Support))
    {
      continue;
    }
    // u = dx + K dy with dx = column + 1/2 - x; inside where |u| < sqrt((Support - q0) / A).
    RowSpan row;
    row.Offset = 0.5f - x + s.K * dy;
    row.Q0 = q0;
    if (InSector && !EnterSector(*l, settings.Sector, x, dy, row))
    {
      continue;
    }
    if (HasGradient)
    {
      row.Red0 = g->RedX * (0.5f - x) + g->RedY * dy;
      row.Green0 = g->GreenX * (0.5f - x) + g->GreenY * dy;
      row.Blue0 = g->BlueX * (0.5f - x) + g->BlueY * dy;
    }
    row.Depth0 = depth + s.DepthX * (0.5f - x) + s.DepthY * dy;
    const float half = __builtin_sqrtf((settings.Support - q0) / s.A);
    row.BlockBegin = static_cast<int>(Clamp(-row.Offset - half, 0.0f, TileSize)) / LaneCount;
    row.BlockEnd =
      (static_cast<int>(Clamp(-row.Offset + half, -1.0f, TileSize - 1.0f) + 1.0f) + LaneCount - 1) /
      LaneCount;
    for (int i = row.BlockBegin; i < row.BlockEnd; ++i)
    {
      const int index = j * BlocksPerRow + i;
      AddToBlock<HasGradient, InSector>(blocks[index], index, s, g, l, row,
        ramp + static_cast<float>(i * LaneCount), settings, fragments, callback);
    }
  }
  return Sum(fragments);
}

std::uint64_t AddTent(PixelBlock* blocks, const Splat& s, int rowBegin, int rowEnd, float x,
  float y, const RasterSettings& settings, const CloseCallback& callback)
{
  const Lanes ramp = { 0, 1, 2, 3, 4, 5, 6, 7 };
  LaneMask fragments = {};
  const float reach = 1.0f / s.A;
  const int blockBegin = static_cast<int>(Clamp(x - reach, 0.0f, TileSize)) / LaneCount;
  const int blockEnd =
    (static_cast<int>(Clamp(x + reach, 0.0f, TileSize)) + LaneCount - 1) / LaneCount;
  for (int j = rowBegin; j < rowEnd; ++j)
  {
    const float distance = __builtin_fabsf(static_cast<float>(j) + 0.5f - y);
    const float weight = s.Weight * (1.0f - s.A * distance);
    for (int i = blockBegin; weight > 0.0f && i < blockEnd; ++i)
    {
      const int index = j * BlocksPerRow + i;
      AddTentToBlock(blocks[index], index, s, x, weight, ramp + static_cast<float>(i * LaneCount),
        settings, fragments, callback);
    }
  }
  return Sum(fragments);
}

std::uint64_t AddSplat(PixelBlock* blocks, const Splat& s, const SplatGradient* g,
  const LensSlope* l, int rowBegin, int rowEnd, float x, float y, const RasterSettings& settings,
  const CloseCallback& callback)
{
  if (s.Shape == -2.0f) // TentShape
  {
    return AddTent(blocks, s, rowBegin, rowEnd, x, y, settings, callback);
  }
  if (l)
  {
    return g ? AddRows<true, true>(blocks, s, g, l, rowBegin, rowEnd, x, y, settings, callback)
             : AddRows<false, true>(blocks, s, g, l, rowBegin, rowEnd, x, y, settings, callback);
  }
  return g ? AddRows<true, false>(blocks, s, g, l, rowBegin, rowEnd, x, y, settings, callback)
           : AddRows<false, false>(blocks, s, g, l, rowBegin, rowEnd, x, y, settings, callback);
}

bool IsOpaque(const PixelBlock* blocks, float near)
{
  for (int i = 0; i < BlocksPerTile; ++i)
  {
    const PixelBlock& b = blocks[i];
    // Behind another prop, unless an open layer could still be joined.
    const LaneMask hidden = (b.Limit < near) & (b.Weight <= 0.0f);
    if (Any((b.Transmittance > LeastTransmittance) & ~hidden))
    {
      return false;
    }
  }
  return true;
}

void CloseAll(PixelBlock* blocks, const RasterSettings& settings)
{
  for (int i = 0; i < BlocksPerTile; ++i)
  {
    CloseLayers(blocks[i], LaneMask{} - 1, settings);
  }
}
}
}
