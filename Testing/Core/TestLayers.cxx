// SPDX-License-Identifier: BSD-3-Clause
/**
 * Layers of the A-buffer: the stream with one open layer per pixel gives the unions of all
 * overlapping z-ranges, front to back; joining and resolving layers.
 */
#include "BruteForceSplatter.h"
#include "Core/Raster/TileRaster.h"
#include "TestScene.h"
#include "Testing/Shared/Check.h"

#include <algorithm>
#include <limits>

using namespace SurfelSplatting;

namespace
{
class RecordingSink : public LayerSink
{
public:
  RecordingSink(int width, int height)
    : Width(width)
    , Layers(static_cast<std::size_t>(width) * height)
  {
  }
  void Receive(int x, int y, const Layer& layer, float) override
  {
    this->Layers[static_cast<std::size_t>(y) * this->Width + x].push_back(layer);
  }

  int Width;
  std::vector<std::vector<Layer>> Layers;
};

bool Same(const Layer& a, const Layer& b)
{
  return a.Near == b.Near && a.Far == b.Far && a.Weight == b.Weight && a.Opacity == b.Opacity &&
    a.Red == b.Red && a.Green == b.Green && a.Blue == b.Blue && a.Depth == b.Depth;
}

/// Values with few bits, so that float sums are exact in any order.
Layer RandomLayer(Random& random)
{
  const auto value = [&random]() { return static_cast<float>(random.Integer(0, 1000)) / 256.0f; };
  Layer l;
  l.Near = value();
  l.Far = l.Near + value();
  l.Weight = value();
  l.Opacity = value();
  l.Red = value();
  l.Green = value();
  l.Blue = value();
  l.Depth = value();
  return l;
}

Layer Joined(Layer a, const Layer& b)
{
  a.Join(b);
  return a;
}

TEST_CASE("Join")
{
  Random random(5);
  for (int i = 0; i < 1000; ++i)
  {
    const Layer a = RandomLayer(random), b = RandomLayer(random), c = RandomLayer(random);
    CHECK(Same(Joined(Joined(a, b), c), Joined(a, Joined(b, c))));
    CHECK(Same(Joined(a, b), Joined(b, a)));
    CHECK(Same(Joined(Layer(), a), a));
    CHECK(a.Overlaps(b) == (std::max(a.Near, b.Near) <= std::min(a.Far, b.Far)));
    CHECK(a.Overlaps(b) == b.Overlaps(a));
    CHECK(!Layer().Overlaps(a));
  }
}

TEST_CASE("Resolve")
{
  Layer l;
  l.Weight = 0.25f; // partial coverage stays what it is
  l.Opacity = 0.125f;
  l.Red = 0.0625f;
  l.Depth = 0.75f;
  ResolvedLayer r = Resolve(l);
  CHECK(r.Red == 0.0625f);
  CHECK(r.Alpha == 0.125f);
  CHECK(r.Depth == 3.0f);
  l.Weight = 4.0f; // min(1, sum w) (sum w o) / (sum w)
  l.Opacity = 2.0f;
  l.Green = 1.0f;
  l.Depth = 10.0f;
  r = Resolve(l);
  CHECK(r.Alpha == 0.5f);
  CHECK(r.Green == 0.25f);
  CHECK(r.Depth == 2.5f);
  l.Weight = l.Opacity = 1.0f;
  CHECK(Resolve(l).Alpha == 1.0f);
  const ResolvedLayer empty = Resolve(Layer());
  CHECK(empty.Red == 0.0f);
  CHECK(empty.Alpha == 0.0f);
  CHECK(empty.Depth == 0.0f);
}

/// A splat so wide that it has its full weight all over a small frame.
Splat WideSplat(float near, float far, float weight)
{
  Splat s{};
  s.X = s.Y = 8.0f;
  s.Shape = -1.0f;
  s.A = s.B = 1e-30f;
  s.Weight = weight;
  s.Near = near;
  s.Far = far;
  s.Gradient = NoGradient;
  s.Red = 0.5f;
  s.Opacity = 1.0f;
  return s;
}

/// Unions by joining whatever overlaps until nothing does: no sorting, no stream.
std::vector<Layer> UnionsByJoining(std::vector<Layer> layers)
{
  for (bool joined = true; joined;)
  {
    joined = false;
    for (std::size_t i = 0; i < layers.size() && !joined; ++i)
    {
      for (std::size_t j = i + 1; j < layers.size() && !joined; ++j)
      {
        if (layers[i].Overlaps(layers[j]))
        {
          layers[i].Join(layers[j]);
          layers.erase(layers.begin() + static_cast<std::ptrdiff_t>(j));
          joined = true;
        }
      }
    }
  }
  std::sort(
    layers.begin(), layers.end(), [](const Layer& a, const Layer& b) { return a.Near < b.Near; });
  return layers;
}

/// The stream itself, on z-ranges of few bits: ends that touch exactly, equal ranges, ranges within
/// ranges.
void TestStream(Random& random)
{
  constexpr int Size = 16;
  SplatList list;
  std::vector<Layer> layers;
  const int count = random.Integer(0, 30);
  for (int i = 0; i < count; ++i)
  {
    const float near = static_cast<float>(random.Integer(-40, 40));
    const float far = near + static_cast<float>(random.Integer(0, 6) * random.Integer(0, 1));
    // exp(-0) is 1 in the raster too: weights are exact.
    const float weight = static_cast<float>(random.Integer(1, 8)) / 64.0f;
    list.Add(WideSplat(near, far, weight), { 0, 0, Size, Size });
    Layer l;
    l.Near = near;
    l.Far = far;
    l.Weight = l.Opacity = weight;
    l.Red = 0.5f * weight;
    l.Depth = weight * 0.5f * (near + far);
    layers.push_back(l);
  }
  TileBins bins;
  BinSplats(list, 0, { Size, Size }, SerialExecutor(), bins);
  SortBins(list, SerialExecutor(), bins);
  RecordingSink sink(Size, Size);
  Picture picture(Size, Size);
  TileRaster raster;
  raster.Set({ 5.0f, 1.0f }, nullptr, &sink, false);
  raster.Render(list, bins, 0, picture.Get());

  const std::vector<Layer> expected = UnionsByJoining(layers);
  for (const std::vector<Layer>& pixel : sink.Layers)
  {
    CHECK(pixel.size() == expected.size());
    CHECK(std::equal(pixel.begin(), pixel.end(), expected.begin(), expected.end(), Same));
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

/// Bound on the relative difference of a layer's sums: q is off by at most 2 sqrt(q tau / h) times
/// the rounding of a position in a picture of 40 px (three operations, two axes); n terms add n
/// roundings.
constexpr double SumTolerance = 2.0 * 2.0 * 6 * 40 * 0x1p-24 + 250 * 0x1p-24;

void CompareLayers(const std::vector<Layer>& actual, const std::vector<Layer>& expected)
{
  for (std::size_t i = 0; i < actual.size(); ++i)
  {
    const Layer &a = actual[i], &e = expected[i];
    CHECK_NEAR(a.Near, e.Near, 0x1p-22 * std::abs(e.Near));
    CHECK_NEAR(a.Far, e.Far, 0x1p-22 * std::abs(e.Far));
    // Kernels that fall to zero do so with a slope of 0.4 / Q there, while that of the Gaussian is
    // half its value: weights below 0.05 have the error of 0.05.
    const double bound = SumTolerance * std::max(e.Weight, 0.05f);
    CHECK_NEAR(a.Weight, e.Weight, bound);
    CHECK_NEAR(a.Opacity, e.Opacity, bound);
    CHECK_NEAR(a.Red, e.Red, bound);
    CHECK_NEAR(a.Depth, e.Depth, 2.0 * e.Far * bound);
    CHECK((i == 0 || actual[i - 1].Far < a.Near)); // front to back, disjoint
  }
}

/// Composites resolved layers front to back: the frame is made of what the sink received.
void CompareFrame(const std::vector<Layer>& layers, const float* rgba)
{
  double transmittance = 1.0, red = 0.0;
  for (const Layer& layer : layers)
  {
    const ResolvedLayer r = Resolve(layer);
    red += transmittance * r.Red;
    transmittance *= 1.0 - r.Alpha;
  }
  CHECK_NEAR(rgba[0], red, 1e-6); // four roundings for each of up to five layers
  CHECK_NEAR(rgba[3], 1.0 - transmittance, 1e-6);
}

TEST_CASE("Scene")
{
  constexpr int Width = 40, Height = 36;
  const TestCloud cloud = RandomCloud();
  const std::vector<SurfelCloud> clouds{ cloud.Get() };
  SplatContext context = TestContext();
  context.Camera = PinholeView(Width, Height, 40.0);
  context.Optics = { 0.05, 2.0 };
  context.CoarseGrids = false; // of splats, not of cells
  RecordingSink sink(Width, Height);
  const Picture picture = RenderPicture(context, clouds, SerialExecutor(), nullptr, &sink);
  const std::vector<std::vector<Layer>> expected = LayersByBruteForce(context, clouds);

  int several = 0, undecided = 0;
  for (std::size_t i = 0; i < expected.size(); ++i)
  {
    several += expected[i].size() > 1 ? 1 : 0;
    CompareFrame(sink.Layers[i], &picture.Color[4 * i]);
    if (expected[i].size() != sink.Layers[i].size())
    {
      ++undecided; // two ends within rounding of each other
      continue;
    }
    CompareLayers(sink.Layers[i], expected[i]);
  }
  CHECK(several > Width * Height / 10);
  CHECK(undecided <= 2);
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

TEST_CASE("Streams of splats")
{
  Random random(7);
  for (int i = 0; i < 300; ++i)
  {
    TestStream(random);
  }
}
