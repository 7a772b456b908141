// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Picture/LayerTally.h"

#include "Core/Raster/RasterTarget.h"

#include <algorithm>

namespace SurfelSplatting
{
LayerTally::LayerTally(int width, int height, float* coverage, float* fragments)
  : Width(width)
  , Coverage(coverage)
  , Fragments(fragments)
  , TilesX((width + TileSize - 1) / TileSize)
  , Shares(static_cast<std::size_t>(TilesX) * ((height + TileSize - 1) / TileSize))
  , Through(static_cast<std::size_t>(width) * height)
{
  std::fill_n(coverage, this->Through.size(), 0.0f);
  std::fill_n(fragments, this->Through.size(), 0.0f);
}

std::size_t LayerTally::TileOf(int x, int y) const
{
  return static_cast<std::size_t>(y / TileSize) * this->TilesX + x / TileSize;
}

void LayerTally::BeginPart(const PixelBox& tile, float share)
{
  this->Shares[this->TileOf(tile.X0, tile.Y0)] = share;
  for (int y = tile.Y0; y < tile.Y1; ++y)
  {
    std::fill_n(&this->Through[this->Index(tile.X0, y)], tile.X1 - tile.X0, share);
  }
}

void LayerTally::Receive(int x, int y, const Layer& layer, float)
{
  const std::size_t p = this->Index(x, y);
  const float covered = this->Through[p] * std::min(1.0f, layer.Weight);
  this->Coverage[p] += covered;
  this->Through[p] -= covered;
}

void LayerTally::ReceiveFragments(int x, int y, float count)
{
  this->Fragments[this->Index(x, y)] += this->Shares[this->TileOf(x, y)] * count;
}

void LayerTally::Finish()
{
  for (std::size_t p = 0; p < this->Through.size(); ++p)
  {
    this->Coverage[p] = std::min(1.0f, this->Coverage[p] / static_cast<float>(this->Cells));
  }
}
}
