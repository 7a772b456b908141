// SPDX-License-Identifier: BSD-3-Clause
/**
 * Streams of splats that are the same at every pixel of a small frame: all pixels get the same
 * layers, and only their order, z-ranges and weights matter.
 */
#pragma once

#include "Core/Raster/TileRaster.h"

#include <cstddef>
#include <vector>

namespace WideSplats
{
using namespace SurfelSplatting;

constexpr int Size = 16; // px of the frames

/// What pixels get, as it comes.
class RecordingSink : public LayerSink
{
public:
  RecordingSink(int width, int height)
    : Width(width)
    , Parts(static_cast<std::size_t>(width) * height)
  {
  }
  void Receive(int x, int y, const VisibleLayer& layer) override
  {
    this->Parts[static_cast<std::size_t>(y) * this->Width + x].push_back(layer);
  }

  int Width;
  std::vector<std::vector<VisibleLayer>> Parts;
};

/// A splat so wide that it has the same weight all over a small frame, at one point of the lens.
struct Wide
{
  float Near = 0, Far = 0, Weight = 0, Red = 0, Opacity = 1;
  float PointX = 0, PointY = 0;
  float Kernel = 1;    ///< all over the frame, from 0.09 on: less is cut off
  float Steepness = 0; ///< of a SmoothProfile, at whose centre the frame is then; 0: a Gaussian
};

Splat SplatOf(const Wide& w);

/// The splats as a list and in the bins of the only tile.
void FillList(const std::vector<Wide>& splats, bool onLens, SplatList& list, TileBins& bins);

struct Pixel
{
  double Red, Alpha, Depth;
};

/// Radius of the blur for splats on the lens, the same at every depth: the focus is at infinity.
constexpr float Blur = 1.0f;

/// The picture of a stream, in focus or on the lens. Checks that all its pixels are equal, and that
/// what the sink gets adds up to them.
Pixel Draw(const std::vector<Wide>& splats, bool onLens);

/// Largest difference in colour and alpha.
double Difference(const Pixel& a, const Pixel& b);
}
