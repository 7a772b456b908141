// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Picture/FrameAverage.h"

#include "Core/Base/Tiles.h"

#include <algorithm>

namespace SurfelSplatting
{
void FrameAverage::Start(const Frame& frame, const DoubtfulTiles& where, const Executor& executor)
{
  this->Where = &where;
  this->Mean = this->Scratch = frame;
  this->Threads = &executor;
  this->Count = 0;
  const std::size_t pixels = static_cast<std::size_t>(frame.Width) * frame.Height;
  this->Color.resize(4 * pixels);
  this->Depth.resize(pixels);
  this->Scratch.Color = this->Color.data();
  this->Scratch.Depth = this->Depth.data();
}

/// Calls function(first, last) for the pixels of each row of a tile.
template <typename Function>
void FrameAverage::ForRows(std::size_t tile, const Function& function) const
{
  const PixelBox box = BoxOfTile(tile, { this->Mean.Width, this->Mean.Height });
  for (int y = box.Y0; y < box.Y1; ++y)
  {
    const std::size_t row = static_cast<std::size_t>(y) * this->Mean.Width;
    function(row + box.X0, row + box.X1);
  }
}

void FrameAverage::Add(std::size_t tile)
{
  const bool first = this->Count == 0;
  const float* color = this->Color.data();
  const float* depth = this->Depth.data();
  this->ForRows(tile, [&](std::size_t begin, std::size_t end) {
    if (first)
    {
      std::copy(color + 4 * begin, color + 4 * end, this->Mean.Color + 4 * begin);
      std::copy(depth + begin, depth + end, this->Mean.Depth + begin);
      return;
    }
    float* sum = this->Mean.Color;
    for (std::size_t c = 4 * begin; c < 4 * end; ++c)
    {
      sum[c] += color[c];
    }
    float* nearest = this->Mean.Depth;
    for (std::size_t i = begin; i < end; ++i)
    {
      nearest[i] = nearest[i] == 0.0f ? depth[i] : nearest[i];
    }
  });
}

void FrameAverage::Finish()
{
  const float share = 1.0f / static_cast<float>(std::max(1, this->Count));
  const auto divide = [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
    {
      float* rgba = this->Mean.Color + 4 * i;
      for (int c = 0; c < 4; ++c)
      {
        rgba[c] *= share;
      }
      if (rgba[3] < 0.5f)
      {
        this->Mean.Depth[i] = 0.0f;
      }
    }
  };
  const std::size_t tiles = NumberOfTiles({ this->Mean.Width, this->Mean.Height });
  this->Threads->For(tiles, 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t tile = begin; tile < end; ++tile)
    {
      if (this->Where->Has(tile))
      {
        this->ForRows(tile, divide);
      }
    }
  });
}
}
