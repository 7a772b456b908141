// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Picture/LayerTally.h"

#include <algorithm>

namespace SurfelSplatting
{
LayerTally::LayerTally(int width, int height, float* coverage, float* fragments)
  : Width(width)
  , Coverage(coverage)
  , Fragments(fragments)
  , Through(static_cast<std::size_t>(width) * height)
{
  std::fill_n(coverage, this->Through.size(), 0.0f);
  std::fill_n(fragments, this->Through.size(), 0.0f);
}

void LayerTally::BeginTile(const PixelBox& tile)
{
  for (int y = tile.Y0; y < tile.Y1; ++y)
  {
    std::fill_n(&this->Through[this->Index(tile.X0, y)], tile.X1 - tile.X0, 1.0f);
  }
}

void LayerTally::Receive(int x, int y, const VisibleLayer& layer)
{
  const std::size_t p = this->Index(x, y);
  const float covered = this->Through[p] * layer.Coverage;
  this->Coverage[p] += covered;
  this->Through[p] -= covered;
}

void LayerTally::ReceiveFragments(int x, int y, float count)
{
  this->Fragments[this->Index(x, y)] += count;
}

void LayerTally::Finish()
{
  for (std::size_t p = 0; p < this->Through.size(); ++p)
  {
    this->Coverage[p] = std::min(1.0f, this->Coverage[p] / static_cast<float>(this->Cells));
  }
}
}
