// SPDX-License-Identifier: BSD-3-Clause
/**
 * Cells of the lens are rendered only where surfaces cover one another: elsewhere the picture is
 * the one through the whole lens, and where they do it is the mean of the cells.
 */
#include "TestScene.h"

#include "Core/Base/ThreadExecutor.h"
#include "Core/Lens/LensVisibility.h"
#include "Core/Picture/DoubtfulTiles.h"
#include "Core/Picture/Splatter.h"
#include "Testing/Shared/Check.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <vector>

using namespace SurfelSplatting;

namespace
{
constexpr int Width = 160, Height = 96; // 5 x 3 tiles

struct Values
{
  std::vector<float> Color, Depth;
  explicit Values(float value)
    : Color(4 * Width * Height, value)
    , Depth(Width * Height, value)
  {
  }
  Frame Get() { return { Width, Height, this->Color.data(), this->Depth.data() }; }
};
}

TEST_CASE("The mean rises within doubtful tiles")
{
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::vector<float> doubts(15, 0.0f);
  for (const int tile : { 1, 2, 3, 6, 7, 8, 11, 12, 13 })
  {
    doubts[static_cast<std::size_t>(tile)] = 0.1f; // three columns
  }
  DoubtfulTiles tiles;
  CHECK(tiles.Has(0)); // everywhere
  tiles.Set({ Width, Height }, doubts, 0.05f);
  CHECK_FALSE(tiles.IsEmpty());
  CHECK_FALSE(tiles.Has(0));
  CHECK(tiles.Has(7));
  CHECK(tiles.Tiles({ Width, Height }).Touch({ 20, 20, 40, 40 }));
  CHECK_FALSE(tiles.Tiles({ Width, Height }).Touch({ 0, 0, 32, 96 }));
  CHECK(tiles.Tiles({ Width, Height }).Touch({ -9, -9, 999, 999 }));
  CHECK_FALSE(tiles.Tiles({ Width, Height }).Touch({ 999, 0, 1999, 96 }));
  Values whole(1.0f), mean(2.0f);
  for (int y = 0; y < Height; ++y)
  {
    for (int x = 0; x < 32; ++x)
    {
      mean.Color[4 * (y * Width + x)] = nan; // nothing was rendered there
    }
  }
  tiles.Mix(mean.Get(), whole.Get(), SerialExecutor());
  for (int y = 0; y < Height; ++y)
  {
    for (int x = 0; x < Width; ++x)
    {
      const float inside =
        std::min(static_cast<float>(x) + 0.5f - 32.0f, 127.5f - static_cast<float>(x));
      const float expected = 1.0f + std::min(std::max(inside / 8.0f, 0.0f), 1.0f);
      CHECK_NEAR(whole.Color[4 * (y * Width + x)], expected, 1e-6);
    }
  }
  doubts[7] = doubts[12] = 0.0f;
  tiles.Set({ Width, Height }, doubts, 0.05f);
  CHECK(tiles.Has(7));        // a hole: three of four neighbours
  CHECK_FALSE(tiles.Has(12)); // at the border of the picture: two of three
  tiles.Set({ Width, Height }, doubts, 0.2f);
  CHECK(tiles.IsEmpty());
}

TEST_CASE("No tile flips as its doubt changes")
{
  constexpr float largest = 0.05f;
  std::vector<float> doubts(15, FullDoubt * largest);
  const auto atMiddle = [&](float doubt, int x) {
    doubts[7] = doubt;
    DoubtfulTiles tiles;
    tiles.Set({ Width, Height }, doubts, largest);
    Values whole(1.0f), mean(2.0f);
    tiles.Mix(mean.Get(), whole.Get(), SerialExecutor());
    return whole.Color[4 * (48 * Width + x)] - 1.0f;
  };
  std::fill(doubts.begin(), doubts.end(), 0.0f);
  CHECK(atMiddle(largest, 80) == 0.0f);
  CHECK_NEAR(atMiddle(1.001f * largest, 80), 0.001, 1e-4);
  CHECK_NEAR(atMiddle(1.5f * largest, 80), 0.5, 1e-5);
  CHECK(atMiddle(FullDoubt * largest, 80) == 1.0f);
  CHECK(atMiddle(9.0f * largest, 80) == 1.0f);
  // Beside a tile that has half of the weight, at x = 64, it rises from there.
  std::fill(doubts.begin(), doubts.end(), FullDoubt * largest);
  doubts[6] = doubts[1] = doubts[11] = 1.5f * largest;
  CHECK_NEAR(atMiddle(FullDoubt * largest, 64), 0.5 + 0.5 * 0.5 / 8.0, 1e-5);
  CHECK_NEAR(atMiddle(FullDoubt * largest, 63), 0.5, 1e-5);
  CHECK(atMiddle(FullDoubt * largest, 72) == 1.0f);
}

