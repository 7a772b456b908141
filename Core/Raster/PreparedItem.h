// SPDX-License-Identifier: BSD-3-Clause
/**
 * Items of a batch, splats or tents, as the blocks of a tile need them.
 *
 * Included by the translation units of the raster's targets (RasterTarget.h), whose own this code
 * is.
 */
#pragma once

#include "Core/Raster/KernelEvaluation.h"
#include "Core/Raster/LayerMerging.h"

namespace SurfelSplatting
{
namespace
{
enum class ItemKernel : std::int32_t
{
  Smooth, ///< SmoothProfile
  Bell,   ///< BellProfile
  Gaussian,
  Tent
};

/// An item of a batch as the blocks need it, as functions of the place (x, y) in the tile, px.
struct alignas(64) PreparedItem
{
  float UX, UY, U0, VY, V0; ///< q / support = (UX x + UY y + U0)^2 + (VY y + V0)^2
  ZRange Range;
  float Weight;                         ///< over RoomToFill
  float LensX, LensY;                   ///< 2 u = (LensX, LensY) +
  float LensXX, LensXY, LensYX, LensYY; ///< (LensXX x + LensXY y, LensYX x + LensYY y)
  float Area, AreaX, AreaY;             ///< as in LensFootprint, times Weight
  float Back, Share;                    ///< as in LensFootprint
  float Depth, DepthX, DepthY;
  float Red, Green, Blue, Opacity;
  float Steepness;            ///< SmoothProfile
  float PerCenter;            ///< 1 / the kernel at the centre; on the lens only
  float Edge, Square, Fourth; ///< BellProfile
  ItemKernel Kernel;
  const BatchItem* Item;
};

SURFELSPLATTING_INLINE ItemKernel KernelOf(float shape)
{
  return shape < 0.0f           ? ItemKernel::Gaussian
    : shape >= FirstSmoothShape ? ItemKernel::Smooth
                                : ItemKernel::Bell;
}

/// The kernel of a splat at its centre: of SmoothProfile less than 1 where it has no plateau, and
/// hardly anything next to a bell.
SURFELSPLATTING_INLINE float KernelAtCenter(ItemKernel kernel, float steepness)
{
  const float u = steepness < 1.0f ? steepness : 1.0f;
  return kernel == ItemKernel::Smooth ? u * u * (3.0f - 2.0f * u) : 1.0f;
}

template <bool OnLens, RasterPass Pass>
SURFELSPLATTING_INLINE void Prepare(
  const BatchItem& item, const RasterSettings& settings, float perSupport, PreparedItem& p)
{
  p.Item = &item;
  if (Pass == RasterPass::Layers && item.Cell)
  {
    p.Kernel = ItemKernel::Tent;
    return;
  }
  const Splat& s = *item.Body;
  const float x = item.Place.X, y = item.Place.Y;
  p.UX = __builtin_sqrtf(s.A * perSupport);
  p.VY = __builtin_sqrtf(s.B * perSupport);
  p.UY = p.UX * s.K;
  p.U0 = 0.0f - p.UX * (x + s.K * y);
  p.V0 = 0.0f - p.VY * y;
  p.Range = { s.Near, s.Far };
  p.Weight = s.Weight * (1.0f / RoomToFill<OnLens>);
  p.DepthX = s.DepthX;
  p.DepthY = s.DepthY;
  p.Depth = 0.5f * (s.Near + s.Far) - (s.DepthX * x + s.DepthY * y);
  p.Red = s.Red;
  p.Green = s.Green;
  p.Blue = s.Blue;
  p.Opacity = s.Opacity;
  p.Kernel = KernelOf(s.Shape);
  p.Steepness = s.Shape - FirstSmoothShape;
  const BellWeights<float> bell = BellOf(s.Shape);
  p.Edge = bell.Edge;
  p.Square = bell.Square;
  p.Fourth = bell.Fourth;
  if (OnLens)
  {
    const LensFootprint& lens = *item.Footprint;
    const float xx = 2.0f * lens.PerForm * s.A, xy = xx * s.K;
    const float yy = 2.0f * lens.PerForm * s.B + xy * s.K;
    p.LensXX = settings.RootXX * xx + settings.RootXY * xy;
    p.LensXY = settings.RootXX * xy + settings.RootXY * yy;
    p.LensYX = settings.RootXY * xx + settings.RootYY * xy;
    p.LensYY = settings.RootXY * xy + settings.RootYY * yy;
    p.LensX = 2.0f * lens.MeanX - (p.LensXX * x + p.LensXY * y);
    p.LensY = 2.0f * lens.MeanY - (p.LensYX * x + p.LensYY * y);
    p.AreaX = p.Weight * lens.AreaX;
    p.AreaY = p.Weight * lens.AreaY;
    p.Area = p.Weight * lens.Area - (p.AreaX * x + p.AreaY * y);
    p.Back = lens.Back;
    p.Share = lens.Share;
    const float center = KernelAtCenter(p.Kernel, p.Steepness);
    p.PerCenter = 1.0f / (center > 1e-30f ? center : 1e-30f);
  }
}
}
}
