// SPDX-License-Identifier: BSD-3-Clause
/**
 * How much of each pixel surfels cover, and by how many splats, whatever their opacity.
 */
#pragma once

#include "Core/Raster/ABuffer.h"

#include <vector>

namespace SurfelSplatting
{
class LayerTally : public LayerSink
{
public:
  /// @param coverage  [height][width] set to the coverage, [0, 1]: 1 - product of (1 - min(1, w))
  /// over the layers, w their weights; the mean over the lens
  /// @param fragments [height][width] set to the number of fragments, over all cells of the lens;
  /// of a cell in sectors their mean
  LayerTally(int width, int height, float* coverage, float* fragments);

  void BeginCell() override { ++this->Cells; }
  void BeginPart(const PixelBox& tile, float share) override;
  void Receive(int x, int y, const Layer& layer, float brightest) override;
  void ReceiveFragments(int x, int y, float count) override;

  /// After the last cell.
  void Finish();

private:
  std::size_t TileOf(int x, int y) const;
  std::size_t Index(int x, int y) const { return static_cast<std::size_t>(y) * this->Width + x; }

  int Width;
  int Cells = 0;
  float* Coverage;
  float* Fragments;
  int TilesX;
  std::vector<float> Shares;  // [tiles] of the part in its cell
  std::vector<float> Through; // what the layers of the part so far let through, times its share
};
}
