// SPDX-License-Identifier: BSD-3-Clause
/**
 * Layers of the A-buffer: unions of overlapping z-ranges, and what has room in them.
 */
#include "Core/Raster/TileRaster.h"
#include "TestScene.h"
#include "Testing/Shared/Check.h"
#include "WideSplats.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

using namespace SurfelSplatting;
using namespace WideSplats;

namespace
{
/// A layer of a coarse grid.
struct CellLayer
{
  float Near, Weight, Red, Depth; ///< the last three are sums, depths from Near on
  double HalfRange = 0.0, Far = 0.0;
};

bool Same(const CellLayer& a, const CellLayer& b)
{
  return a.Near == b.Near && a.Weight == b.Weight && a.Red == b.Red && a.Depth == b.Depth;
}

/// The layers of splats that come by near depth, in double: they end behind a gap, or two lengths
/// behind their mean end.
std::vector<CellLayer> LayersInOrder(std::vector<Wide> splats)
{
  std::stable_sort(
    splats.begin(), splats.end(), [](const Wide& a, const Wide& b) { return a.Near < b.Near; });
  std::vector<CellLayer> layers;
  for (const Wide& w : splats)
  {
    bool begins = layers.empty();
    if (!begins)
    {
      const CellLayer& last = layers.back();
      const double end = last.Near + (last.Depth + last.HalfRange) / last.Weight;
      const double step = w.Near > last.Far ? 0.0 : 2.0 * (end - last.Near);
      begins = w.Near - end > step + 1e-9;
    }
    if (begins)
    {
      layers.push_back({ w.Near, 0.0f, 0.0f, 0.0f, 0.0, w.Near });
    }
    CellLayer& open = layers.back();
    const double begin = std::max<double>(open.Far, w.Near);
    open.Far = begin + std::min(1.0, w.Weight / 0.003) * std::max(0.0, w.Far - begin);
    const float z = 0.5f * (w.Near + w.Far);
    open.Weight += w.Weight;
    open.Red += w.Weight * w.Red;
    open.Depth += w.Weight * (z - open.Near);
    open.HalfRange += w.Weight * 0.5 * (w.Far - w.Near);
  }
  return layers;
}

/// Layers of a coarse grid, which are handed over whole.
class RecordingCells : public CellSink
{
public:
  std::vector<CellLayer> Layers[Size * Size];

  void Receive(const CellLayers& layers) override
  {
    const OpenLayers& open = layers.Tile.Open[layers.Block];
    for (int l = 0; l < PixelsPerBlock; ++l)
    {
      if ((layers.Lanes >> l & 1) != 0)
      {
        const int x = layers.X + l % BlockSize, y = layers.Y + l / BlockSize;
        this->Layers[y * Size + x].push_back(
          { layers.Tile.Coarse[layers.Block].Near[l], open.Weight[l], open.Red[l], open.Depth[l] });
      }
    }
  }

