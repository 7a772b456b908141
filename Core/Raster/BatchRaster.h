// SPDX-License-Identifier: BSD-3-Clause
/**
 * Adds a batch of splats and tents to a tile, one block after another: the open layers of a block
 * stay in registers while all that touches it is added. Each pixel gets its fragments in the order
 * of the batch, so the picture is that of adding one after another.
 *
 * Included by the translation units of the raster's targets (RasterTarget.h), whose own this code
 * is.
 */
#pragma once

#include "Core/Raster/BlockLayers.h"
#include "Core/Raster/BlockPixels.h"
#include "Core/Raster/BlocksOfSplats.h"
#include "Core/Raster/KernelEvaluation.h"
#include "Core/Raster/PreparedItem.h"
#include "Core/Raster/TentFragments.h"

namespace SurfelSplatting
{
namespace
{
/// What counts of fragments' weights for the length of their layers.
/// @param most weights @param kernel of p at them @param u 2 u, where they pass the lens
/// @param layer sum w before them
template <bool OnLens>
SURFELSPLATTING_INLINE Lanes ReachingWeight(const Lanes& most, const PreparedItem& p,
  const Lanes& kernel, const LensPoints& u, const Lanes& layer)
{
  if (!OnLens)
  {
    return most;
  }
  return most * ShareOfReach(p.PerCenter * kernel, layer) * ShareWithinRim(u.X * u.X + u.Y * u.Y);
}

/// Makes the layers of a splat's fragments longer.
/// @param begin BeginItem @param weight ReachingWeight, over RoomToFill
template <bool OnLens, RasterPass Pass>
SURFELSPLATTING_INLINE void Lengthen(BlockLayers<OnLens, Pass>& open, const ZRange& range,
  const Lanes& begin, const Lanes& weight, const LaneMask& inside)
{
  constexpr float perReach =
    RoomToFill<OnLens> / (Pass == RasterPass::Collect ? WeightOfReachInCell : WeightOfReach);
  const Lanes reach = perReach * weight;
  const Lanes longer = begin + reach * (range.Far - begin);
  open.Far = Select(inside, Larger(Smaller(longer, range.Far), begin), open.Far);
}

/// What fragments add to their layers: through a lens no more than there is room for.
/// @param most weights over RoomToFill @param room over UnitOfRoom
template <bool OnLens>
SURFELSPLATTING_INLINE Lanes LimitWeight(const Lanes& most, const Lanes& room)
{
  const Lanes left = Larger(room, 0.0f);
  const Lanes weight = most * Smaller(left, RoomToFill<OnLens>);
  return OnLens ? Smaller(weight, UnitOfRoom<OnLens> * left) : weight;
}

/// Adds the moments of a cell's depths (TwoSurfaces.h).
/// @param depth from the layer's near end on @param half half the length of the z-range
template <bool OnLens, RasterPass Pass>
SURFELSPLATTING_INLINE void AddDepthMoments(
  BlockLayers<OnLens, Pass>& open, const Lanes& weight, const Lanes& depth, float half)
{
  const Lanes squared = weight * depth * depth, cubed = squared * depth;
  open.SquaredDepth += squared;
  open.CubedDepth += cubed;
  open.FourthDepth += cubed * depth;
  open.HalfRange += weight * half;
}

/// Adds what a coarse grid's cell needs besides (Tent.h, TwoSurfaces.h).
/// @param depth behind the layer's near end
SURFELSPLATTING_INLINE void AddMoments(CoarseLayers& coarse, const Lanes& weight,
  const Lanes& opaque, const WeightedColors& c, const Lanes& depth, const LensPoints& twice)
{
  AddTo(coarse.OpacityDepth, opaque * depth);
  AddTo(coarse.RedDepth, c.Red * depth);
  AddTo(coarse.GreenDepth, c.Green * depth);
  AddTo(coarse.BlueDepth, c.Blue * depth);
  const LensPoints u{ 0.5f * twice.X, 0.5f * twice.Y };
  const Lanes far = weight * depth;
  AddTo(coarse.PointDepthX, far * u.X);
  AddTo(coarse.PointDepthY, far * u.Y);
  AddTo(coarse.RedX, c.Red * u.X);
  AddTo(coarse.RedY, c.Red * u.Y);
  AddTo(coarse.GreenX, c.Green * u.X);
  AddTo(coarse.GreenY, c.Green * u.Y);
  AddTo(coarse.BlueX, c.Blue * u.X);
  AddTo(coarse.BlueY, c.Blue * u.Y);
  const Lanes x = opaque * u.X, y = opaque * u.Y;
  AddTo(coarse.XX, x * u.X);
  AddTo(coarse.XY, x * u.Y);
  AddTo(coarse.YY, y * u.Y);
}

/// For the z-buffer: depth of the splat's plane behind its centre, limited to +- the splat's size,
/// the length of its z-range.
SURFELSPLATTING_INLINE Lanes EvaluatePlane(const BatchBlock& at, const BatchItem& item)
{
  const Splat& s = *item.Body;
  const float range = s.Far - s.Near;
  const Lanes dx = at.X - item.Place.X, dy = at.Y - item.Place.Y;
  return Smaller(Larger(s.DepthX * dx + s.DepthY * dy, -range), range);
}

/// @param x 1 - q / support
SURFELSPLATTING_INLINE Lanes EvaluateBell(const PreparedItem& p, const Lanes& x)
{
  const Lanes squared = x * x;
  return p.Edge * x + squared * (p.Square + p.Fourth * squared);
}

/// The kernel and its derivative d (KernelEvaluation.h) of an item.
/// @param x 1 - q / support
SURFELSPLATTING_INLINE Lanes EvaluateSlope(
  const PreparedItem& p, const Lanes& x, float support, Lanes& d)
{
  if (p.Kernel == ItemKernel::Smooth)
  {
    const Lanes u = Smaller(x * p.Steepness, 1.0f);
    d = u * (1.0f - u);
    return u * u * (3.0f - 2.0f * u);
  }
  if (p.Kernel == ItemKernel::Bell)
  {
    d = x;
    return EvaluateBell(p, x);
  }
  d = ExpOfMinus(Larger(Smaller((1.0f - x) * (0.5f * support), 80.0f), 0.0f));
  return d;
}

/// Adds the fragments of a splat to the z-buffer; true if that is all.
template <bool OnLens, RasterPass Pass>
SURFELSPLATTING_INLINE bool AddDepths(BlockLayers<OnLens, Pass>& open, const BatchBlock& at,
  const BatchItem& item, const Lanes& x, LaneMask& inside)
{
  if (Pass == RasterPass::Depths)
  {
    // Farther by half its z-range. Its inner part hides, so that tails at silhouettes do not.
    const Lanes far = item.Body->Far + EvaluatePlane(at, item);
    open.Far = Select(x > 0.65f, Smaller(open.Far, far), open.Far);
    return true;
  }
  if (Pass == RasterPass::Nearest)
  {
    inside = inside & (open.Far >= item.Body->Near + EvaluatePlane(at, item));
  }
  return false;
}

/// Adds the gradient of a splat to its colours. @param tilt derivative over kernel
SURFELSPLATTING_INLINE void AddGradient(
  const BatchBlock& at, const BatchItem& item, const Lanes& tilt, WeightedColors& c)
{
  const SplatGradient& g = *item.Gradient;
  const Lanes dx = at.X - item.Place.X, dy = at.Y - item.Place.Y;
  c.Red += tilt * (g.RedX * dx + g.RedY * dy);
  c.Green += tilt * (g.GreenX * dx + g.GreenY * dy);
  c.Blue += tilt * (g.BlueX * dx + g.BlueY * dy);
}

/// Adds a splat's fragments; returns the lanes that it covers.
/// @tparam Plain it has a bell and one colour
template <bool OnLens, RasterPass Pass, bool Plain>
SURFELSPLATTING_INLINE unsigned int AddSplatToBlock(
  BlockLayers<OnLens, Pass>& open, const BatchBlock& at, const PreparedItem& p)
{
  const Lanes across = p.U0 + p.UY * at.Y + p.UX * at.X, along = p.V0 + p.VY * at.Y;
  const Lanes x = (1.0f - along * along) - across * across;
  LaneMask inside = x > 0.0f;
  if (AddDepths(open, at, *p.Item, x, inside))
  {
    return 0;
  }
  const unsigned int bits = inside.ToBits();
  if (bits == 0)
  {
    return 0;
  }
  Lanes slope;
  const Lanes kernel = Plain ? EvaluateBell(p, x) : EvaluateSlope(p, x, at.Settings.Support, slope);
  Lanes peak = p.Weight;
  LensPoints u{ 0.0f, 0.0f };
  if (OnLens)
  {
    const Lanes front = p.Area + p.AreaY * at.Y + p.AreaX * at.X;
    peak = Larger(front, 0.0f - p.Back * front);
    u = { p.LensX + p.LensXY * at.Y + p.LensXX * at.X,
      p.LensY + p.LensYY * at.Y + p.LensYX * at.X };
  }
  const Lanes most = Select(inside, peak * kernel, 0.0f); // lanes outside may hold anything
  if (Pass != RasterPass::Nearest)
  {
    const ItemRange place{ p.Range, p.Range.Near };
    const Lanes begin = BeginItem(open, at, *p.Item, place, RoomToFill<OnLens> * most, inside);
    Lengthen(open, p.Range, begin, ReachingWeight<OnLens>(most, p, kernel, u, open.Weight), inside);
  }
  const Lanes weight = LimitWeight<OnLens>(most, FindRoom(open, u, 1.0f + Ripple<OnLens>));
  Lanes depth = p.Depth + p.DepthY * at.Y + p.DepthX * at.X;
  if (Pass == RasterPass::Collect)
  {
    open.Near = Select(inside, Smaller(open.Near, p.Range.Near), open.Near);
    // Layers that are empty have no near depth yet.
    depth = Select(inside, depth - open.Near, 0.0f);
  }
  const Lanes visible = AddCoverage(
    open, at, { weight, p.Opacity, depth, u }, [&] { return SquaresAt(u.X, u.Y, p.Share); });
  WeightedColors c{ p.Red, p.Green, p.Blue };
  if (!Plain && p.Item->Gradient)
  {
    AddGradient(at, *p.Item, slope / Larger(kernel, 1e-30f), c);
  }
  open.Red += visible * c.Red;
  open.Green += visible * c.Green;
  open.Blue += visible * c.Blue;
  if (Pass == RasterPass::Collect)
  {
    AddDepthMoments(open, weight, depth, 0.5f * (p.Range.Far - p.Range.Near));
    AddMoments(at.Tile.Coarse[at.Block], weight, visible,
      { visible * c.Red, visible * c.Green, visible * c.Blue }, depth, u);
  }
  return bits;
}

/// Adds the items of a batch to a block. @param items bit k: the k-th item touches it
/// @return number of fragments
template <bool OnLens, RasterPass Pass, bool Plain>
SURFELSPLATTING_INLINE std::uint64_t AddItemsToBlock(
  const BatchBlock& at, const PreparedItem* batch, std::uint64_t items)
{
  const std::uint64_t skipped = at.Settings.ShortCuts ? std::uint64_t{ 1 } << at.Block : 0;
  if ((at.Tile.Opaque & skipped) != 0)
  {
    return 0;
  }
  BlockLayers<OnLens, Pass> open;
  open.Load(at.Tile, at.Block);
  std::uint64_t fragments = 0;
  for (; items != 0 && (at.Tile.Opaque & skipped) == 0; items &= items - 1)
  {
    const PreparedItem& item = batch[__builtin_ctzll(items)];
    const unsigned int lanes =
      !Plain && Pass == RasterPass::Layers && item.Kernel == ItemKernel::Tent
      ? AddTentToBlock(open, at, *item.Item)
      : AddSplatToBlock<OnLens, Pass, Plain>(open, at, item);
    fragments += static_cast<std::uint64_t>(__builtin_popcount(lanes));
  }
  open.Store(at.Tile, at.Block);
  return fragments;
}

/// @param touched by block: the items that touch it
template <bool OnLens, RasterPass Pass, bool Plain>
SURFELSPLATTING_INLINE std::uint64_t AddPrepared(PixelTile& tile, const PreparedItem* prepared,
  const std::uint64_t (&touched)[BlocksPerTile], RasterSettings& settings,
  const RasterCallbacks& callbacks)
{
  std::uint64_t fragments = 0;
  for (int block = 0; block < BlocksPerTile; ++block)
  {
    if (touched[block] != 0)
    {
      const Lanes x = Lanes::Load(RampX) + (FirstPixel[block % BlocksPerRow] + 0.5f);
      const Lanes y = Lanes::Load(RampY) + (FirstPixel[block / BlocksPerRow] + 0.5f);
      fragments += AddItemsToBlock<OnLens, Pass, Plain>(
        { tile, block, x, y, settings, callbacks }, prepared, touched[block]);
    }
  }
  return fragments;
}

template <bool OnLens, RasterPass Pass>
std::uint64_t AddItems(PixelTile& tile, const BatchItem* batch, int count,
  const RasterSettings& shared, const RasterCallbacks& callbacks)
{
  static_assert(BatchSize == 64 && BlocksPerTile == 64, "a bit for each");
  RasterSettings settings = shared;
  std::uint64_t touched[BlocksPerTile] = {}; // by item, then by block
  PreparedItem prepared[BatchSize];
  const float perSupport = 1.0f / settings.Support;
  bool arePlain = !OnLens && Pass == RasterPass::Layers;
  for (int k = 0; k < count; ++k)
  {
    const BatchItem& item = batch[k];
    touched[k] = item.Cell ? BlocksOf(item.Place.Span)
                           : BlocksOfSplat(*item.Body, item.Place, settings.Support,
                               Pass == RasterPass::Collect ? FewCells : FewPixels);
    Prepare<OnLens, Pass>(item, settings, perSupport, prepared[k]);
    arePlain = arePlain && prepared[k].Kernel == ItemKernel::Bell && !item.Gradient;
  }
  Transpose(touched);
  // As most batches in focus are: frames take about 1 % less with a loop that tests no kernels.
  if (arePlain)
  {
    return AddPrepared<OnLens, Pass, true>(tile, prepared, touched, settings, callbacks);
  }
  return AddPrepared<OnLens, Pass, false>(tile, prepared, touched, settings, callbacks);
}

/// RasterTarget::AddBatch.
std::uint64_t AddBatch(PixelTile& tile, const BatchItem* batch, int count,
  const RasterSettings& settings, const RasterCallbacks& callbacks)
{
  const bool onLens = settings.LensRadius > 0.0f;
  switch (settings.Pass)
  {
    case RasterPass::Layers:
      return onLens ? AddItems<true, RasterPass::Layers>(tile, batch, count, settings, callbacks)
                    : AddItems<false, RasterPass::Layers>(tile, batch, count, settings, callbacks);
    case RasterPass::Collect:
      return onLens ? AddItems<true, RasterPass::Collect>(tile, batch, count, settings, callbacks)
                    : AddItems<false, RasterPass::Collect>(tile, batch, count, settings, callbacks);
    case RasterPass::Depths:
      return AddItems<false, RasterPass::Depths>(tile, batch, count, settings, callbacks);
    case RasterPass::Nearest:
      break;
  }
  return AddItems<false, RasterPass::Nearest>(tile, batch, count, settings, callbacks);
}
}
}
