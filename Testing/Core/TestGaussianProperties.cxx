// SPDX-License-Identifier: BSD-3-Clause
/**
 * Gaussians in space with surfels: the same picture at any number of threads, by several ranks and
 * as layers; cells of the lens; input that nobody should send.
 */
#include "Core/Hierarchy/HierarchyCut.h"
#include "Core/Lens/GaussianFootprint.h"
#include "Core/Splats/SplatList.h"
#include "Core/Splats/SplatMaker.h"
#include "TestScene.h"
#include "Testing/Shared/Check.h"
#include "ThreadRanks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>

using namespace SurfelSplatting;

namespace
{
constexpr int Width = 141, Height = 118;
constexpr float Infinity = std::numeric_limits<float>::infinity();
constexpr float NotANumber = std::numeric_limits<float>::quiet_NaN();

/// Between 1.2 and 3.5 units; many at equal depths.
TestCloud MakeGaussians(CloudKind kind, int count, std::uint64_t seed)
{
  Random random(seed);
  TestCloud cloud;
  cloud.Kind = kind;
  cloud.NumberOfHarmonics = 4;
  for (int i = 0; i < count; ++i)
  {
    const double z = i % 3 == 0 ? 2.5 : random.Uniform(1.2, 3.5);
    TestGaussian g;
    g.Position = { random.Uniform(-0.6, 0.6) * z, random.Uniform(-0.6, 0.6) * z, z };
    g.Covariance = RandomCovariance({ 0.05 * random(), 0.03 * random(), 0.03 }, random);
    g.Density = static_cast<float>(random() * (kind == CloudKind::Volume ? 4.0 : 0.7));
    cloud.Add(g);
    for (int k = 0; k < 12; ++k)
    {
      cloud.Harmonics.push_back(static_cast<float>(random.Uniform(-0.5, 1.0)));
    }
  }
  return cloud;
}

TestCloud MakeSurfels()
{
  Random random(5);
  TestCloud cloud;
  for (int i = 0; i < 2500; ++i)
  {
    const double z = i % 2 == 0 ? 2.5 : random.Uniform(1.5, 4.0);
    TestSurfel s =
      SquareSurfel({ random.Uniform(-0.5, 0.1) * z, random.Uniform(-0.5, 0.5) * z, z }, 0.05);
    s.Opacity = i % 4 == 0 ? 0.5f : 1.0f;
    s.TwoSided = true;
    cloud.Add(s);
  }
  return cloud;
}

/// Clouds of all kinds, with and without hierarchies.
struct Scene
{
  TestCloud Capture = MakeGaussians(CloudKind::Capture, 4000, 1);
  TestCloud Volume = MakeGaussians(CloudKind::Volume, 4000, 2), Surfels = MakeSurfels();
  TestHierarchy Captures{ MakeGaussians(CloudKind::Capture, 4000, 3) };
  TestHierarchy Volumes{ MakeGaussians(CloudKind::Volume, 4000, 4) };