TEST_CASE("Behind a veil nothing is doubtful")
{
  // T is one half everywhere, and stays so whatever part of the veil has leaked.
  CHECK(VariationBehind(0.0f, 1.0f, 0.5f, 1.0f) == 0.0f);
  CHECK(VariationBehind(0.0f, 1.0f, 0.8f, 1.0f) == 0.0f);
  // Half of the lens is covered: |T - 1/2| is 1/2. What follows may be seen through it or not.
  const float variation = VariationBehind(0.0f, 1.0f, 0.5f, 0.5f);
  CHECK_NEAR(variation, 0.5, 1e-6);
  const LayerCoverage<float> layer{ 0.5f, 0.5f, 0.25f };
  CHECK_NEAR(ShareInterval(0.5f, layer), 0.5, 1e-6);
  // Nothing shines through what covers all.
  CHECK_NEAR(VariationBehind(variation, 0.5f, 0.0f, 1.0f), 0.0, 1e-6);
}

namespace
{
/// Surfels in a plane that faces the camera.
void AddWall(TestCloud& cloud, double z, double left, double right, float red)
{
  constexpr double step = 0.02;
  for (double y = -1.0; y < 1.0; y += step)
  {
    for (double x = left; x < right; x += step)
    {
      TestSurfel s;
      s.Position = { x, y, z };
      s.SigmaU = s.SigmaV = 0.7 * step;
      s.Area = step * step;
      s.Color = { { red, 0.5f, 1.0f - red, 1.0f } };
      cloud.Add(s);
    }
  }
}

double LargestDifference(const Picture& a, const Picture& b, int left, int right)
{
  double largest = 0.0;
  for (int y = 0; y < Height; ++y)
  {
    for (int i = 4 * (y * Width + left); i < 4 * (y * Width + right); ++i)
    {
      largest = std::max<double>(largest, std::abs(a.Color[i] - b.Color[i]));
    }
  }
  return largest;
}
}

TEST_CASE("Cells only where surfaces cover one another")
{
  SplatContext context;
  context.Camera = PinholeView(Width, Height, 50.0);
  context.Optics = { 0.06, 2.0 };
  TestCloud cloud;
  AddWall(cloud, 2.2, -2.0, 2.0, 0.2f);
  AddWall(cloud, 1.6, -2.0, -0.4, 0.9f); // its edge is in the third column of tiles
  Splatter splatter;
  Picture whole(Width, Height), everywhere(Width, Height), some(Width, Height);
  splatter.Render(context, { cloud.Get() }, SerialExecutor(), whole.Get());
  context.Sampling = { 7, false, true };
  splatter.Render(context, { cloud.Get() }, SerialExecutor(), everywhere.Get());
  const std::uint64_t most = splatter.Statistics().Fragments;
  context.Sampling = { 7, false, false };
  splatter.Render(context, { cloud.Get() }, SerialExecutor(), some.Get());
  std::printf("cells: %.0f %% of the fragments\n",
    100.0 * static_cast<double>(splatter.Statistics().Fragments) / static_cast<double>(most));
  CHECK(splatter.Statistics().Fragments < most / 2);
  CHECK(LargestDifference(some, whole, 96, Width) == 0.0);      // one wall
  CHECK(LargestDifference(some, everywhere, 0, Width) < 0.012); // three levels of 255
  CHECK(LargestDifference(some, whole, 64, 96) > 0.0);          // the edge is by cells
  Picture threaded(Width, Height);
  splatter.Render(context, { cloud.Get() }, ThreadExecutor(3), threaded.Get());
  CHECK(some.Color == threaded.Color);
  CHECK(some.Depth == threaded.Depth);
}
