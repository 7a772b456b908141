// SPDX-License-Identifier: BSD-3-Clause
/**
 * Where an image with depth is smooth: cells of 2 x 2 pixels around which neither colours nor
 * depths have steps. Larger squares of pixels can be one surfel there.
 */
#pragma once

#include "Core/Base/Executor.h"

#include <cstddef>
#include <vector>

namespace SurfelSplatting
{
class SmoothCells
{
public:
  /// A cell is smooth if the pixels of the 3 x 3 cells about it are all drawn, and their colours
  /// (RGBA, sRGB codes or light) and nearnesses (px of blur) differ by at most this.
  static constexpr float MaxColorRange = 0.1f, MaxNearnessRange = 1.0f;

  /**
   * @param colors     [height][width][4]
   * @param nearness   [height][width] as in SilhouetteExtension.h
   * @param confusions [height][width] negative where there is nothing
   */
  struct Pixels
  {
    int Width, Height;
    const float* Colors;
    const float* Nearness;
    const float* Confusions;
  };
  void Find(const Pixels& pixels, const Executor& executor);

  /// Whether all cells of a square of pixels are smooth. Corner and side must be even, and the
  /// square inside of the image.
  bool Has(int x, int y, int side) const;

private:
  std::vector<unsigned char> Cells; // [rows][Columns]; cells at the border are not smooth
  int Columns = 0;
};
}
