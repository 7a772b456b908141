// SPDX-License-Identifier: BSD-3-Clause
/**
 * Layers of the A-buffer (Carpenter 1984) with the extended depth test by z-ranges (Levoy and
 * Whitted 1985, Rasanen 2002).
 *
 * Splats of one surface overlap in depth: a layer is the union of overlapping z-ranges at one
 * pixel. Its sums stay un-normalised until it is resolved, so that layers of tiles, of other props'
 * pixels and of other processes can be joined by the one rule below, in any order.
 *
 *       near ------ splat 1 ------ far
 *                 near --- splat 2 --- far             near - splat 3 - far
 *       |------------- layer 1 ----------|             |---- layer 2 ----|      --> z
 */
#pragma once

#include "Core/Base/PixelBox.h"

#include <algorithm>
#include <limits>

namespace SurfelSplatting
{
struct Layer
{
  float Near = std::numeric_limits<float>::infinity(); ///< world units along the view direction
  float Far = -std::numeric_limits<float>::infinity();
  float Weight = 0;                   ///< sum w, coverage before it is limited to 1
  float Opacity = 0;                  ///< sum w o
  float Red = 0, Green = 0, Blue = 0; ///< sum w o colour
  float Depth = 0;                    ///< sum w z

  bool Overlaps(const Layer& other) const { return Near <= other.Far && other.Near <= Far; }

  /// Union of two layers; associative and, up to rounding, commutative.
  void Join(const Layer& other)
  {
    Near = std::min(Near, other.Near);
    Far = std::max(Far, other.Far);
    Weight += other.Weight;
    Opacity += other.Opacity;
    Red += other.Red;
    Green += other.Green;
    Blue += other.Blue;
    Depth += other.Depth;
  }
};

/// A layer as it is composited: premultiplied colour, opacity alpha, depth.
struct ResolvedLayer
{
  float Red, Green, Blue, Alpha, Depth;
};

/// Coverage min(1, sum w) times mean opacity: the sums divided by max(1, sum w). Dividing by the
/// sum itself would turn partial coverage into full.
inline ResolvedLayer Resolve(const Layer& layer)
{
  const float scale = 1.0f / std::max(1.0f, layer.Weight);
  return { layer.Red * scale, layer.Green * scale, layer.Blue * scale, layer.Opacity * scale,
    layer.Weight > 0 ? layer.Depth / layer.Weight : 0.0f };
}

/// Receives every layer of every pixel, front to back, as it is closed; none that is behind another
/// prop. Called from the raster's threads, never twice at once for one tile.
class LayerSink
{
public:
  virtual ~LayerSink() = default;

  /// Before the layers of each cell of the lens.
  virtual void BeginCell() {}

  /// Before a tile's layers as seen through a part of the cell, whose share of it is in (0, 1].
  virtual void BeginPart(const PixelBox& /* tile */, float /* share */) {}

  /// @param brightest what a layer's colours over its alpha are clamped to as it is composited
  virtual void Receive(int x, int y, const Layer& layer, float brightest) = 0;

  /// After a tile's layers: how many splats, or cells of coarse grids, cover a pixel; not if none.
  virtual void ReceiveFragments(int /* x */, int /* y */, float /* count */) {}
};
}
