// SPDX-License-Identifier: BSD-3-Clause
/**
 * Finds the depth at which half of what a pixel sees has been gathered, however translucent it is:
 * where the transmittance has fallen by half of the pixel's alpha.
 */
#pragma once

#include "Core/Raster/ABuffer.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace SurfelSplatting
{
/// For pictures through the whole lens, not its cells.
class MedianDepths : public LayerSink
{
public:
  /// @param depths [height][width] receives the depths, world units along the view direction; 0
  /// where nothing is seen
  MedianDepths(int width, int height, float* depths);

  void Receive(int x, int y, const VisibleLayer& layer) override;
  void EndTile(const PixelBox& tile) override;

private:
  struct Layer
  {
    float Alpha, Depth;
    std::uint32_t Before; // the pixel's layer in front in its tile, plus 1; 0: none
  };
  using Layers = std::vector<Layer>;

  int Width;
  float* Depths;
  std::vector<Layers> Tiles;       // of those that are being drawn
  std::vector<std::uint32_t> Last; // [pixels] the pixel's last layer in its tile, plus 1; 0: none
};
}
