// SPDX-License-Identifier: BSD-3-Clause
/**
 * A surfel on the screen, ready for the raster (Core/Raster/TileRaster.h): one cache line.
 * SplatMaker makes it; Tent.h has what coarse grids make.
 */
#pragma once

#include <cstdint>

namespace SurfelSplatting
{
/// Fields in px are in cells for a splat on a coarse grid (CoarseGrid.h).
struct alignas(64) Splat
{
  float X, Y;    ///< centre, px
  float A, K, B; ///< q = A (dx + K dy)^2 + B dy^2 (ResamplingKernel.h)
  float Weight;  ///< coverage at the centre: area on the screen times the kernel's peak, [0, inf)
  float Near;    ///< z-range of the reconstruction kernel along the view direction, world units
  float Far;
  std::int32_t Gradient;  ///< index of the colour's SplatGradient, or NoGradient
  float DepthX, DepthY;   ///< slope of the depth over the footprint, world units per px
  float Red, Green, Blue; ///< straight, shaded, linear
  float Opacity;          ///< [0, 1]
  float Shape;            ///< of the kernel (ResamplingKernel.h)
};
constexpr std::int32_t NoGradient = -1;

/// Splat::Gradient of Gaussians in space (Core/Lens/GaussianFootprint.h), which use some fields
/// otherwise: Near is the depth of the centre, Far the same for captures, and for volumes one
/// standard deviation along the view direction behind it; q is with respect to W itself, and ends
/// at DepthX; DepthY is the size of its run's cells, px (GaussianRun.h); Weight is w, the opacity
/// or optical depth at the centre; the opacity is e (1 - exp(-w k)) + (1 - e) min(w k, MaxOpacity),
/// e = Opacity.
constexpr std::int32_t InSpace = -2;

inline bool HasGradient(const Splat& s)
{
  return s.Gradient >= 0;
}

/// How the colour of a node changes over its footprint, per px: t (X dx + Y dy) is added to k times
/// the splat's colour, where k is the kernel and t its derivative (ResamplingKernel.h). The
/// constant factor of t is included here.
struct SplatGradient
{
  float RedX, GreenX, BlueX;
  float RedY, GreenY, BlueY;
};

static_assert(sizeof(Splat) == 64, "a splat is one cache line");
}
