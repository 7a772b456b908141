// SPDX-License-Identifier: BSD-3-Clause
/**
 * The depths of the splats in a layer of a coarse grid: their moments, and the z-range of most of
 * them. Whether they are those of two surfaces is in TwoSurfaces.h.
 *
 * Real is float, or Lanes of floats.
 */
#pragma once

#include "Core/Simd/RealLanes.h"

namespace SurfelSplatting
{
/// Depths of the splats of a layer along the view direction, world units.
template <class Real>
struct DepthMoments
{
  Real Weight; ///< sum w, > 0
  Real Mean;   ///< of the depths
  /// Sums of w (z - n), w (z - n)^2, ..., n the near end of the splats' z-ranges.
  Real First, Squared, Cubed, Fourth;
  Real HalfRange; ///< mean of (far - near) / 2 of the splats, > 0
};
using LayerDepths = DepthMoments<float>;

/// A layer, or one of its two surfaces.
template <class Real>
struct DepthRange
{
  Real Weight;    ///< sum w
  Real Depth;     ///< mean
  Real Near, Far; ///< z-range of most of it
};
using LayerPart = DepthRange<float>;

/// Deviations in half a z-range. An even range would have sqrt(3); longer ranges merge surfaces of
/// scans.
constexpr float RangePerDeviation = 1.4f;

/// Error of a depth, a float, over the depth.
constexpr float DepthRounding = 5e-7f;

/// Up to this share r of its variance that is due to the distance between two surfaces
/// (TwoSurfaces.h), a layer is one surface; the gap opens from there to r = 1. An even range, such
/// as a floor's, has 0.775. (A floor and the wall that it meets may have 0.89; TestCoarseGrid.cxx
/// looks at such a corner.) Where all of the gap counts from 0.9 on, neighbouring cells differ
/// more: a lion at 100 px has seams of 14 levels instead of 10.
constexpr float LeastApart = 0.8f;

SURFELSPLATTING_INLINE float SquareRoot(float a)
{
  return __builtin_sqrtf(a);
}

/// The layer as one surface. Splats of hardly any weight do not make its z-range longer.
template <class Real>
SURFELSPLATTING_INLINE DepthRange<Real> WholeLayer(const DepthMoments<Real>& layer)
{
  const Real perWeight = 1.0f / layer.Weight, mean = layer.First * perWeight;
  const Real variance = Larger(layer.Squared * perWeight - mean * mean, Real(0.0f));
  const Real half =
    layer.HalfRange + RangePerDeviation * SquareRoot(variance) + DepthRounding * layer.Mean;
  return { layer.Weight, layer.Mean, layer.Mean - half, layer.Mean + half };
}
}
