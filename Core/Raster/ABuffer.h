// SPDX-License-Identifier: BSD-3-Clause
/**
 * Layers of the A-buffer (Carpenter 1984) with the extended depth test by z-ranges (Levoy and
 * Whitted 1985, Rasanen 2002).
 *
 * Splats of one surface overlap in depth. A layer is the union of overlapping z-ranges at one
 * pixel. Splats come by ascending near depth, so that one open layer per pixel is enough; those of
 * surfels behind another sheet come later (DepthBehindSheet in Core/Splats/SetupConstants.h):
 *
 *       near ------ splat 1 ------ far
 *                 near --- splat 2 --- far             near - splat 3 - far
 *       |------------- layer 1 ----------|     gap     |---- layer 2 ----|      --> z
 *
 * Where a splat begins behind the end of the open layer, this does not end at once: a part of it is
 * composited, and the less stays open the wider the gap, so that nothing jumps when a gap opens.
 * Gaps are measured in bands. The band is the length of the splat's z-range plus half the radius of
 * its blur in the world. A splat of hardly any weight at the pixel changes nothing: its layer leaks
 * over a share of the gap, and stays open over the rest. Formulas: Core/Lens/LayerLeaks.h; the
 * raster applies them in LayerMerging.h.
 */
#pragma once

#include "Core/Base/PixelBox.h"

namespace SurfelSplatting
{
/// What a layer, or a part of it, adds to a pixel of the picture.
struct VisibleLayer
{
  float Red, Green, Blue; ///< premultiplied, as seen behind all layers before
  float Alpha;            ///< by which the transmittance falls
  float Depth;            ///< mean of the layer, world units along the view direction
  float Coverage;         ///< share of the layers behind that it covers, regardless of opacity
  float Spread = 0.0f;    ///< deviation in depth of a volume's Gaussian, world units; 0 of others
};

/// Receives what every pixel's layers add to the picture, front to back, except those behind
/// another prop. The raster's threads call it, never two at once for the same tile.
class LayerSink
{
public:
  virtual ~LayerSink() = default;

  /// Called before the layers of each cell of the lens.
  virtual void BeginCell() {}

  /// Called before a tile's layers.
  virtual void BeginTile(const PixelBox& /* tile */) {}

  virtual void Receive(int x, int y, const VisibleLayer& layer) = 0;

  /// Called after a tile's layers for each pixel that is covered, with the number of splats and
  /// cells of coarse grids.
  virtual void ReceiveFragments(int /* x */, int /* y */, float /* count */) {}

  /// Called after all that a tile's pixels add.
  virtual void EndTile(const PixelBox& /* tile */) {}
};
}
