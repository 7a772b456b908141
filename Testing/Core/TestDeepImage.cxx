// SPDX-License-Identifier: BSD-3-Clause
// Deep pictures: cells of the lens joined by hand, and scenes whose samples are tidy and give the
// picture when they are composited.
#include "Core/Picture/DeepImage.h"
#include "Core/Picture/MedianDepths.h"
#include "TestScene.h"
#include "Testing/Shared/Check.h"

#include <algorithm>
#include <cmath>

using namespace SurfelSplatting;

namespace
{
/// What a layer adds that is seen through `through` of the lens.
VisibleLayer SeenThrough(float through, float alpha, float red, float depth)
{
  const float seen = through * alpha;
  return { seen * red, 0.0f, 0.0f, seen, depth, alpha };
}

/// Two cells: half of the lens sees A (z = 1) before B (z = 2), the other half C (z = 3) alone.
TEST_CASE("Two cells")
{
  DeepImage deep;
  deep.Begin(2, 1);
  deep.BeginCell();
  deep.BeginTile({ 0, 0, 2, 1 });
  deep.Receive(0, 0, SeenThrough(1.0f, 0.5f, 1.0f, 1.0f));
  deep.Receive(0, 0, SeenThrough(0.5f, 1.0f, 2.0f, 2.0f));
  deep.BeginCell();
  deep.BeginTile({ 0, 0, 2, 1 });
  deep.Receive(0, 0, SeenThrough(1.0f, 0.8f, 4.0f, 3.0f));
  deep.Finish(SerialExecutor());
  REQUIRE(deep.Offsets().size() == 3);
  CHECK(deep.Offsets()[1] == 3);
  CHECK(deep.Offsets()[2] == 3);
  const DeepSample* s = deep.Samples().data();
  // T: 1, then 0.5 (1 - 0.5) + 0.5, then 0.5, then 0.5 (1 - 0.8).
  const double through[] = { 1.0, 0.75, 0.5, 0.1 };
  const double visible[] = { 0.5 * 0.5 * 1.0, 0.5 * 0.5 * 2.0, 0.5 * 0.8 * 4.0 };
  for (int i = 0; i < 3; ++i)
  {
    CHECK_NEAR(s[i].Alpha, 1.0 - through[i + 1] / through[i], 1e-6);
    CHECK_NEAR(s[i].Red, visible[i] / through[i], 1e-6);
    CHECK_NEAR(s[i].Depth, i + 1.0, 0.0);
  }
}

/// A layer that leaks bit by bit: bits join the sample before, in each pixel and tile of their own,
/// and a tile that is drawn again begins anew. Sum and mean depth stay.
TEST_CASE("Leaking bits")
{
  DeepImage deep;
  deep.Begin(40, 3);
  for (int cell = 0; cell < 2; ++cell)
  {
    deep.BeginCell();
    deep.BeginTile({ 0, 0, 32, 3 });
    deep.BeginTile({ 32, 0, 40, 3 });
    for (const int x : { 3, 35 })
    {
      for (int i = 0; i < 100; ++i)
      {
        deep.Receive(x, 1, { 0.0005f, 0.001f, 0.0f, 0.001f, 1.0f + 0.01f * (i + cell), 0.001f });
      }
      deep.Receive(x, 1, { 0.5f, 0.0f, 0.0f, 0.6f, 3.0f, 1.0f });
      deep.Receive(x, 1, { 0.1f, 0.0f, 0.0f, 0.1f, 4.0f, 1.0f });
    }
  }
  deep.Finish(SerialExecutor());
  std::size_t pixels = 0;
  for (std::size_t p = 0; p < 120; ++p)
  {
    const std::uint64_t begin = deep.Offsets()[p], count = deep.Offsets()[p + 1] - begin;
    if (count == 0)
    {
      continue;
    }
    ++pixels;
    double red = 0.0, green = 0.0, through = 1.0, depth = 0.0;
    for (std::uint64_t i = begin; i < begin + count; ++i)
    {
      const DeepSample& s = deep.Samples()[i];
      red += through * s.Red;
      green += through * s.Green;
      depth += through * s.Alpha * s.Depth;
      through *= 1.0 - s.Alpha;
    }
    CHECK(count == 4); // the bits of each cell at their mean depth, and two layers
    CHECK_NEAR(red, 0.05 + 0.5 + 0.1, 1e-5);
    CHECK_NEAR(green, 0.1, 1e-5);
    CHECK_NEAR(through, 0.2, 1e-5);
    CHECK_NEAR(depth, 0.1 * 1.5 + 0.6 * 3.0 + 0.1 * 4.0, 1e-4);
  }
  CHECK(pixels == 2);
}

/// Gaussians of a volume join as far as they reach, and farther where they are faint; surfaces stay
/// apart, and end what they lie in.
TEST_CASE("Media")
{
  DeepImage deep;
  deep.Begin(1, 1, true);
  deep.BeginCell();
  deep.BeginTile({ 0, 0, 1, 1 });
  const auto add = [&](float alpha, float depth, float spread) {
    VisibleLayer layer = SeenThrough(1.0f, alpha, 2.0f, depth);
    layer.Spread = spread;
    deep.Receive(0, 0, layer);
  };
  add(0.1f, 1.0f, 0.5f);
  add(0.1f, 2.0f, 0.5f); // two deviations behind the first
  add(0.1f, 3.0f, 0.6f);
  add(0.1f, 3.1f, 0.5f);
  add(0.1f, 3.2f, 0.0f);
  add(0.0001f, 3.6f, 0.5f);
  add(0.1f, 3.4f, 0.0f); // of a surface that leaks later
  add(0.1f, 4.1f, 0.1f);
  add(0.03f, 5.0f, 0.5f);
  add(0.03f, 8.9f, 0.5f); // almost eight
  add(0.03f, 8.95f, 0.5f);
  deep.Finish(SerialExecutor());
  const DeepSample* s = deep.Samples().data();
  const float begins[] = { 0.5f, 2.5f, 3.2f, 3.4f, 3.4f, 3.85f, 4.5f, 8.925f };
  const float ends[] = { 2.5f, 3.2f, 3.2f, 3.4f, 3.85f, 4.2f, 8.925f, 9.45f };
  REQUIRE(deep.Samples().size() == 8);
  double through = 1.0;
  for (int i = 0; i < 8; ++i)
  {
    CHECK_NEAR(s[i].Depth, begins[i], 2e-6);
    CHECK_NEAR(s[i].Back, ends[i], 2e-6);
    CHECK((i == 0 || s[i].Depth >= s[i - 1].Back));
    through *= 1.0 - s[i].Alpha;
  }
  CHECK_NEAR(s[0].Alpha, 0.2, 1e-6);
  CHECK_NEAR(through, 1.0 - 0.7901, 1e-6);
}

/// A Gaussian of a volume at the depth of a surface is not moved behind the next one there.
TEST_CASE("Media at the depth of surfaces")
{
  DeepImage deep;
  deep.Begin(1, 1, true);
  deep.BeginCell();
  deep.BeginTile({ 0, 0, 1, 1 });
  for (const float spread : { 0.0f, 0.5f, 0.0f })
  {
    VisibleLayer layer = SeenThrough(1.0f, 0.2f, 2.0f, 3.4f);
    layer.Spread = spread;
    deep.Receive(0, 0, layer);
  }
  deep.Finish(SerialExecutor());
  for (std::size_t i = 1; i < deep.Samples().size(); ++i)
  {
    CHECK(deep.Samples()[i].Depth >= deep.Samples()[i - 1].Back);
  }
}

/// In the layer at which half of alpha is reached, in each pixel and tile of its own.
TEST_CASE("Median depths")
{
  float depths[2 * 40] = { 7.0f, 7.0f };
  MedianDepths medians(40, 2, depths);
  for (const PixelBox& tile : { PixelBox{ 0, 0, 32, 2 }, PixelBox{ 32, 0, 40, 2 } })
  {
    medians.BeginTile(tile);
    for (int i = 0; i < 4; ++i)
    {
      const float depth = 1.0f + i;
      medians.Receive(tile.X0 + 1, 0, SeenThrough(1.0f, 0.01f, 1.0f, depth));
      medians.Receive(tile.X0 + 2, 1, SeenThrough(1.0f, i == 2 ? 0.6f : 0.1f, 1.0f, 2 * depth));
    }
    medians.Receive(tile.X0 + 3, 1, SeenThrough(1.0f, 1.0f, 1.0f, 5.0f));
    medians.EndTile(tile);
  }
  for (const int x : { 0, 32 })
  {
    CHECK(depths[x] == 0.0f);
    CHECK(depths[x + 1] == 3.0f); // as much alpha is in front of it as from it on
    CHECK(depths[40 + x + 2] == 6.0f);
    CHECK(depths[40 + x + 3] == 5.0f);
  }
}

/// Equal depths are one sample; what adds nothing is left out.
TEST_CASE("Tidy")
{
  DeepImage deep;
  deep.Begin(1, 1);
  for (int cell = 0; cell < 2; ++cell)
  {
    const float alpha = cell == 0 ? 0.25f : 0.75f;
    deep.BeginCell();
    deep.BeginTile({ 0, 0, 1, 1 });
    deep.Receive(0, 0, SeenThrough(1.0f, alpha, 1.0f, 1.0f));
    deep.Receive(0, 0, SeenThrough(1.0f - alpha, 1.0f, 3.0f, 2.0f));
    deep.Receive(0, 0, SeenThrough(0.0f, 1.0f, 1.0f, 3.0f));
  }
  deep.Finish(SerialExecutor());
  CHECK(deep.Samples().size() == 2);
  CHECK_NEAR(deep.Samples()[0].Alpha, 0.5, 1e-6);
  CHECK_NEAR(deep.Samples()[1].Alpha, 1.0, 1e-6);
  CHECK_NEAR(deep.Samples()[1].Red, 3.0, 1e-6);
  deep.Begin(3, 2);
  deep.BeginCell();
  deep.Finish(SerialExecutor());
  CHECK(deep.Samples().empty());
  CHECK(deep.Offsets().size() == 7);
}

/// Colour gradients, several translucent layers, in focus and out of it.
TestCloud Cloud()
{
  Random random(9);
  TestCloud cloud;
  for (int i = 0; i < 4000; ++i)
  {
    TestSurfel s;
    const int layer = random.Integer(0, 3);
    s.Position = { random.Uniform(-0.6, 0.6), random.Uniform(-0.6, 0.6), 1.0 + 0.5 * layer };
    s.SigmaU = s.SigmaV = 0.03;
    s.Area = 0.002;
    s.Opacity = layer == 3 ? 1.0f : 0.4f;
    for (int c = 0; c < 3; ++c)
    {
      s.Color[c] = static_cast<float>(random.Uniform(0.0, 1.0));
    }
    s.TwoSided = true;
    cloud.Add(s);
  }
  return cloud;
}

void CheckPixel(const DeepImage& deep, const Picture& picture, int x, int y, float limit)
{
  const std::size_t p = picture.Index(x, y);
  double flat[4] = {}, through = 1.0;
  for (std::uint64_t i = deep.Offsets()[p]; i < deep.Offsets()[p + 1]; ++i)
  {
    const DeepSample& s = deep.Samples()[i];
    CHECK((i == deep.Offsets()[p] || s.Depth > deep.Samples()[i - 1].Depth));
    CHECK(s.Alpha > 0.0f);
    CHECK(s.Alpha <= 1.0f);
    CHECK(s.Depth <= limit);
    const float color[] = { s.Red, s.Green, s.Blue, s.Alpha };
    for (int c = 0; c < 4; ++c)
    {
      CHECK(color[c] >= 0.0f);
      flat[c] += through * color[c];
    }
    through *= 1.0 - s.Alpha;
  }
  for (int c = 0; c < 4; ++c)
  {
    CHECK_NEAR(flat[c], picture.At(x, y, c), DeepImage::MinTransmittance + 1e-5);
  }
}

void CompareScene(const SplatContext& context, const std::vector<SurfelCloud>& clouds, float limit)
{
  const int width = context.Camera.Width, height = context.Camera.Height;
  const std::vector<float> limits(static_cast<std::size_t>(width) * height, limit);
  DeepImage deep;
  deep.Begin(width, height);
  const Picture picture = RenderPicture(context, clouds, SerialExecutor(), limits.data(), &deep);
  deep.Finish(SerialExecutor());
  CHECK(deep.Samples().size() > static_cast<std::size_t>(width) * height);
  for (int y = 0; y < height; ++y)
  {
    for (int x = 0; x < width; ++x)
    {
      CheckPixel(deep, picture, x, y, limit);
    }
  }
  // The same at any number of threads.
  DeepImage again;
  again.Begin(width, height);
  RenderPicture(context, clouds, ThreadExecutor(4), limits.data(), &again);
  again.Finish(ThreadExecutor(4));
  CHECK(again.Offsets() == deep.Offsets());
  CHECK(std::equal(deep.Samples().begin(), deep.Samples().end(), again.Samples().begin(),
    [](const DeepSample& a, const DeepSample& b) {
      return a.Red == b.Red && a.Green == b.Green && a.Blue == b.Blue && a.Alpha == b.Alpha &&
        a.Depth == b.Depth;
    }));
}
}

TEST_CASE("Flattened image is the picture")
{
  const TestCloud cloud = Cloud();
  const TestHierarchy hierarchy(cloud);
  SplatContext context = TestContext();
  context.Camera = PinholeView(70, 50, 60.0);
  for (const double radius : { 0.0, 0.05, 0.3 })
  {
    context.Optics = { radius, 1.5 };
    for (const int cells : { 1, 7 })
    {
      context.Sampling.Count = cells;
      CompareScene(context, { cloud.Get() }, INFINITY);
      CompareScene(context, { hierarchy.Get() }, INFINITY);
      CompareScene(context, { cloud.Get() }, 1.8f);
    }
  }
}
