// SPDX-License-Identifier: BSD-3-Clause
// What goes on behind the edges of blurred things: the nearest pixel beside them, as far as the
// blur reaches; nothing behind what is sharp, and a steep surface is not taken for an edge.
#include "Core/Splats/SilhouetteExtension.h"
#include "Testing/Shared/Check.h"

#include <algorithm>
#include <cmath>
#include <functional>

using namespace SurfelSplatting;

namespace
{
constexpr int Width = 80, Height = 60;

/// Nearness in px of blur; the focus is at 10.
struct Scene
{
  std::vector<float> Nearness = std::vector<float>(Width * Height, 0.0f);
  std::vector<float> Confusions = std::vector<float>(Width * Height, -1.0f);

  void Set(int x, int y, float nearness)
  {
    this->Nearness[y * Width + x] = nearness;
    this->Confusions[y * Width + x] = nearness > 0.0f ? std::abs(nearness - 10.0f) : -1.0f;
  }
};

/// A square before a wall on the left and nothing on the right.
Scene SquareBeforeWall(float square, float wall)
{
  Scene scene;
  for (int y = 0; y < Height; ++y)
  {
    for (int x = 0; x < Width; ++x)
    {
      const bool inSquare = x >= 20 && x < 60 && y >= 10 && y < 50;
      scene.Set(x, y, inSquare ? square : x < 40 ? wall : 0.0f);
    }
  }
  return scene;
}

/// How far the blur of a square lets what is behind it be seen, px: as far as its edge moves while
/// the lens is crossed, and an eighth of both blurs.
double Reach(const Scene& scene, float square, std::size_t behind)
{
  return square - scene.Nearness[behind] +
    0.125 * (square - 10.0 + std::max(0.0f, scene.Confusions[behind])) + 2.0;
}

TEST_CASE("Nearest")
{
  for (const float square : { 14.0f, 20.0f })
  {
    const Scene scene = SquareBeforeWall(square, 9.0f);
    SilhouetteExtension hidden;
    hidden.Find(Width, Height, scene.Nearness, scene.Confusions, 0.5, SerialExecutor());
    for (int y = 0; y < Height; ++y)
    {
      for (int x = 0; x < Width; ++x)
      {
        const std::int32_t found = hidden.Behind(static_cast<std::size_t>(y) * Width + x);
        const bool inSquare = x >= 20 && x < 60 && y >= 10 && y < 50;
        if (!inSquare) // the wall's own edge has nothing behind it
        {
          continue;
        }
        double nearest = INFINITY;
        for (std::size_t p = 0; p < Width * Height; ++p)
        {
          const double distance =
            std::hypot(x - static_cast<int>(p) % Width, y - static_cast<int>(p) / Width);
          if (scene.Nearness[p] < square && distance <= Reach(scene, square, p))
          {
            nearest = std::min(nearest, distance);
          }
        }
        CHECK((found != SilhouetteExtension::None) == std::isfinite(nearest));
        if (found == SilhouetteExtension::None)
        {
          continue;
        }
        CHECK(scene.Nearness[found] < square);
        CHECK_NEAR(std::hypot(x - found % Width, y - found / Width), nearest, 1e-6);
      }
    }
  }
}

/// A sharp square hides what is behind it for good; a slope of less than a pixel of blur per pixel
/// is one surface.
TEST_CASE("Nothing behind")
{
  SilhouetteExtension hidden;
  const Scene sharp = SquareBeforeWall(10.2f, 6.0f);
  hidden.Find(Width, Height, sharp.Nearness, sharp.Confusions, 0.5, SerialExecutor());
  Scene slope;
  for (int y = 0; y < Height; ++y)
  {
    for (int x = 0; x < Width; ++x)
    {
      slope.Set(x, y, 12.0f + 0.5f * static_cast<float>(x));
    }
  }
  SilhouetteExtension onSlope;
  onSlope.Find(Width, Height, slope.Nearness, slope.Confusions, 0.5, SerialExecutor());
  for (std::size_t p = 0; p < Width * Height; ++p)
  {
    CHECK((sharp.Confusions[p] > 0.3f || hidden.Behind(p) == SilhouetteExtension::None));
    CHECK(onSlope.Behind(p) == SilhouetteExtension::None);
  }
}

/// Nothing of a steep or round surface goes on behind the rest of it. A wall does behind both.
TEST_CASE("Slopes")
{
  const float wall = 4.0f;
  const auto ball = [](double x, double y) { // 4 px from the last pixel to the one before it
    const double r = std::hypot(x - 40.0, y - 30.0) / 18.0;
    return r < 1.0 ? 20.0 + 12.0 * std::sqrt(1.0 - r * r) : 0.0;
  };
  const auto roof = [](double x, double y) { // 2.5 px per pixel on one side of its ridge
    return x >= 20 && x < 60 && y >= 10 && y < 50 ? 70.0 - (x < 40 ? 0.5 : 2.5) * std::abs(x - 40.0)
                                                  : 0.0;
  };
  for (const std::function<double(double, double)>& shape :
    std::vector<std::function<double(double, double)>>{ ball, roof })
  {
    Scene scene;
    for (int y = 0; y < Height; ++y)
    {
      for (int x = 0; x < Width; ++x)
      {
        scene.Set(x, y, std::max(wall, static_cast<float>(shape(x, y))));
      }
    }
    SilhouetteExtension hidden;
    hidden.Find(Width, Height, scene.Nearness, scene.Confusions, 0.5, SerialExecutor());
    int found = 0;
    for (std::size_t p = 0; p < Width * Height; ++p)
    {
      const std::int32_t behind = hidden.Behind(p);
      CHECK((behind == SilhouetteExtension::None || scene.Nearness[behind] == wall));
      found += behind == SilhouetteExtension::None ? 0 : 1;
    }
    CHECK(found > 500);
  }
}
}
