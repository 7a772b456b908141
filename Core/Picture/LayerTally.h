// SPDX-License-Identifier: BSD-3-Clause
/**
 * Measures how much of each pixel surfels cover, and with how many fragments, regardless of
 * opacity.
 */
#pragma once

#include "Core/Raster/ABuffer.h"

#include <vector>

namespace SurfelSplatting
{
class LayerTally : public LayerSink
{
public:
  /// @param coverage  [height][width] receives the coverage, [0, 1]: the mean over the lens of 1 -
  /// product of (1 - min(1, w)) over the layers with weights w
  /// @param fragments [height][width] receives the number of fragments, summed over the cells of
  /// the lens; a cell in sectors counts the mean of its sectors
  LayerTally(int width, int height, float* coverage, float* fragments);

  void BeginCell() override { ++this->Cells; }
  void BeginPart(const PixelBox& tile, float share) override;
  void Receive(int x, int y, const Layer& layer, float brightest) override;
  void ReceiveFragments(int x, int y, float count) override;

  /// Call after the last cell.
  void Finish();

private:
  std::size_t TileOf(int x, int y) const;
  std::size_t Index(int x, int y) const { return static_cast<std::size_t>(y) * this->Width + x; }

  int Width;
  int Cells = 0;
  float* Coverage;
  float* Fragments;
  int TilesX;
  std::vector<float> Shares;  // [tiles] share of this part in its cell
  std::vector<float> Through; // [pixels] share times transmittance of the layers so far
};
}
