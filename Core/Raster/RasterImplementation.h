// SPDX-License-Identifier: BSD-3-Clause
/**
 * The loops of RasterTarget.h; included once for each instruction set. A splat goes block by block
 * through its kernel (KernelEvaluation.h) into the layers of the pixels (LayerMerging.h).
 */
#include "Core/Raster/BlockPixels.h"
#include "Core/Raster/GaussianLayers.h"
#include "Core/Raster/KernelEvaluation.h"
#include "Core/Raster/LayerMerging.h"
#include "Core/Raster/RasterTarget.h"

namespace SurfelSplatting
{
namespace
{
/// For the z-buffer: depth of the splat's plane behind its centre, limited to +- the splat's size,
/// the length of its z-range.
SURFELSPLATTING_INLINE Lanes EvaluatePlane(const Splat& s, const BlockPixels& d)
{
  const float range = s.Far - s.Near;
  return Smaller(Larger(s.DepthX * d.X + s.DepthY * d.Y, -range), range);
}

/// Adds a splat to the depths of the z-buffer: its plane, farther by half its z-range. Its inner
/// part hides, so that tails at silhouettes do not.
SURFELSPLATTING_INLINE void AddDepths(
  OpenLayers& open, const SplatCopy& splat, const BlockPixels& d)
{
  const Lanes far = Lanes::Load(open.Far);
  Select(d.Q < 0.35f * splat.Settings.Support,
    Smaller(far, splat.S.Far + EvaluatePlane(splat.S, d)), far)
    .Store(open.Far);
}

/// Colours of a block's fragments times their weights.
struct WeightedColors
{
  Lanes Red, Green, Blue;
};

SURFELSPLATTING_INLINE void AddColors(OpenLayers& open, const WeightedColors& c)
{
  AddTo(open.Red, c.Red);
  AddTo(open.Green, c.Green);
  AddTo(open.Blue, c.Blue);
}

/// Adds what a coarse grid's cell needs besides (Tent.h).
SURFELSPLATTING_INLINE void AddCoarse(CoarseLayers& coarse, const Lanes& weight, const Splat& s,
  const Lanes& depth, const WeightedColors& c, const LensPoints& u)
{
  AddTo(coarse.RedX, c.Red * u.X);
  AddTo(coarse.RedY, c.Red * u.Y);
  AddTo(coarse.GreenX, c.Green * u.X);
  AddTo(coarse.GreenY, c.Green * u.Y);
  AddTo(coarse.BlueX, c.Blue * u.X);
  AddTo(coarse.BlueY, c.Blue * u.Y);
  const Lanes opaque = weight * s.Opacity;
  AddTo(coarse.XX, opaque * u.X * u.X);
  AddTo(coarse.XY, opaque * u.X * u.Y);
  AddTo(coarse.YY, opaque * u.Y * u.Y);
  // Layers that are empty have no near depth yet.
  const Lanes z = Select(weight > 0.0f, depth - Lanes::Load(coarse.Near), 0.0f);
  AddTo(coarse.SquaredDepth, weight * z * z);
  AddTo(coarse.HalfRange, weight * (0.5f * (s.Far - s.Near)));
}

/// The share of a splat's weight that passes the lens where its fragments do (LensFootprint).
template <bool OnLens>
SURFELSPLATTING_INLINE Lanes EvaluateArea(const LensFootprint& lens, const BlockPixels& d)
{
  if (!OnLens)
  {
    return 1.0f;
  }
  const Lanes area = lens.Area + lens.AreaX * d.X + lens.AreaY * d.Y;
  return Larger(area, 0.0f - lens.Back * area);
}

/// The layers of coarse grids end at once: all of the range keeps them together.
/// @param share of the splat's weight
template <RasterPass Pass>
SURFELSPLATTING_INLINE Lanes EvaluateReach(const Lanes& share)
{
  return Pass == RasterPass::Collect ? Lanes(1.0f) : Smaller(share * (1.0f / FullReach), 1.0f);
}

/// Adds a splat to a block; returns the lanes that it covers.
template <bool HasGradient, bool OnLens, RasterPass Pass>
SURFELSPLATTING_INLINE unsigned int AddToBlock(PixelTile& tile, int block, const SplatCopy& splat,
  const BlockPixels& d, const RasterCallbacks& callbacks)
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
  const LensFootprint& lens = splat.Footprint;
  const Lanes area = EvaluateArea<OnLens>(lens, d);
  if (Pass != RasterPass::Nearest)
  {
    PrepareLayers<Pass>(tile, block, { s.Near, s.Far },
      { inside, EvaluateReach<Pass>(kernel * area) }, splat.Settings, callbacks);
  }
  const LensPoints u{ lens.MeanX + lens.PerPixel * d.X, lens.MeanY + lens.PerPixel * d.Y };
  constexpr float full = Pass == RasterPass::Collect ? FullOnCoarseGrid
    : OnLens                                         ? FullThroughLens
                                                     : FullInFocus;
  const Lanes room = Room<OnLens>(tile, block, u, full);
  // Lanes outside of the support may hold anything.
  const Lanes weight = Select(inside, s.Weight * kernel * area * room, 0.0f);
  const Lanes depth = 0.5f * (s.Near + s.Far) + s.DepthX * d.X + s.DepthY * d.Y;
  const Lanes visible = AddCoverage<OnLens>(tile, block, weight, s.Opacity, depth, u);
  WeightedColors c{ visible * s.Red, visible * s.Green, visible * s.Blue };
  if (HasGradient)
  {
    const SplatGradient& g = splat.Gradient;
    const Lanes tilt = Select(inside, visible * slope / Larger(kernel, 1e-30f), 0.0f);
    c.Red += tilt * (g.RedX * d.X + g.RedY * d.Y);
    c.Green += tilt * (g.GreenX * d.X + g.GreenY * d.Y);
    c.Blue += tilt * (g.BlueX * d.X + g.BlueY * d.Y);
  }
  AddColors(open, c);
  if (Pass == RasterPass::Collect)
  {
    AddCoarse(tile.Coarse[block], weight, s, depth, c, u);
  }
  return bits;
}

alignas(
  64) constexpr float Ramp[LaneCount] = { 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15 };

/// First pixel of a column or row of blocks.
constexpr float FirstPixel[BlocksPerRow] = { 0, 4, 8, 12, 16, 20, 24, 28 };
static_assert(BlockSize == 4 && BlocksPerRow == 8, "FirstPixel has these");

/// Bits [begin, end) of a row of blocks; 0 <= begin, end <= BlocksPerRow.
SURFELSPLATTING_INLINE std::uint64_t BlocksBetween(unsigned int begin, unsigned int end)
{
  constexpr unsigned int all = (1u << BlocksPerRow) - 1;
  return all & (all << begin) & (all >> (BlocksPerRow - end));
}

/// Bit i: a span of the tile's pixels touches block i.
SURFELSPLATTING_INLINE std::uint64_t BlocksOf(const PixelBox& span)
{
  if (span.X0 >= span.X1 || span.Y0 >= span.Y1)
  {
    return 0; // and shifts of 64 bits are undefined
  }
  const auto block = [](int pixel) { return static_cast<unsigned int>(pixel) / BlockSize; };
  const std::uint64_t columns = BlocksBetween(block(span.X0), block(span.X1 + BlockSize - 1));
  constexpr std::uint64_t all = ~std::uint64_t{ 0 }, firstOfRows = all / ((1u << BlocksPerRow) - 1);
  const unsigned int below = BlocksPerRow * block(span.Y0);
  const unsigned int above = BlocksPerTile - BlocksPerRow * block(span.Y1 + BlockSize - 1);
  return (columns * firstOfRows) & (all << below) & (all >> above);
}

/// Blocks between the support's ends, |dx + K dy| < sqrt((support - B dy^2) / A), in any of a
/// block's four rows of pixels; sixteen rows of pixels at a time.
SURFELSPLATTING_INLINE std::uint64_t BlocksInSupport(
  const Splat& s, const TilePlace& place, float support)
{
  constexpr int rowsOfBlocks = LaneCount / BlockSize;
  // For rounding. NaN becomes the whole row or nothing: no pixel outside of the tile is touched.
  constexpr float margin = 1.0f / 16.0f;
  const float across = 1.0f / s.A;
  std::uint64_t blocks = 0;
  for (int j = place.Span.Y0 / LaneCount * rowsOfBlocks; j * BlockSize < place.Span.Y1;
       j += rowsOfBlocks)
  {
    const Lanes dy = Lanes::Load(Ramp) + (static_cast<float>(j * BlockSize) + 0.5f - place.Y);
    const Lanes half = SquareRoot(Larger(support - s.B * dy * dy, 0.0f) * across) + margin;
    const Lanes center = (place.X - 0.5f) - s.K * dy;
    alignas(64) float low[LaneCount], high[LaneCount];
    Smaller(SmallestOfFour(Larger(center - half, 0.0f)), TileSize).Store(low);
    Larger(Smaller(LargestOfFour(center + half), TileSize - 1.0f), -1.0f).Store(high);
    for (int i = 0; i < rowsOfBlocks; ++i)
    {
      const unsigned int begin = static_cast<unsigned int>(low[i * BlockSize]) / BlockSize;
      const unsigned int end =
        static_cast<unsigned int>(high[i * BlockSize] + BlockSize) / BlockSize;
      blocks |= BlocksBetween(begin, end) << ((j + i) * BlocksPerRow);
    }
  }
  return blocks;
}

/// Narrower spans are not worth narrowing.
constexpr int FewPixels = 3 * BlockSize;

/// How a splat's blocks are added.
enum class BlockKind
{
  Surfel,
  Gaussian ///< in space
};

template <bool HasGradient, bool OnLens, RasterPass Pass, BlockKind Kind = BlockKind::Surfel>
std::uint64_t AddBlocks(PixelTile& tile, const SplatData& splat, const TilePlace& place,
  const RasterSettings& shared, const RasterCallbacks& callbacks)
{
  // Copies, because the compiler must assume that writes to the tile can change the originals.
  const Splat s = splat.Body;
  const SplatGradient gradient = HasGradient ? *splat.Gradient : SplatGradient{};
  const LensFootprint footprint = OnLens ? *splat.Footprint : LensFootprint{};
  const RasterSettings settings = shared;
  const SplatCopy copy{ s, gradient, footprint, settings };
  const PixelBox& span = place.Span;
  const Lanes rampX = Lanes::Load(RampX) + (0.5f - place.X);
  const Lanes rampY = Lanes::Load(RampY) + (0.5f - place.Y);
  std::uint64_t blocks = BlocksOf(span) & ~(settings.SkipHidden ? tile.Opaque : 0);
  if (span.X1 - span.X0 > FewPixels)
  {
    blocks &= BlocksInSupport(s, place, Kind == BlockKind::Gaussian ? s.DepthX : settings.Support);
  }
  std::uint64_t fragments = 0;
  for (; blocks != 0; blocks &= blocks - 1)
  {
    const int block = __builtin_ctzll(blocks);
    const Lanes dx = rampX + FirstPixel[block % BlocksPerRow];
    const Lanes dy = rampY + FirstPixel[block / BlocksPerRow];
    const Lanes u = dx + s.K * dy;
    const BlockPixels d{ dx, dy, s.A * u * u + s.B * dy * dy };
    const unsigned int lanes = Kind == BlockKind::Gaussian
      ? AddGaussianToBlock<OnLens>(tile, block, copy, d, callbacks)
      : AddToBlock<HasGradient, OnLens, Pass>(tile, block, copy, d, callbacks);
    fragments += static_cast<std::uint64_t>(__builtin_popcount(lanes));
  }
  return fragments;
}

/// Adds a tent to a block, seen through the linear reconstruction of T over all of its lens points.
SURFELSPLATTING_INLINE void AddTentToBlock(
  PixelTile& tile, int block, const Tent& s, const Lanes& weight)
{
  OpenLayers& open = tile.Open[block];
  LensLayers& lens = tile.Lens[block];
  const FinishedLayers& done = tile.Finished[block];
  const LensPoints u{ s.PointX, s.PointY };
  // A tent may be as heavy as a layer: what has no room is cut off.
  const Lanes fill = Lanes::Load(open.Weight) + LinearPart(lens.FillX, lens.FillY, u);
  const Lanes left = Larger(FullThroughLens - fill, 0.0f);
  const Lanes added = Smaller(weight, left) * RoomInLayer(fill, FullThroughLens);
  const Lanes visible = AddCoverage<true>(tile, block, added, s.Opacity, s.Depth, u);
  WeightedColors c{ visible * s.Red, visible * s.Green, visible * s.Blue };
  if (IsTilted(tile, block))
  {
    const Lanes opaque = (4.0f * s.Opacity) * added;
    const Lanes x = opaque * Lanes::Load(done.ThroughX), y = opaque * Lanes::Load(done.ThroughY);
    c.Red += x * s.RedX + y * s.RedY;
    c.Green += x * s.GreenX + y * s.GreenY;
    c.Blue += x * s.BlueX + y * s.BlueY;
    AddTo(lens.SeenX, x * s.XX + y * s.XY);
    AddTo(lens.SeenY, x * s.XY + y * s.YY);
  }
  AddColors(open, c);
}

/// Adds a cell of a coarse grid, interpolated.
std::uint64_t AddTent(PixelTile& tile, const Tent& tent, const TilePlace& place,
  const RasterSettings& shared, const RasterCallbacks& callbacks)
{
  const Tent s = tent; // copies, as in AddBlocks
  const RasterSettings settings = shared;
  const Lanes rampX = Lanes::Load(RampX) + (0.5f - place.X);
  const Lanes rampY = Lanes::Load(RampY) + (0.5f - place.Y);
  const float perWeight = 1.0f / s.Weight;
  std::uint64_t fragments = 0;
  for (std::uint64_t blocks = BlocksOf(place.Span) & ~(settings.SkipHidden ? tile.Opaque : 0);
       blocks != 0; blocks &= blocks - 1)
  {
    const int block = __builtin_ctzll(blocks);
    const Lanes dx = rampX + FirstPixel[block % BlocksPerRow];
    const Lanes dy = rampY + FirstPixel[block / BlocksPerRow];
    const Lanes across = 1.0f - s.InverseCell * Larger(dx, 0.0f - dx);
    const Lanes weightOfRow = s.Weight * (1.0f - s.InverseCell * Larger(dy, 0.0f - dy));
    const LaneMask inside = (weightOfRow > 0.0f) & (across > 0.0f);
    const unsigned int bits = inside.ToBits();
    if (bits == 0)
    {
      continue;
    }
    fragments += static_cast<std::uint64_t>(__builtin_popcount(bits));
    const Lanes weight = Select(inside, weightOfRow * across, 0.0f);
    const Lanes reach = EvaluateReach<RasterPass::Layers>(weight * perWeight);
    PrepareLayers<RasterPass::Layers>(
      tile, block, { s.Near, s.Far }, { inside, reach }, settings, callbacks);
    AddTentToBlock(tile, block, s, weight);
  }
  return fragments;
}

/// Chooses the loop that has only what the splat needs.
template <RasterPass Pass>
std::uint64_t AddChosen(PixelTile& tile, const SplatData& splat, const TilePlace& place,
  const RasterSettings& settings, const RasterCallbacks& callbacks)
{
  if (splat.Footprint)
  {
    return splat.Gradient ? AddBlocks<true, true, Pass>(tile, splat, place, settings, callbacks)
                          : AddBlocks<false, true, Pass>(tile, splat, place, settings, callbacks);
  }
  return splat.Gradient ? AddBlocks<true, false, Pass>(tile, splat, place, settings, callbacks)
                        : AddBlocks<false, false, Pass>(tile, splat, place, settings, callbacks);
}

std::uint64_t AddSplat(PixelTile& tile, const SplatData& splat, const TilePlace& place,
  const RasterSettings& settings, const RasterCallbacks& callbacks)
{
  switch (settings.Pass)
  {
    case RasterPass::Layers:
      return AddChosen<RasterPass::Layers>(tile, splat, place, settings, callbacks);
    case RasterPass::Collect:
      return AddChosen<RasterPass::Collect>(tile, splat, place, settings, callbacks);
    case RasterPass::Depths:
      return AddBlocks<false, false, RasterPass::Depths>(tile, splat, place, settings, callbacks);
    case RasterPass::Nearest:
      break;
  }
  const SplatData sharp{ splat.Body, splat.Gradient, nullptr };
  return AddChosen<RasterPass::Nearest>(tile, sharp, place, settings, callbacks);
}

std::uint64_t AddGaussian(PixelTile& tile, const SplatData& splat, const TilePlace& place,
  const RasterSettings& settings, const RasterCallbacks& callbacks)
{
  constexpr RasterPass pass = RasterPass::Layers;
  return splat.Footprint
    ? AddBlocks<false, true, pass, BlockKind::Gaussian>(tile, splat, place, settings, callbacks)
    : AddBlocks<false, false, pass, BlockKind::Gaussian>(tile, splat, place, settings, callbacks);
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
  const LaneMask ended = Lanes::Load(open.Far) < near - gap * LeakBand({ near, near }, settings);
  if (!Any(ended))
  {
    return done.ToBits();
  }
  const LayerCoverage<Lanes> layer = CoverageOf(tile, block, settings.LensRadius > 0.0f);
  const Lanes after = Leak(through, layer, Lanes(keep)).Through;
  return (Select(ended, after, through) <= MinTransmittance).ToBits();
}

void CloseAll(PixelTile& tile, const RasterSettings& settings, const RasterCallbacks& callbacks)
{
  for (int i = 0; i < BlocksPerTile; ++i)
  {
    if (settings.Pass == RasterPass::Collect)
    {
      CollectLayers(tile, i, AllLanes(), callbacks);
    }
    else
    {
      EndLayers(tile, i, settings, callbacks);
    }
  }
}
}
}
