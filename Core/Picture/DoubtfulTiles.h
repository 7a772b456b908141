// SPDX-License-Identifier: BSD-3-Clause
/**
 * The part of a picture that a divided lens may change. Elsewhere one picture through the whole
 * lens is as good as the mean of the pictures through its cells (SubApertures.h).
 *
 * A layer with coverage a behind layers that let T through is seen by a share of the lens between
 * max(0, T + a - 1) and min(T, a) (Frechet): one picture estimates it by moments, cells resolve it.
 * The doubt about a pixel is the sum, over its layers, of this interval's width times the contrast
 * to what is seen behind (LayerMerging.h, AddDoubt), colours of [0, 1].
 */
#pragma once

#include "Core/Base/Executor.h"
#include "Core/Base/PixelBox.h"
#include "Core/Raster/Frame.h"

#include <cstddef>
#include <vector>

namespace SurfelSplatting
{
class DoubtfulTiles
{
public:
  /// Everywhere is doubtful.
  void Clear() { this->Flags.clear(); }

  /// @param doubts [tile] largest doubt about a pixel @param largest that is left
  void Set(const PictureSize& size, const std::vector<float>& doubts, float largest);

  bool Has(std::size_t tile) const { return this->Flags.empty() || this->Flags[tile] != 0; }

  /// Whether a box of pixels touches any.
  bool Touch(const PixelBox& box) const;

  /// Whether there are none.
  bool IsEmpty() const;

  /**
   * Replaces what is not doubtful by the picture through the whole lens. Within doubtful tiles the
   * weight of the mean rises, so that no edge is seen.
   * @param whole the picture through the whole lens @param mean that of the cells
   */
  void Mix(const Frame& whole, const Frame& mean, const Executor& executor) const;

private:
  bool IsFlagged(int column, int row) const;
  bool IsSurrounded(int column, int row) const;
  float Weight(int x, int y) const;

  int Columns = 0, Rows = 0;
  std::vector<unsigned char> Flags; ///< [row][column]; empty: all
};
}
