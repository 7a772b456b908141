// SPDX-License-Identifier: BSD-3-Clause
/**
 * The pixels of a frame while props and splats come together in it. Internal to the module.
 */
#pragma once

#include "Rendering/OpenGL/PassFrame.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <vector>

namespace SurfelSplatting
{
constexpr std::size_t PixelsAtATime = 4096; // of a thread

struct PropPixels
{
  std::vector<float> WindowDepth; ///< [height][width] of the props, then of all that is seen
  std::vector<float> Distances;   ///< [height][width] of the props; infinity where there are none
  std::vector<float> Color;       ///< [height][width][4] of the props, then of all that is seen
  std::vector<float> Background;  ///< the same before the props; one pixel if it is plain
  std::size_t Width = 0;
  bool IsPlain = false;     ///< the background is one colour
  bool HasBackdrop = false; ///< something without a depth, such as a skybox, was drawn

  const float* BackgroundOf(std::size_t p) const
  {
    return &this->Background[this->IsPlain ? 0 : 4 * p];
  }
};

/// Converts window depths to distances along the view direction, infinity where nothing was drawn.
inline void ToDistances(
  const float* windowDepth, std::size_t count, const DepthRange& range, float* distances)
{
  std::transform(windowDepth, windowDepth + count, distances, [&range](float depth) {
    return depth >= 1.0f ? std::numeric_limits<float>::infinity()
                         : static_cast<float>(range.DistanceOf(depth));
  });
}
}
