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

template <typename Function>
void FrameAverage::ForPixels(const Function& function) const
{
  const PictureSize size{ this->Mean.Width, this->Mean.Height };
  const std::size_t tiles =
    static_cast<std::size_t>(TileCount(size.Width)) * TileCount(size.Height);
  this->Threads->For(tiles, 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t tile = begin; tile < end; ++tile)
    {
      if (this->Where->Has(tile))
      {
        SurfelSplatting::ForPixels(
          tile, size, [&](int, int, std::size_t pixel) { function(pixel); });
      }
    }
  });
}

void FrameAverage::Add()
{
  const bool first = this->Count++ == 0;
  this->ForPixels([this, first](std::size_t i) {
    for (std::size_t c = 4 * i; c < 4 * i + 4; ++c)
    {
      this->Mean.Color[c] = (first ? 0.0f : this->Mean.Color[c]) + this->Color[c];
    }
    if (first || this->Mean.Depth[i] == 0.0f)
    {
      this->Mean.Depth[i] = this->Depth[i];
    }
  });
}

void FrameAverage::Finish()
{
  const float share = 1.0f / static_cast<float>(std::max(1, this->Count));
  this->ForPixels([this, share](std::size_t i) {
    float* rgba = this->Mean.Color + 4 * i;
    for (int c = 0; c < 4; ++c)
    {
      rgba[c] *= share;
    }
    if (rgba[3] < 0.5f)
    {
      this->Mean.Depth[i] = 0.0f;
    }
  });
}
}
