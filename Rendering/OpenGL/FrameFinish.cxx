// SPDX-License-Identifier: BSD-3-Clause
#include "Rendering/OpenGL/FrameFinish.h"

#include "Core/Base/LinearLight.h"
#include "SurfelData/SMPExecutor.h"

#include <algorithm>
#include <cmath>

namespace SurfelSplatting
{
namespace
{
/// Joins distances of splats, 0 where there is none, and window depths: the smaller ones.
void JoinDepths(
  const float* distances, std::size_t count, const DepthRange& range, float* windowDepths)
{
  const double p22 = range.P22, p23 = range.P23;
  for (std::size_t i = 0; i < count && !range.Parallel; ++i)
  {
    const bool has = distances[i] > 0.0f;
    const double ndc = p23 / (has ? distances[i] : 1.0f) - p22;
    const auto depth = static_cast<float>(std::min(std::max(0.5 * (ndc + 1.0), 0.0), 1.0));
    windowDepths[i] = std::min(windowDepths[i], has ? depth : 1.0f);
  }
  for (std::size_t i = 0; i < count && range.Parallel; ++i)
  {
    const double depth = std::min(std::max(range.WindowDepthOf(distances[i]), 0.0), 1.0);
    windowDepths[i] =
      std::min(windowDepths[i], distances[i] != 0.0f ? static_cast<float>(depth) : 1.0f);
  }
}

/// Mixes premultiplied RGBA over what is there.
void MixOver(const float* color, float* under)
{
  const float through = 1.0f - color[3];
  for (int c = 0; c < 4; ++c)
  {
    under[c] = color[c] + through * under[c];
  }
}

/// Mixes premultiplied light over sRGB codes.
void MixLightOver(const float* color, float* under)
{
  const float through = 1.0f - color[3];
  for (int c = 0; c < 3; ++c)
  {
    const double below = through > 0.0f ? through * LightOfCode(under[c]) : 0.0;
    under[c] = static_cast<float>(CodeOfLight(color[c] + below));
  }
  under[3] = color[3] + through * under[3];
}
}

/// The colour under a splatted pixel; the background of the pixel itself if nothing is there.
const float* FrameFinish::ColorUnder(
  const DepthImageSurfels::Pixel& pixel, const DepthImage& props) const
{
  const bool isKnown = pixel.Under != DepthImageSurfels::NoPixel &&
    (this->Pixels->HasBackdrop || std::isfinite(props.Depth[pixel.Under]));
  return isKnown ? props.Colors + 4 * pixel.Under : this->Pixels->BackgroundOf(pixel.Index);
}

void FrameFinish::Begin(
  const SplattedPicture& picture, const DepthImage& props, bool isWhole, PropPixels& pixels)
{
  this->Pixels = &pixels;
  this->InLight = props.LinearLight;
  this->IsWhole = isWhole;
  pixels.WindowDepth.resize(picture.Pixels);
  const std::vector<DepthImageSurfels::Pixel>& blurred = picture.BlurredPixels.Blurred();
  const std::vector<DepthImageSurfels::Pixel>& mixed = picture.BlurredPixels.Mixed();
  const auto pixelOf = [&](std::size_t i) -> const DepthImageSurfels::Pixel& {
    return i < blurred.size() ? blurred[i] : mixed[i - blurred.size()];
  };
  const std::size_t count = isWhole ? blurred.size() + mixed.size() : blurred.size();
  // All colours under them are taken before any is replaced: they may be those of one another.
  this->Under.resize(isWhole ? 4 * count : 0);
  SMPExecutor().For(this->Under.size() / 4, PixelsAtATime, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
    {
      std::copy_n(this->ColorUnder(pixelOf(i), props), 4, &this->Under[4 * i]);
    }
  });
  SMPExecutor().For(count, PixelsAtATime, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
    {
      const std::size_t p = pixelOf(i).Index;
      if (i < blurred.size())
      {
        pixels.WindowDepth[p] = 1.0f;
      }
      if (isWhole)
      {
        std::copy_n(&this->Under[4 * i], 4, &pixels.Color[4 * p]);
      }
    }
  });
}

void FrameFinish::Finish(const SplattedPicture& picture, const DepthRange& range, float deepest,
  std::size_t begin, std::size_t end)
{
  float* windowDepth = this->Pixels->WindowDepth.data();
  if (this->Pixels->Distances.empty())
  {
    std::fill(windowDepth + begin, windowDepth + end, 1.0f);
  }
  JoinDepths(picture.Depth + begin, end - begin, range, windowDepth + begin);
  for (std::size_t p = begin; p < end && deepest < 1.0f; ++p)
  {
    windowDepth[p] = std::min(windowDepth[p], picture.Color[4 * p + 3] > 0.0f ? deepest : 1.0f);
  }
  if (this->IsWhole)
  {
    this->Mix(picture, begin, end);
  }
}

void FrameFinish::Mix(const SplattedPicture& picture, std::size_t begin, std::size_t end)
{
  for (std::size_t p = begin; p < end; ++p)
  {
    const float* color = picture.Color + 4 * p;
    float* under = &this->Pixels->Color[4 * p];
    if (color[3] > 0.0f)
    {
      this->InLight ? MixLightOver(color, under) : MixOver(color, under);
    }
  }
}
}