  std::vector<SurfelCloud> Clouds() const
  {
    return { this->Capture.Get(), this->Volumes.Get(), this->Surfels.Get(), this->Captures.Get(),
      this->Volume.Get() };
  }
};

SplatContext ContextOf(double radius)
{
  SplatContext context;
  context.Camera = PinholeView(Width, Height, 110.0);
  context.Optics = { radius, 1.6 };
  return context;
}

constexpr double Radii[] = { 0.0, 0.04, 0.25 };

TEST_CASE("Threads and order of work")
{
  const Scene scene;
  for (const double radius : Radii)
  {
    const SplatContext context = ContextOf(radius);
    const Picture expected = RenderPicture(context, scene.Clouds());
    CHECK(*std::max_element(expected.Color.begin(), expected.Color.end()) > 0.5f);
    CHECK(Same(expected, RenderPicture(context, scene.Clouds(), BackwardExecutor())));
    for (const unsigned int threads : { 1u, 2u, 3u, 8u })
    {
      CHECK(Same(expected, RenderPicture(context, scene.Clouds(), ThreadExecutor(threads))));
    }
    const TestHierarchy parallel(MakeGaussians(CloudKind::Volume, 4000, 4), ThreadExecutor(3));
    CHECK(Same(
      RenderPicture(context, { parallel.Get() }), RenderPicture(context, { scene.Volumes.Get() })));
  }
}

TEST_CASE("Several ranks")
{
  const Scene scene;
  const std::vector<SurfelCloud> clouds = scene.Clouds();
  for (const double radius : { 0.0, 0.25 })
  {
    for (const int cells : { 1, 7 })
    {
      SplatContext context = ContextOf(radius);
      context.SkipHidden = false; // what is skipped depends on what comes first
      context.Sampling.Count = cells;
      const Picture expected = RenderPicture(context, clouds);
      Picture picture(Width, Height);
      ThreadRanks::Run(3, [&](Ranks& group) {
        const std::size_t first[] = { 0, 2, 3, 5 };
        const std::size_t rank = static_cast<std::size_t>(group.Rank());
        const std::vector<SurfelCloud> own(&clouds[0] + first[rank], &clouds[0] + first[rank + 1]);
        SplatExchange exchange(group);
        Picture other(Width, Height);
        RenderTarget target = group.IsRoot() ? picture.Get() : other.Get();
        target.Exchange = &exchange;
        Splatter().Render(context, own, SerialExecutor(), target);
      });
      CHECK(Same(picture, expected));
    }
  }
}

/// Sums up what layers add to the picture.
class LayerSum : public LayerSink
{
public:
  std::vector<double> Sums = std::vector<double>(4 * Width * Height);

