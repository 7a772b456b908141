// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Picture/MiddleFront.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace SurfelSplatting
{
namespace
{
constexpr double MiddleHeight = 0.25; // of the middle over that of the picture
constexpr double FrontShare = 0.2;    // of the middle that is nearer than what is in focus
constexpr double LeastFilled = 0.5;   // of the middle, below which it shows little

/// The value below which a share of the others is, between the two nearest ones.
double Quantile(std::vector<float>& values, double share)
{
  const double place = share * static_cast<double>(values.size() - 1);
  const auto below = values.begin() + static_cast<std::ptrdiff_t>(place);
  std::nth_element(values.begin(), below, values.end());
  const double value = *below;
  const double next =
    below + 1 == values.end() ? value : *std::min_element(below + 1, values.end());
  return value + (place - std::floor(place)) * (next - value);
}
}

double MiddleFront(const float* depths, int width, int height)
{
  const double middleX = (width - 1) / 2.0, middleY = (height - 1) / 2.0;
  const double reach = MiddleHeight * height / 2.0;
  const auto seenWithin = [&](double radius, std::size_t& pixels) {
    std::vector<float> seen;
    pixels = 0;
    for (int y = 0; y < height; ++y)
    {
      for (int x = 0; x < width; ++x)
      {
        const double dx = x - middleX, dy = y - middleY;
        if (dx * dx + dy * dy < radius * radius)
        {
          ++pixels;
          const float depth = depths[static_cast<std::size_t>(y) * width + x];
          if (depth > 0.0f)
          {
            seen.push_back(depth);
          }
        }
      }
    }
    return seen;
  };
  std::size_t pixels = 0;
  std::vector<float> seen = seenWithin(reach, pixels);
  const double filled = static_cast<double>(seen.size()) / std::max<std::size_t>(1, pixels);
  const double lack = std::max(0.0, 1.0 - filled / LeastFilled);
  if (lack > 0.0)
  {
    const double corner = std::sqrt(middleX * middleX + middleY * middleY);
    seen = seenWithin(reach + lack * corner, pixels);
  }
  return seen.empty() ? 0.0 : Quantile(seen, FrontShare + lack * (0.5 - FrontShare));
}
}