  /// @return the layers of a stream, for each pixel
  explicit RecordingCells(const std::vector<Wide>& splats)
  {
    SplatList list;
    TileBins bins;
    FillList(splats, false, list, bins);
    Picture picture(Size, Size);
    TileRaster raster;
    raster.SetCoarse({ 5.0f, 1.0f }, *this);
    raster.Render(list, bins, 0, picture.Get());
  }
};

/// The stream with one open layer per pixel, on z-ranges of few bits: ends that touch exactly,
/// equal ranges, ranges within ranges. Weights sum to less than what has room, and float sums are
/// exact.
void TestStream(Random& random)
{
  std::vector<Wide> splats;
  const int count = random.Integer(0, 30);
  for (int i = 0; i < count; ++i)
  {
    Wide w;
    w.Near = static_cast<float>(random.Integer(-40, 40));
    w.Far = w.Near + static_cast<float>(random.Integer(0, 6) * random.Integer(0, 1));
    // exp(-0) is 1 in the raster too: weights are exact.
    w.Weight = static_cast<float>(random.Integer(1, 16)) / 512.0f;
    w.Red = 0.5f;
    splats.push_back(w);
  }
  const std::vector<CellLayer> expected = LayersInOrder(splats);
  for (const std::vector<CellLayer>& pixel : RecordingCells(splats).Layers)
  {
    CHECK(pixel.size() == expected.size());
    CHECK(std::equal(pixel.begin(), pixel.end(), expected.begin(), expected.end(), Same));
  }
}

TEST_CASE("Streams of splats")
{
  Random random(7);
  for (int i = 0; i < 300; ++i)
  {
    TestStream(random);
  }
}

/// A splat of hardly any weight does not join two surfaces of a cell, however long it is.
TEST_CASE("Bridge")
{
  const Wide front{ 1.0f, 1.25f, 0.5f, 0.5f }, back{ 4.0f, 4.25f, 0.5f, 0.5f };
  const Wide bridge{ 1.125f, 5.0f, 1.0f / 256.0f, 0.5f };
  for (const std::vector<CellLayer>& pixel : RecordingCells({ front, bridge, back }).Layers)
  {
    REQUIRE(pixel.size() == 2);
    CHECK(pixel[1].Near == 4.0f);
  }
}

/// Tiny steps of a weight move the pixel a little.
TEST_CASE("Continuity in the weight")
{
  for (const bool onLens : { false, true })
  {
    constexpr int Steps = 1500;
    double largest = 0.0;
    Pixel last{};
    for (int i = 0; i <= Steps; ++i)
    {
      const float weight = 1.5f * static_cast<float>(i) / Steps;
      const Pixel p = Draw({ { 1.0f, 2.0f, 0.5f, 1.0f, 0.9f, 0.2f, 0.0f },
                             { 1.5f, 2.5f, weight, 0.5f, 0.9f, 0.1f, 0.1f },
                             { 2.0f, 3.0f, 0.4f, 0.0f, 0.8f, 0.3f, -0.2f },
                             { 4.0f, 5.0f, 0.7f, 1.0f, 1.0f, -0.2f, 0.0f } },
        onLens);
      largest = i > 0 ? std::max(largest, Difference(p, last)) : 0.0;
      last = p;
    }
    // Room falls from all to nothing over RippleInFocus of the weight: by 10 times the step, of
    // a splat of 0.4.
    std::printf(
      "weight%s: %.1f of a step at most\n", onLens ? ", lens" : "", largest * Steps / 1.5);
    CHECK(largest < 5.0 * 1.5 / Steps);
  }
}

/// Far apart, layers are composited as they are: min(1, sum w) of mean opacity and colour, over
/// what is behind.
TEST_CASE("Far apart")
{
  for (const bool onLens : { false, true })
  {
    for (const float weight : { 0.25f, 0.8f, 1.25f })
    {
      const Wide a{ 1.0f, 1.5f, weight, 1.0f, 0.6f, 0, 0 };
      const Wide b{ 100.0f, 101.0f, 0.5f, 0.25f, 0.8f, 0, 0 };
      const double alpha = std::min(1.0, static_cast<double>(weight)) * 0.6;
      const Pixel p = Draw({ a, b }, onLens);
      CHECK_NEAR(p.Red, alpha + (1.0 - alpha) * 0.5 * 0.8 * 0.25, 1e-6);
      CHECK_NEAR(p.Alpha, 1.0 - (1.0 - alpha) * (1.0 - 0.4), 1e-6);
      CHECK_NEAR(p.Depth, alpha > 0.5 ? 1.25 : p.Alpha > 0.5 ? 100.5 : 0.0, 1e-4);
    }
  }
}

/// A full layer takes nothing more, and what comes to one with little room adds little.
TEST_CASE("Full layers")
{
  for (const bool onLens : { false, true })
  {
    const float ripple = onLens ? 0.25f : 0.1f, full = 1.0f + ripple;
    const Wide more{ 1.5f, 2.5f, 1.0f, 0.0f, 1.0f, 0, 0 };
    const Wide first{ 1.0f, 2.0f, full, 1.0f, 1.0f, 0, 0 };
    CHECK(Difference(Draw({ first, more }, onLens), Draw({ first }, onLens)) == 0.0);
    Wide nearly = first;
    nearly.Weight = full - 0.1f * ripple; // a tenth of it counts
    const Pixel p = Draw({ nearly, more }, onLens);
    const double least = onLens ? 0.1 * ripple : 0.1; // through a lens, no more than the room
    CHECK_NEAR(p.Red, nearly.Weight / (nearly.Weight + least), 1e-5);
    nearly.Weight = 0.99f; // all of it, if there is room
    const Pixel q = Draw({ nearly, more }, onLens);
    CHECK_NEAR(q.Red, nearly.Weight / (nearly.Weight + (onLens ? full - 0.99 : 1.0)), 1e-6);
  }
}

TestCloud RandomCloud()
{
  Random random(6);
  TestCloud cloud;
  for (int i = 0; i < 250; ++i)
  {
    TestSurfel s;
    const double z = random.Uniform(1.0, 4.0);
    s.Position = { random.Uniform(-0.6, 0.6) * z, random.Uniform(-0.6, 0.6) * z, z };
    s.Normal = random.Direction();
    s.SigmaU = random.Uniform(0.02, 0.2);
    s.SigmaV = random.Uniform(0.02, 0.2);
    s.Area = 4.0 * s.SigmaU * s.SigmaV;
    s.Opacity = static_cast<float>(random.Uniform(0.2, 1.0));
    s.TwoSided = true;
    cloud.Add(s);
  }
  return cloud;
}

TEST_CASE("Scene")
{
  constexpr int Width = 40, Height = 36;
  const TestCloud cloud = RandomCloud();
  const std::vector<SurfelCloud> clouds{ cloud.Get() };
  SplatContext context = TestContext();
  context.Camera = PinholeView(Width, Height, 40.0);
  context.Optics = { 0.05, 2.0 };
  for (const bool coarseGrids : { false, true })
  {
    context.CoarseGrids = coarseGrids;
    RecordingSink sink(Width, Height);
    const Picture picture = RenderPicture(context, clouds, SerialExecutor(), nullptr, &sink);
    int several = 0;
    for (std::size_t i = 0; i < sink.Parts.size(); ++i)
    {
      several += sink.Parts[i].size() > 1 ? 1 : 0;
      double red = 0.0, alpha = 0.0, before = 0.0;
      for (const VisibleLayer& part : sink.Parts[i])
      {
        red += part.Red;
        alpha += part.Alpha;
        before = part.Depth;
        CHECK(part.Depth > 0.0f);
      }
      // The frame is made of what the sink received: four roundings for each of a few parts.
      CHECK_NEAR(picture.Color[4 * i], red, 2e-6);
      CHECK_NEAR(picture.Color[4 * i + 3], alpha, 2e-6);
      CHECK((alpha == 0.0) == (before == 0.0));
    }
    CHECK(several > Width * Height / 10);
  }
}

/// The z-buffer for comparison: of opaque surfaces in focus, the A-buffer's picture.
TEST_CASE("Depth buffered")
{
  SplatContext context = TestContext();
  context.Camera = PinholeView(128, 128, 150.0);
  TestCloud cloud;
  Random random(4);
  for (int i = 0; i < 40000; ++i)
  {
    TestSurfel s;
    const bool ball = i % 2 == 0;
    s.Normal = random.Direction();
    s.Position = { 0.5 * s.Normal[0], 0.5 * s.Normal[1], 2.0 + 0.5 * s.Normal[2] };
    s.Area = 4.0 * Pi * 0.25 / 20000;
    if (!ball) // a wall that the ball sticks in, slanted
    {
      s.Normal = { 0.6, 0.0, -0.8 };
      const double across = random.Uniform(-1.5, 1.5);
      s.Position = { 0.8 * across, random.Uniform(-1.5, 1.5), 2.2 + 0.6 * across };
      s.Area = 9.0 / 20000;
    }
    s.SigmaU = s.SigmaV = 0.6 * std::sqrt(s.Area);
    s.Color = { static_cast<float>(ball), static_cast<float>(0.5 + 0.5 * s.Position[0]), 0, 1 };
    cloud.Add(s);
  }
  const Picture layers = RenderPicture(context, cloud);
  context.DepthBuffered = true;
  const Picture nearest = RenderPicture(context, cloud);
  int off = 0;
  for (std::size_t i = 0; i < layers.Color.size(); i += 4)
  {
    off += std::abs(layers.Color[i] - nearest.Color[i]) > 0.1f ? 1 : 0;
  }
  CHECK(off < 128 * 128 / 40); // silhouettes, where nothing is behind the nearest layer
  std::printf("z-buffer: %d of %d pixels off\n", off, 128 * 128);
}
}
