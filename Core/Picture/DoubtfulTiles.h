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
 * (LayerMerging.h, AddDoubt), colours of [0, 1].
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
class DoubtfulTiles
{
public:
  /// Everywhere is doubtful.
  void Clear() { this->Flags.clear(); }

  /// Tiles with at least three doubtful neighbours of four are doubtful, too: what is doubtful
  /// there seldom ends between them.
  /// @param doubts [tile] largest doubt about a pixel @param largest that is left
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
   * Within doubtful tiles the weight of the mean rises, so that no edge is seen.
   * @param mean may hold anything outside of doubtful tiles
   */
  void Mix(const Frame& mean, const Frame& picture, const Executor& executor) const;

private:
  using Neighbors = std::array<std::array<bool, 3>, 3>; // [row][column], the tile in the middle

  bool IsFlagged(int column, int row) const;
  Neighbors NeighborsOf(std::size_t tile) const;

  int Columns = 0, Rows = 0;
  std::vector<unsigned char> Flags; ///< [row][column]; empty: all
};
}
