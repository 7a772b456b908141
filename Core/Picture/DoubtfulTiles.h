// SPDX-License-Identifier: BSD-3-Clause
/**
 * The part of a picture that a divided lens may change. Elsewhere one picture through the whole
 * lens is as good as the mean of the pictures through its cells (SubApertures.h).
 *
 * A layer with coverage a behind layers that let T through is seen by a share of the lens between
 * max(0, T + a - 1) and min(T, a) (Frechet): one picture estimates it by moments, cells resolve it.
 * Behind a veil that is the same all over the lens it is T a, whatever covers: the interval is no
 * wider than T varies over the lens (LensVisibility.h, VariationBehind). The doubt about a pixel is
 * the sum, over its layers, of this width times the contrast to what is seen behind
 * (LayerMerging.h, AddDoubt), colours of [0, 1]. Of what a layer of two surfaces has no room for,
 * the contrast to the layer is in doubt as well (TentFragments.h, Refuse).
 */
#pragma once

#include "Core/Base/Executor.h"
#include "Core/Base/TileSet.h"
#include "Core/Raster/Frame.h"

#include <array>
#include <cstddef>
#include <vector>

namespace SurfelSplatting
{
/// From so many times the largest doubt that is left, the mean has all of the weight.
constexpr float FullDoubt = 2.0f;

class DoubtfulTiles
{
public:
  /// Everywhere is doubtful.
  void Clear() { this->Flags.clear(); }

  /// Tiles with at least three doubtful neighbours of four are doubtful, too: what is doubtful
  /// there seldom ends between them. In motion doubts change, and no tile flips: the weight of the
  /// mean rises from 0 at the largest doubt that is left to 1 at FullDoubt times as much.
  /// @param doubts [tile] largest doubt about a pixel @param largest that is left, > 0
  void Set(const PictureSize& size, const std::vector<float>& doubts, float largest);

  bool Has(std::size_t tile) const { return this->Flags.empty() || this->Flags[tile] != 0; }

  /// They live as long as this does not change.
  TileSet Tiles(const PictureSize& size) const
  {
    return { size, this->Columns, this->Flags.empty() ? nullptr : this->Flags.data() };
  }

  /// Whether there are none.
  bool IsEmpty() const;

  /**
   * Puts the mean of the cells into the picture through the whole lens, where that is doubtful.
   * Within doubtful tiles the weight of the mean rises to the tile's, so that no edge is seen.
   * @param mean may hold anything outside of doubtful tiles
   */
  void Mix(const Frame& mean, const Frame& picture, const Executor& executor) const;

private:
  using Neighbors = std::array<std::array<float, 3>, 3>; // [row][column], the tile in the middle

  float WeightAt(int column, int row) const;
  Neighbors NeighborsOf(std::size_t tile) const;

  int Columns = 0, Rows = 0;
  std::vector<float> Weights;       ///< [row][column] of the mean, [0, 1]
  std::vector<unsigned char> Flags; ///< [row][column] whether the weight is > 0; empty: all
};
}
