// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Picture/FrameAverage.h"

#include <algorithm>

namespace SurfelSplatting
{
void FrameAverage::Start(const Frame& frame, const Executor& executor)
{
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
  constexpr std::size_t grain = 16384;
  this->Threads->For(this->Depth.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
    {
      function(i);
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
