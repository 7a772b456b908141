// SPDX-License-Identifier: BSD-3-Clause
/**
 * Layers of the A-buffer (Carpenter 1984) with the extended depth test by z-ranges (Levoy and
 * Whitted 1985, Rasanen 2002).
 *
 * Splats of one surface overlap in depth. A layer is the union of overlapping z-ranges at one
 * pixel. Its sums are normalised only when it is resolved, so layers of tiles, of other props'
 * pixels and of other processes can be joined in any order, by the one rule below (Join).
 * The raster applies the rule to splats in LayerMerging.h.
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
  float PointX = 0, PointY = 0;       ///< sum w u
  float ColorX[3] = {}, ColorY[3] = {}, XX = 0, XY = 0, YY = 0, HalfRange = 0, Spread = 0;

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

/// A layer ready to be composited: premultiplied colour, opacity alpha, depth.
struct ResolvedLayer
{
  float Red, Green, Blue, Alpha, Depth;
};

/// Divides the sums by max(1, sum w): alpha is the coverage min(1, sum w) times the mean opacity.
/// Dividing by the sum itself would turn partial coverage into full coverage.
inline ResolvedLayer Resolve(const Layer& layer)
{
  const float scale = 1.0f / std::max(1.0f, layer.Weight);
  return { layer.Red * scale, layer.Green * scale, layer.Blue * scale, layer.Opacity * scale,
    layer.Weight > 0 ? layer.Depth / layer.Weight : 0.0f };
}

/// Receives every layer of every pixel when it is closed, front to back, except those behind
/// another prop. The raster's threads call it, never two at once for the same tile.
class LayerSink
{
public:
  virtual ~LayerSink() = default;

  /// Called before the layers of each cell of the lens.
  virtual void BeginCell() {}

  /// Called before a tile's layers as seen through a part of the cell, whose share of the cell is
  /// in (0, 1].
  virtual void BeginPart(const PixelBox& /* tile */, float /* share */) {}

  /// @param brightest limit of the layer's colours, not premultiplied, when it is composited
  virtual void Receive(int x, int y, const Layer& layer, float brightest) = 0;

  /// Called after a tile's layers for each pixel that is covered, with the number of splats and
  /// cells of coarse grids.
  virtual void ReceiveFragments(int /* x */, int /* y */, float /* count */) {}
};
}
