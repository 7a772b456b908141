// SPDX-License-Identifier: BSD-3-Clause
// Pixels that others have drawn, seen through the lens: surfaces stay closed, edges blur as the
// closed forms say, nothing leaks over what is sharp, and what is sharp stays as it is.
#include "Core/Base/LinearLight.h"
#include "Core/Splats/DepthImageSurfels.h"
#include "TestScene.h"
#include "Testing/Shared/Check.h"

#include <array>
#include <cmath>
#include <limits>

using namespace SurfelSplatting;

namespace
{
constexpr int Width = 96, Height = 64, Margin = 16;
constexpr float Nothing = std::numeric_limits<float>::infinity();

/// What an OpenGL renderer leaves: depth and colour by pixel, with a margin.
struct Drawn
{
  static constexpr int Wide = Width + 2 * Margin, High = Height + 2 * Margin;
  std::vector<float> Depth = std::vector<float>(Wide * High, Nothing);
  std::vector<float> Color = std::vector<float>(4 * Wide * High, 0.0f);
  std::vector<float> Limit = std::vector<float>(Width * Height, Nothing);

  void Set(int x, int y, double depth, float red, float green = 0.0f)
  {
    const int p = (y + Margin) * Wide + x + Margin;
    this->Depth[p] = static_cast<float>(depth);
    const float rgba[] = { red, green, 0.0f, 1.0f };
    std::copy_n(rgba, 4, &this->Color[4 * p]);
    if (x >= 0 && x < Width && y >= 0 && y < Height)
    {
      this->Limit[y * Width + x] = static_cast<float>(depth);
    }
  }
};

SplatContext Context(double radius, double focus)
{
  SplatContext context = TestContext();
  context.Camera = PinholeView(Width, Height, 100.0);
  context.Optics = { radius, focus };
  return context;
}

/// The blurred pixels' picture; those that are sharp remain in `drawn` and hide what is behind.
Picture RenderDrawn(const SplatContext& context, Drawn& drawn, std::size_t& taken)
{
  DepthImageSurfels pixels;
  pixels.MakeSurfels(context.Camera, context.Optics,
    { drawn.Depth.data(), drawn.Color.data(), Margin }, drawn.Limit.data(), SerialExecutor());
  taken = pixels.Blurred().size();
  return RenderPicture(context, { pixels.Get() }, SerialExecutor(), drawn.Limit.data());
}

/// 1/z is affine on the screen for any plane.
double PlaneDepth(int x, int y, double tilt)
{
  return 1.0 / (0.5 + tilt * (x - Width / 2) + 0.3 * tilt * (y - Height / 2));
}

TEST_CASE("Planes")
{
  for (const double tilt : { 0.0, 0.002, 0.004 })
  {
    for (const double radius : { 0.0, 0.02, 0.08, 0.2 })
    {
      const SplatContext context = Context(radius, 1.5);
      Drawn drawn;
      for (int y = -Margin; y < Height + Margin; ++y)
      {
        for (int x = -Margin; x < Width + Margin; ++x)
        {
          drawn.Set(x, y, PlaneDepth(x, y, tilt), 0.5f, 0.25f + 0.005f * static_cast<float>(x));
        }
      }
      std::size_t taken = 0;
      const Picture picture = RenderDrawn(context, drawn, taken);
      CHECK((radius > 0.0 || taken == 0));
      CHECK((radius < 0.08 || taken > Width * Height / 2));
      for (int y = 0; y < Height; ++y)
      {
        for (int x = 0; x < Width; ++x)
        {
          // Pixels next to those that are sharp share their edge with them: seen over them. The
          // picture's border does not fade.
          const float through = 1.0f - picture.At(x, y, 3);
          const float* own = &drawn.Color[4 * ((y + Margin) * Drawn::Wide + x + Margin)];
          CHECK_NEAR(picture.At(x, y, 0) + through * own[0], 0.5, 1.0 / 255.0);
          CHECK_NEAR(picture.At(x, y, 1) + through * own[1], own[1], 1.0 / 255.0);
          const bool sharp = drawn.Limit[y * Width + x] != Nothing;
          CHECK((sharp || picture.At(x, y, 3) > 0.5f));
          CHECK((taken < Width * Height || picture.At(x, y, 3) > 0.99f));
        }
      }
    }
  }
}

/// A blurred half-plane over nothing: the disc's share that it covers.
TEST_CASE("Edge")
{
  const double confusion = 8.0, z = 1.0, focus = 2.0;
  const double radius = confusion / 100.0 / (1.0 / z - 1.0 / focus);
  Drawn drawn;
  for (int y = 0; y < Height; ++y)
  {
    for (int x = 0; x < Width / 2; ++x)
    {
      drawn.Set(x, y, z, 1.0f);
    }
  }
  std::size_t taken = 0;
  const Picture picture = RenderDrawn(Context(radius, focus), drawn, taken);
  CHECK(taken == Width / 2 * Height);
  // The paper's Gaussian is off by 0.05, Pearson II by less (Documentation/Method.md); PixelSurplus
  // and squares of pixels add 0.01.
  const double tolerance = TestContext().Settings.Kernel == KernelType::Gaussian ? 0.06 : 0.025;
  for (int x = Width / 2 - 12; x < Width / 2 + 12; ++x)
  {
    const double t = std::clamp((Width / 2 - x - 0.5) / confusion, -1.0, 1.0);
    const double alpha =
      0.5 + (t * std::sqrt(std::max(0.0, 1.0 - t * t)) + std::asin(t)) / 3.14159265358979;
    CHECK_NEAR(picture.At(x, Height / 2, 3), alpha, tolerance);
  }
}

/// A sharp square before a bright blurred wall: inside its silhouette the wall adds nothing. A
/// blurred square before a sharp wall: it spreads over the wall and lets it through.
TEST_CASE("Leakage")
{
  const auto isSquare = [](int x, int y) { return x >= 30 && x < 60 && y >= 20 && y < 44; };
  for (const bool squareIsSharp : { true, false })
  {
    const double square = 1.0, wall = 3.0;
    Drawn drawn;
    for (int y = 0; y < Height; ++y)
    {
      for (int x = 0; x < Width; ++x)
      {
        isSquare(x, y) ? drawn.Set(x, y, square, 0.0f, 1.0f) : drawn.Set(x, y, wall, 5.0f);
      }
    }
    std::size_t taken = 0;
    const Picture picture = RenderDrawn(Context(0.1, squareIsSharp ? square : wall), drawn, taken);
    double outside = 0.0;
    for (int y = 0; y < Height; ++y)
    {
      for (int x = 0; x < Width; ++x)
      {
        if (squareIsSharp && isSquare(x, y))
        {
          CHECK(picture.At(x, y, 0) == 0.0f);
          CHECK(picture.At(x, y, 3) == 0.0f);
        }
        outside += squareIsSharp || isSquare(x, y) ? 0.0 : picture.At(x, y, 1);
      }
    }
    CHECK(taken == (squareIsSharp ? Width * Height - 30 * 24 : 30 * 24));
    CHECK((squareIsSharp || outside > 50.0));
  }
}

/// Taken pixels hide what is behind them where a sharp one is near, and only there: where a plane
/// goes through the focus nothing behind it shows in the gap.
TEST_CASE("Rim")
{
  SplatContext context = Context(0.2, 1.5);
  Drawn drawn;
  for (int y = -Margin; y < Height + Margin; ++y)
  {
    for (int x = -Margin; x < Width + Margin; ++x)
    {
      drawn.Set(x, y, 1.0 / (1.0 / 1.5 + 0.004 * (x - 40)), 0.0f, 1.0f);
    }
  }
  // Blur grows by 0.08 px from column to column: up to column 40 +- 6 all is sharp.
  DepthImageSurfels pixels;
  std::vector<float> limit = drawn.Limit;
  pixels.MakeSurfels(context.Camera, context.Optics,
    { drawn.Depth.data(), drawn.Color.data(), Margin }, limit.data(), SerialExecutor());
  for (const DepthImageSurfels::Pixel& pixel : pixels.Blurred())
  {
    const int x = static_cast<int>(pixel.Index) % Width;
    const bool rim = std::abs(x - 40) <= 6 + RimWidth;
    CHECK((pixel.Under == pixel.Place) == rim);
    CHECK(rim == (limit[pixel.Index] != Nothing));
    CHECK(limit[pixel.Index] >= drawn.Limit[pixel.Index]);
  }
  // A bright wall behind all of it.
  TestCloud wall;
  for (int i = 0; i < 10000; ++i)
  {
    TestSurfel surfel;
    surfel.Position = { -3.0 + 0.06 * (i % 100), -3.0 + 0.06 * (i / 100), 3.0 };
    surfel.SigmaU = surfel.SigmaV = 0.03;
    surfel.Area = 0.06 * 0.06;
    surfel.Color = { 5.0f, 0.0f, 0.0f, 1.0f };
    wall.Add(surfel);
  }
  const Picture picture =
    RenderPicture(context, { wall.Get(), pixels.Get() }, SerialExecutor(), limit.data());
  for (std::size_t p = 0; p < Width * Height; ++p)
  {
    // Where kernels go over from the Gaussian to Pearson II, their sum falls short by 0.01.
    CHECK(picture.At(p % Width, p / Width, 0) < 5.0f * 0.015f);
  }
}

/// Colour of the surfel of one pixel, in linear light. @param red of the picture, times alpha
std::array<float, 4> ColorInLight(float red, float alpha)
{
  const SplatContext context = Context(0.05, 2.0);
  Drawn drawn;
  drawn.Set(50, 30, 1.0, red);
  drawn.Color[4 * ((30 + Margin) * Drawn::Wide + 50 + Margin) + 3] = alpha;
  DepthImage image{ drawn.Depth.data(), drawn.Color.data(), Margin };
  image.LinearLight = true;
  DepthImageSurfels pixels;
  pixels.MakeSurfels(context.Camera, context.Optics, image, drawn.Limit.data(), SerialExecutor());
  REQUIRE(pixels.Size() == 1);
  const float* color = pixels.Get().ColorsFloat;
  return { color[0], color[1], color[2], color[3] };
}

/// Codes become light before their alpha counts: half of a colour is half of its light.
TEST_CASE("Translucent in linear light")
{
  constexpr float alpha = 0.5f, code = 0.6f;
  const auto color = ColorInLight(alpha * code, alpha);
  CHECK_NEAR(color[0], LightOfCode(code), 1e-6);
  CHECK_NEAR(color[3], alpha, 0.0);
}

/// What glows has more colour than alpha: it is not divided by next to nothing.
TEST_CASE("Glow in linear light")
{
  for (const float alpha : { 1e-20f, 0.01f, 0.5f })
  {
    constexpr float code = 0.6f;
    const auto color = ColorInLight(code, alpha);
    CHECK(color[0] * color[3] <= code * 1.001f);
  }
}

/// As wide as the blur and the kernel's rest; nothing where all is sharp.
TEST_CASE("Margin")
{
  const SplatContext context = Context(0.2, 2.0);
  CHECK(MarginOf(context.Camera, context.Optics, 2.0, 2.0) == 0);
  const double widest = 100.0 * 0.2 * (1.0 - 0.5); // f R |1/z - 1/z_f| at 1
  const int margin = MarginOf(context.Camera, context.Optics, 1.0, 3.0);
  CHECK(margin > 1.2 * widest);
  CHECK(margin < 1.3 * widest + 5.0);
  CHECK(MarginOf(context.Camera, context.Optics, 1e-3, 3.0) == MaxMargin);
  CHECK(MarginOf(context.Camera, context.Optics, 0.0, 3.0) == MaxMargin);
}

/// From where the pixels were drawn in the world, through whatever camera.
TEST_CASE("Camera")
{
  SplatContext context = Context(0.05, 2.0);
  const double c = std::cos(0.3), s = std::sin(0.3);
  context.Camera.WorldToCamera.L = { { { c, 0, s }, { 0, 1, 0 }, { -s, 0, c } } };
  context.Camera.WorldToCamera.T = { 1e5, -3.0, 7.0 };
  Drawn drawn;
  drawn.Set(50, 30, 1.0, 1.0f);
  std::size_t taken = 0;
  const Picture picture = RenderDrawn(context, drawn, taken);
  double mass = 0.0, x = 0.0, y = 0.0;
  for (int j = 0; j < Height; ++j)
  {
    for (int i = 0; i < Width; ++i)
    {
      mass += picture.At(i, j, 3);
      x += picture.At(i, j, 3) * i;
      y += picture.At(i, j, 3) * j;
    }
  }
  CHECK(taken == 1);
  CHECK_NEAR(mass, 1.0, 0.15); // one pixel, with the ripple's compensation
  CHECK_NEAR(x / mass, 50.0, 0.01);
  CHECK_NEAR(y / mass, 30.0, 0.01);
}
}
