// SPDX-License-Identifier: BSD-3-Clause
/**
 * What is in focus unless someone says so: the front of what is in the middle of a picture.
 */
#include "Core/Picture/MiddleFront.h"
#include "Testing/Shared/Check.h"

#include <cstddef>
#include <functional>
#include <vector>

using namespace SurfelSplatting;

namespace
{
constexpr int Width = 160, Height = 120;

/// @param depth of a pixel, whose place is relative to the middle of the picture
double FrontOf(const std::function<double(double, double)>& depth)
{
  std::vector<float> depths;
  for (int y = 0; y < Height; ++y)
  {
    for (int x = 0; x < Width; ++x)
    {
      depths.push_back(static_cast<float>(depth(x - 0.5 * (Width - 1), y - 0.5 * (Height - 1))));
    }
  }
  return MiddleFront(depths.data(), Width, Height);
}
}

TEST_CASE("A fifth of the middle is nearer")
{
  // The middle has a radius of 15 px. A slope has a fifth of a disc's area below -0.4922 radii.
  const double front = FrontOf([](double x, double) { return 10.0 + x / 15.0; });
  CHECK_NEAR(front, 10.0 - 0.4922, 0.02);
  // What is beside the middle does not count.
  const auto disc = [](double x, double y) { return x * x + y * y < 15.0 * 15.0 ? 3.0 : 1.0; };
  CHECK_NEAR(FrontOf(disc), 3.0, 0.0);
}

TEST_CASE("The less the middle shows, the more its surroundings count")
{
  CHECK_NEAR(FrontOf([](double, double) { return 0.0; }), 0.0, 0.0);
  // A ring: half of it is nearer.
  const auto ring = [](double x, double y) {
    const double radius = x * x + y * y;
    return radius > 40.0 * 40.0 && radius < 50.0 * 50.0 ? 20.0 + 0.01 * x : 0.0;
  };
  CHECK_NEAR(FrontOf(ring), 20.0, 0.02);
  // A mast before a wall whose middle is a hole: the bulk is sharp, not the mast alone.
  const auto mast = [](double x, double y) {
    return x * x < 4.0 ? 5.0 : x * x + y * y < 15.0 * 15.0 ? 0.0 : 9.0;
  };
  CHECK_NEAR(FrontOf(mast), 9.0, 0.0);
  CHECK_NEAR(FrontOf([](double x, double) { return x * x < 81.0 ? 5.0 : 9.0; }), 5.0, 0.0);
}

TEST_CASE("Pictures of a pixel")
{
  const float depth = 2.5f;
  CHECK_NEAR(MiddleFront(&depth, 1, 1), 2.5, 0.0);
}