  void Receive(int x, int y, const VisibleLayer& layer) override
  {
    double* sum = &this->Sums[4 * static_cast<std::size_t>(y * Width + x)];
    sum[0] += layer.Red;
    sum[1] += layer.Green;
    sum[2] += layer.Blue;
    sum[3] += layer.Alpha;
  }
};

/// Layers for a sink are those of pixels.
TEST_CASE("Layers")
{
  const Scene scene;
  for (const double radius : Radii)
  {
    SplatContext context = ContextOf(radius);
    LayerSum sink;
    const Picture layers = RenderPicture(context, scene.Clouds(), SerialExecutor(), nullptr, &sink);
    double worst = 0.0;
    for (std::size_t i = 0; i < sink.Sums.size(); ++i)
    {
      worst = std::max(worst, std::abs(sink.Sums[i] - layers.Color[i]));
    }
    CHECK(worst < 2e-5); // up to some hundred float sums of up to 1
  }
}

/// Nothing that is hidden matters, in pixels; in cells, see TestGaussianLens.
TEST_CASE("Hidden ones")
{
  TestCloud wall;
  for (int i = 0; i < 60 * 60; ++i)
  {
    wall.Add(SquareSurfel({ (i % 60 - 29.5) * 0.03, (i / 60 - 29.5) * 0.03, 1.0 }, 0.03));
  }
  const Scene scene;
  std::vector<SurfelCloud> clouds = scene.Clouds();
  clouds.push_back(wall.Get());
  for (const double radius : Radii)
  {
    SplatContext context = ContextOf(radius);
    const Picture some = RenderPicture(context, clouds);
    context.SkipHidden = false;
    CHECK(LargestDifference(some, RenderPicture(context, clouds)) <= 1.0 / 512.0);
  }
}

/// Overlapping Gaussians that face the camera, some px apart, grey or of many colours.
TestCloud MakeSheet(double z, float opacity, bool isGrey)
{
  constexpr int side = 120;
  const double step = 1.5 * z / side, sigma = 0.8 * step;
  Random random(6);
  TestCloud cloud;
  cloud.Kind = CloudKind::Capture;
  for (int i = 0; i < side * side; ++i)
  {
    TestGaussian g;
    g.Position = { (i % side + 0.5) * step - 0.75 * z, (i / side + 0.5) * step - 0.75 * z, z };
    g.Covariance = { sigma * sigma, sigma * sigma, 1e-6, 0, 0, 0 };
    g.Density = opacity;
    const float color = isGrey ? 0.2f : static_cast<float>(random());
    g.Color = { color, color, color, 1.0f };
    cloud.Add(g);
  }
  return cloud;
}

/// -> the picture of a curtain before a wall, and the number of splats
/// @param skip draws coarsely what is hidden
std::pair<Picture, std::size_t> RenderTwo(
  SplatContext context, const TestHierarchy& curtain, const TestHierarchy& wall, bool skip)
{
  context.SkipHidden = skip;
  Splatter splatter;
  Picture picture(Width, Height);
  splatter.Render(context, { curtain.Get(), wall.Get() }, SerialExecutor(), picture.Get());
  return { std::move(picture), splatter.Statistics().Splats };
}

/// What little shines through a curtain is drawn coarsely, and looks the same.
TEST_CASE("Behind a curtain")
{
  const TestHierarchy curtain(MakeSheet(1.5, 0.72f, true)), wall(MakeSheet(3.0, 0.9f, false));
  for (const double radius : { 0.0, 0.01, 0.15 }) // the last one in runs
  {
    SplatContext context = ContextOf(radius);
    const auto render = [&](bool skip) { return RenderTwo(context, curtain, wall, skip); };
    const auto [all, allSplats] = render(false);
    const auto [some, fewer] = render(true);
    const double difference = LargestDifference(all, some);
    std::printf("curtain: %.0f splats instead of %.0f, pixels off by %.5f at most\n", 1.0 * fewer,
      1.0 * allSplats, difference);
    CHECK(fewer < 0.75 * allSplats);
    CHECK((difference > 1.0 / 512.0 || radius > 0.1)); // where the lens mixes the wall's colours
    CHECK(difference < 0.04);                          // of what shines through
    CHECK(MeanSquareDifference(all, some) < 0.8 / 255.0 * 0.8 / 255.0);
    context.Cut.Error = 0.1; // asks for more than the curtain hides
    CHECK(LargestDifference(render(false).first, render(true).first) <= 1.0 / 512.0);
    context.Cut = CutSettings();
    context.Cut.Rule = CutRule::Leaves;
    CHECK(LargestDifference(render(false).first, render(true).first) <= 1.0 / 512.0);
  }
}

/// What more of the light shows is drawn coarsely where the lens blurs it, and only there.
TEST_CASE("Behind a thin curtain")
{
  const TestHierarchy curtain(MakeSheet(1.5, 0.5f, true)), wall(MakeSheet(3.0, 0.9f, false));
  for (const double radius : { 0.0, 0.05 })
  {
    SplatContext context = ContextOf(radius);
    const auto render = [&](bool skip) { return RenderTwo(context, curtain, wall, skip); };
    const auto [all, allSplats] = render(false);
    const auto [some, fewer] = render(true);
    const double difference = LargestDifference(all, some);
    std::printf("thin curtain: %.0f splats instead of %.0f, pixels off by %.5f at most\n",
      1.0 * fewer, 1.0 * allSplats, difference);
    CHECK((fewer < 0.75 * allSplats) == (radius > 0.0));
    CHECK(difference < 0.04);
    CHECK(MeanSquareDifference(all, some) < 0.8 / 255.0 * 0.8 / 255.0);
  }
}

/// Cells of the lens come closer to the pinholes.
TEST_CASE("Cells of the lens")
{
  const Scene scene;
  SplatContext context = ContextOf(0.15);
  const Picture one = RenderPicture(context, scene.Clouds());
  context.Sampling.Count = 7;
  const Picture seven = RenderPicture(context, scene.Clouds());
  context.Sampling.Count = 60;
  context.Sampling.Pinholes = true;
  const Picture mean = RenderPicture(context, scene.Clouds());
  CHECK(MeanSquareDifference(seven, mean) < MeanSquareDifference(one, mean));
}

const float OddValues[] = { NotANumber, Infinity, -Infinity, 1e-45f, 1e-38f, 3.4e38f, -3.4e38f,
  1e30f, -1e30f, 1e20f, 0.0f, -0.0f, -1.0f };

/// Some values of Gaussians of all ranks replaced by odd ones; at the lens, behind it and far away.
TestCloud MakeOdd(CloudKind kind, Random& random)
{
  TestCloud cloud = MakeGaussians(kind, 300, random.Bits());
  for (int i = 0; i < 300; ++i)
  {
    const std::size_t n = static_cast<std::size_t>(i);
    const int rank = random.Integer(0, 3);
    const double size = std::pow(10.0, random.Uniform(-6.0, 3.0));
    const Symmetric3 s = RandomCovariance(
      { rank > 0 ? size : 0.0, rank > 1 ? 0.3 * size : 0.0, rank > 2 ? 0.1 * size : 0.0 }, random);
    const double values[] = { s.XX, s.YY, s.ZZ, s.XY, s.YZ, s.XZ };
    std::copy_n(values, 6, &cloud.Covariances[6 * n]);
    cloud.Positions[3 * n + 2] = random.Integer(0, 4) == 0 ? 0.0 : random.Uniform(-1.0, 4.0);
    const float odd = OddValues[random.Integer(0, 12)];
    switch (random.Integer(0, 7))
    {
      case 0:
        cloud.Covariances[6 * n + static_cast<std::size_t>(random.Integer(0, 5))] = odd;
        break;
      case 1:
        cloud.Positions[3 * n + static_cast<std::size_t>(random.Integer(0, 2))] = odd;
        break;
      case 2:
        cloud.Densities[n] = odd;
        break;
      case 3:
        cloud.Colors[4 * n + static_cast<std::size_t>(random.Integer(0, 3))] = odd;
        break;
      case 4:
        cloud.Harmonics[12 * n + static_cast<std::size_t>(random.Integer(0, 11))] = odd;
        break;
      default:
        break;
    }
  }
  return cloud;
}

TEST_CASE("Odd input")
{
  Random random(9);
  for (int repeat = 0; repeat < 60; ++repeat)
  {
    const CloudKind kind = repeat % 2 == 0 ? CloudKind::Capture : CloudKind::Volume;
    TestCloud cloud = MakeOdd(kind, random);
    if (repeat % 10 == 9)
    {
      cloud.LocalToWorld.L[0] = { 0.0, 0.0, 0.0 };
    }
    SplatContext context;
    context.Camera = PinholeView(40, 36, 40.0);
    context.Camera.Parallel = repeat % 7 == 6;
    context.Optics = { Radii[repeat % 3], 2.0 };
    context.CoarseGrids = repeat % 4 != 3;
    context.Cut.Error = repeat % 5 == 0 ? 1.0 : 10.0;
    const TestHierarchy hierarchy(cloud);
    CHECK(IsSane(RenderPicture(context, cloud)));
    CHECK(IsSane(RenderPicture(context, { hierarchy.Get() })));
    context.Optics.FocalDistance = 1e-3;
    context.Optics.Radius = 1e6;
    CHECK(IsSane(RenderPicture(context, { hierarchy.Get(), cloud.Get() })));
  }
}

/// What is no number is counted, and not drawn.
TEST_CASE("Invalid Gaussians")
{
  for (const CloudKind kind : { CloudKind::Capture, CloudKind::Volume })
  {
    for (const float odd : { NotANumber, Infinity, -Infinity })
    {
      TestCloud cloud;
      cloud.Kind = kind;
      for (int i = 0; i < 5; ++i)
      {
        cloud.Add(
          TestGaussian{ { 0, 0, 2 }, { 0.01, 0.01, 0.01, 0, 0, 0 }, 0.5f, { { 1, 1, 1, 1 } } });
      }
      const Picture expected = [&] {
        TestCloud one = cloud;
        one.Densities[0] = one.Densities[1] = one.Densities[2] = one.Densities[3] = 0.0f;
        return RenderPicture(ContextOf(0.0), one);
      }();
      cloud.Positions[1] = odd;
      cloud.Covariances[6 + 3] = odd;
      cloud.Densities[2] = odd;
      cloud.Colors[4 * 3 + 2] = odd;
      Picture picture(Width, Height);
      Splatter splatter;
      splatter.Render(ContextOf(0.0), { cloud.Get() }, SerialExecutor(), picture.Get());
      CHECK(Same(picture, expected));
      CHECK(splatter.Statistics().InvalidSurfels == 4);
    }
  }
}

/// Negative densities are none, also in the nodes above.
TEST_CASE("Negative densities")
{
  for (const CloudKind kind : { CloudKind::Capture, CloudKind::Volume })
  {
    TestCloud cloud = MakeGaussians(kind, 2000, 8), none = cloud;
    for (std::size_t i = 0; i < 2000; i += 3)
    {
      cloud.Densities[i] = -cloud.Densities[i];
      none.Densities[i] = 0.0f;
    }
    const TestHierarchy a(cloud), b(none);
    SplatContext context = ContextOf(0.25);
    context.Cut.Error = 6.0;
    CHECK(Same(RenderPicture(context, { a.Get() }), RenderPicture(context, { b.Get() })));
    CHECK(Same(RenderPicture(context, cloud), RenderPicture(context, none)));
  }
}

/// A sheet of Gaussians that face the lens.
struct Sheet
{
  double Depth, HalfSize, Spacing, Deviation; // world units
  float Opacity;
  std::array<float, 4> Color;
};

void AddSheet(TestCloud& cloud, const Sheet& sheet)
{
  Random random(4);
  const double variance = sheet.Deviation * sheet.Deviation;
  for (double y = -sheet.HalfSize; y < sheet.HalfSize; y += sheet.Spacing)
  {
    for (double x = -sheet.HalfSize; x < sheet.HalfSize; x += sheet.Spacing)
    {
      TestGaussian g;
      g.Position = { x + 0.7 * sheet.Spacing * random(), y + 0.7 * sheet.Spacing * random(),
        sheet.Depth + 0.01 * random() };
      g.Covariance = { variance, variance, 0.01 * variance, 0, 0, 0 };
      g.Density = sheet.Opacity;
      g.Color = sheet.Color;
      cloud.Add(g);
    }
  }
}

/// What blurred sheets hide of an opaque one changes evenly while their opacity grows: also where
/// Gaussians get a border on the lens (WeightOfEllipse), at an opacity of 0.32.
TEST_CASE("No steps by opacity")
{
  for (const bool runs : { false, true })
  {
    Picture last(128, 128);
    double largest = 0.0;
    for (int k = 0; k <= 20; ++k)
    {
      TestCloud cloud;
      cloud.Kind = CloudKind::Capture;
      for (const double depth : { 2.0, 2.1, 2.2 })
      {
        AddSheet(cloud,
          { depth, 0.25, 0.03, 0.015, static_cast<float>(0.3 + 0.003 * k), { { 1, 0, 0, 1 } } });
      }
      AddSheet(cloud, { 3.0, 1.2, 0.05, 0.03, 0.97f, { { 0, 1, 0, 1 } } });
      SplatContext context;
      context.Camera = PinholeView(128, 128, 220.0);
      context.Optics = { 0.12, 1.0 };
      context.GaussianRuns = runs;
      const Picture next = RenderPicture(context, cloud);
      largest = k > 0 ? std::max(largest, LargestDifference(last, next)) : 0.0;
      std::copy(next.Color.begin(), next.Color.end(), last.Color.begin());
    }
    std::printf("a step of 0.003 in opacity: at most %.4f\n", largest);
    CHECK(largest > 0.001);
    // Measured 0.0056; 0.034 if the second moments of what is hidden set in at once.
    CHECK(largest < 0.012);
  }
}

/// Pixels twice as wide as high: the picture is that of square ones, in pairs of rows.
TEST_CASE("Pixels that are not square")
{
  constexpr int size = 96;
  TestCloud cloud;
  cloud.Kind = CloudKind::Capture;
  AddSheet(cloud, { 2.0, 0.25, 0.05, 0.03, 0.9f, { { 1, 0, 0, 1 } } });
  AddSheet(cloud, { 3.0, 1.2, 0.05, 0.03, 0.97f, { { 0, 1, 0, 1 } } });
  SplatContext context;
  context.Camera = PinholeView(size, size, 220.0);
  context.Optics = { 0.12, 1.0 };
  context.GaussianRuns = false;
  const Picture square = RenderPicture(context, cloud);
  context.Camera.Height /= 2;
  context.Camera.Fy *= 0.5;
  context.Camera.Cy *= 0.5;
  const Picture wide = RenderPicture(context, cloud);
  double worst = 0.0;
  for (int y = 0; y < size / 2; ++y)
  {
    for (int x = 0; x < 4 * size; ++x)
    {
      const double mean =
        0.5 * (square.Color[8 * size * y + x] + square.Color[8 * size * y + 4 * size + x]);
      worst = std::max(worst, std::abs(wide.Color[4 * size * y + x] - mean));
    }
  }
  std::printf("pixels that are not square: off by %.3f\n", worst);
  // Their lens is as wide in both directions. A ramp that is sharper than without blur is off by
  // 0.5.
  CHECK(worst < 0.3);
}

/// Whether a box contains those of all splats of a run, and none begins in front of the run.
bool ContainsSplats(const CutRange& run, const CutRange& drawn, const SplatMaker& maker,
  bool footprints, std::size_t& count)
{
  SplatList list;
  list.Clear(footprints);
  list.Resize(drawn.Count);
  SplatOutput output = list.OutputAt(0);
  maker.Make(drawn, output);
  count += output.Count;
  for (std::size_t i = 0; i < output.Count; ++i)
  {
    const PixelBox& box = list.Boxes[i];
    if (box.X0 < run.Box.X0 || box.Y0 < run.Box.Y0 || box.X1 > run.Box.X1 || box.Y1 > run.Box.Y1 ||
      list.Orders[i] < run.Near)
    {
      return false;
    }
  }
  return true;
}

/// No tile misses a splat: runs have boxes that contain their splats, and their ancestors', from
/// anywhere and through any lens.
TEST_CASE("Boxes of runs")
{
  Random random(11);
  for (const CloudKind kind : { CloudKind::Capture, CloudKind::Volume })
  {
    const TestHierarchy hierarchy(MakeGaussians(kind, 20000, 12));
    const SurfelCloud cloud = hierarchy.Get();
    const double reach = kind == CloudKind::Capture ? LargestGaussianReach : LargestVolumeReach;
    std::size_t own = 0, ofAncestors = 0, within = 0;
    for (int i = 0; i < 100; ++i)
    {
      SplatContext context;
      const Vector3 d = random.Direction(), to{ 0.0, 0.0, 2.3 };
      const double distance = i % 4 == 0 ? 1.0 : random.Uniform(2.0, 20.0);
      const Vector3 from = to + Vector3{ distance * d[0], distance * d[1], distance * d[2] };
      context.Camera = LookAt(from, to, random.Direction(), random.Uniform(20.0, 90.0), 256, 256);
      context.Optics.FocalDistance = distance * random.Uniform(0.5, 2.0);
      context.Optics.Radius = i % 3 == 0 ? 0.0 : distance * random.Uniform(0.001, 0.1);
      context.Optics.Shape = i % 5 == 1 ? LensShape{ 2.0, 0.5, 0.0 } : LensShape();
      context.Camera.Fy *= i % 6 == 5 ? 0.5 : 1.0;
      if (i % 7 == 1) // the paper's lens has the most variance
      {
        context.Settings.Kernel = KernelType::Gaussian;
        context.Settings.Cutoff = 20.0;
      }
      const double variance =
        DefocusVariance(context.Settings.Kernel, 1.0, TruncatedGaussian(context.Settings.Cutoff));
      const CutCamera camera{ context.Camera, context.Optics, std::sqrt(reach), SpacePrefilter,
        variance };
      SplatMaker maker;
      maker.Set(context, cloud);
      CutWork work;
      std::vector<CutRange> runs;
      SelectCut(cloud, camera, context.Cut, SerialExecutor(), work, runs);
      for (const CutRange& run : runs)
      {
        CHECK(ContainsSplats(run, run, maker, context.HasLens(), own));
        within += run.Box.X1 - run.Box.X0 < 256 ? 1 : 0;
        if (run.HasAncestors)
        {
          const HierarchyLayout::Range above = cloud.Clusters->Layout().Above(
            static_cast<int>(run.Level), { run.Begin, run.Count }, LevelsToAncestors);
          CutRange ancestors = run;
          ancestors.Begin = above.Begin;
          ancestors.Count = static_cast<std::uint32_t>(above.Count);
          ancestors.Level += LevelsToAncestors;
          ancestors.Merging = 0.0f;
          CHECK(ContainsSplats(run, ancestors, maker, context.HasLens(), ofAncestors));
        }
      }
    }
    CHECK(own > 100000);
    CHECK(ofAncestors > 1000);
    CHECK(within > 5000); // not all of the picture
    std::printf("boxes: %zu splats, %zu ancestors, %zu runs\n", own, ofAncestors, within);
  }
}
}
