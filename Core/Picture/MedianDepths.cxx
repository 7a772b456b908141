// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Picture/MedianDepths.h"

#include "Core/Base/Tiles.h"

#include <algorithm>

namespace SurfelSplatting
{
MedianDepths::MedianDepths(int width, int height, float* depths)
  : Width(width)
  , Depths(depths)
  , Tiles(NumberOfTiles({ width, height }))
  , Last(static_cast<std::size_t>(width) * height)
{
  std::fill_n(depths, this->Last.size(), 0.0f);
}

void MedianDepths::Receive(int x, int y, const VisibleLayer& layer)
{
  Layers& layers = this->Tiles[TileOf(x, y, this->Width)];
  std::uint32_t& last = this->Last[PixelIndex(x, y, this->Width)];
  layers.push_back({ layer.Alpha, layer.Depth, last });
  last = static_cast<std::uint32_t>(layers.size());
}

void MedianDepths::EndTile(const PixelBox& tile)
{
  Layers& layers = this->Tiles[TileOf(tile.X0, tile.Y0, this->Width)];
  for (int y = tile.Y0; y < tile.Y1; ++y)
  {
    for (int x = tile.X0; x < tile.X1; ++x)
    {
      const std::size_t p = PixelIndex(x, y, this->Width);
      float alpha = 0.0f;
      for (std::uint32_t i = this->Last[p]; i > 0; i = layers[i - 1].Before)
      {
        alpha += layers[i - 1].Alpha;
      }
      float behind = 0.0f; // alpha from the layer to the farthest one
      for (std::uint32_t i = this->Last[p]; i > 0 && 2.0f * behind < alpha;)
      {
        const Layer& layer = layers[i - 1];
        behind += layer.Alpha;
        this->Depths[p] = layer.Depth;
        i = layer.Before;
      }
    }
  }
  Layers().swap(layers);
}
}
