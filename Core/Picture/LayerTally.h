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
  /// @param coverage  [height][width] receives the coverage, [0, 1]: alpha if all were opaque
  /// @param fragments [height][width] receives the number of fragments, summed over the cells of
  /// the lens
  LayerTally(int width, int height, float* coverage, float* fragments);

  void BeginCell() override { ++this->Cells; }
  void BeginTile(const PixelBox& tile) override;
  void Receive(int x, int y, const VisibleLayer& layer) override;
  void ReceiveFragments(int x, int y, float count) override;

  /// Call after the last cell.
  void Finish();

private:
  std::size_t Index(int x, int y) const { return PixelIndex(x, y, this->Width); }

  int Width;
  int Cells = 0;
  float* Coverage;
  float* Fragments;
  std::vector<float> Through; // [pixels] transmittance of the layers so far, if they were opaque
};
}
