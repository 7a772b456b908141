// SPDX-License-Identifier: BSD-3-Clause
/**
 * The method in double precision without a shortcut: every pixel evaluates every surfel, sorts all
 * fragments by their near depth, and adds them one by one (ReferenceLayers.h). What the Splatter is
 * compared with; shares no code with it but the input structures and the light model.
 *
 * Beside each pixel goes a bound on how far single precision may move it, measured by moving its
 * fragments by the rounding of a splat's fields and of the raster's sums, and a mark where that
 * rounding may change a decision: whether the pixel lies inside a support, whether enough of a
 * layer stays open, or whether a layer lies behind the depth limit. There no bound holds.
 */
#pragma once

#include "Core/Picture/Splatter.h"

#include <vector>

namespace SurfelSplatting
{
struct ReferencePixel
{
  double Color[4] = { 0, 0, 0, 0 }; ///< as in Frame::Color
  double Depth = 0;                 ///< as in Frame::Depth
  double ColorBound = 0; ///< largest difference that rounding explains, for colours up to 1
  double DepthBound = 0;
  bool Undecided = false;      ///< rounding, or another pixel of its block, may decide otherwise
  bool DepthUndecided = false; ///< rounding may move the median to another layer
  double MedianMargin = 0.5;   ///< ReferenceLayers::MedianMargin
  int Layers = 0;              ///< times that a layer leaked or ended
};

/// What a pixel may be off by beyond its bound for rounding. Where T depends on the point of the
/// lens, two short cuts of the raster add to it (ReferenceLayers.h). Without translucent surfels
/// only the threshold MinTilt = 1/512 is left, of which 1/20 was measured. With opacities drawn at
/// random for each surfel, the mean opacity of a layer moved pixels by up to 0.009.
double ShortCutBound(const SplatContext& context, bool opaque);

/// Pixels row by row. @param occluderDepth as in Splatter::Render.
std::vector<ReferencePixel> RenderByBruteForce(const SplatContext& context,
  const std::vector<SurfelCloud>& clouds, const float* occluderDepth = nullptr);
}
