// SPDX-License-Identifier: BSD-3-Clause
/**
 * Families of degenerate input, each under every aperture, kernel, choice of detail and number of
 * lens cells: no NaN, no negative pixel, alpha at most 1, the same pixels at 1, 2 and 8 threads, in
 * bounded time; and where surfels are drawn one by one, what double precision makes of them, within
 * the bound of BruteForceSplatter.h.
 */
#include "BruteForceSplatter.h"
#include "TestScene.h"
#include "Testing/Shared/Check.h"

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <functional>
#include <limits>
#include <string>

using namespace SurfelSplatting;

namespace
{
constexpr int Width = 48, Height = 40;
constexpr double FocalLength = 40.0;
constexpr double Focus = 2.0;

struct Family
{
  std::string Name;
  TestCloud Cloud;
  View Camera = PinholeView(Width, Height, FocalLength);
  bool Judge = true; ///< whether its surfels are within the reach of the reference's bounds
};

TestSurfel RandomSurfel(Random& random)
{
  TestSurfel s;
  const double z = random.Uniform(1.0, 4.0);
  s.Position = { random.Uniform(-0.6, 0.6) * z, random.Uniform(-0.5, 0.5) * z, z };
  s.Normal = random.Direction();
  s.SigmaU = random.Uniform(0.02, 0.1);
  s.SigmaV = random.Uniform(0.02, 0.1);
  s.Area = 6.0 * s.SigmaU * s.SigmaV;
  s.Color = { { static_cast<float>(random.Uniform(0, 1)), 0.5f,
    static_cast<float>(random.Uniform(0, 1)), 1.0f } };
  s.TwoSided = random.Integer(0, 1) == 1;
  return s;
}

TestSurfel FacingSurfel(Random& random)
{
  TestSurfel s = RandomSurfel(random);
  s.Normal = { 0, 0, -1 };
  return s;
}

/// A family of surfels that start from random ones.
Family MakeFamily(
  const std::string& name, int count, const std::function<void(Random&, int, TestSurfel&)>& change)
{
  Family family;
  family.Name = name;
  Random random(std::hash<std::string>()(name));
  for (int i = 0; i < count; ++i)
  {
    TestSurfel s = i % 2 == 0 ? RandomSurfel(random) : FacingSurfel(random);
    change(random, i, s);
    family.Cloud.Add(s);
  }
  return family;
}

double PowerOfTen(Random& random, int low, int high)
{
  return std::pow(10.0, random.Integer(low, high));
}

std::vector<Family> PlacesAndShapes()
{
  std::vector<Family> families;
  families.push_back(MakeFamily("edge-on", 60, [](Random& random, int, TestSurfel& s) {
    Vector3 u, v;
    Tangents(Normalized(s.Position), u, v);
    const double tilt = PowerOfTen(random, -18, -1) * random.Integer(-1, 1);
    s.Normal = Normalized(
      { u[0] - tilt * s.Position[0], u[1] - tilt * s.Position[1], u[2] - tilt * s.Position[2] });
  }));
  families.push_back(MakeFamily("near plane", 60, [](Random& random, int i, TestSurfel& s) {
    const double z[] = { -1.0, -1e-9, 0.0, 1e-300, 1e-30, 1e-9, 1e-3, 0.05, 0.1, 0.1000001 };
    s.Position[2] = z[i % 10];
    s.Position[0] *= random.Integer(0, 1) == 0 ? 1.0 : std::abs(z[i % 10]);
  }));
  families.back().Camera.Near = 0.1;
  families.push_back(MakeFamily("at the lens", 60, [](Random& random, int, TestSurfel& s) {
    const double scale = PowerOfTen(random, -12, -1);
    for (double& x : s.Position)
    {
      x *= scale;
    }
    s.SigmaU *= scale;
    s.SigmaV *= scale;
    s.Area *= scale * scale;
  }));
  families.push_back(MakeFamily("radii", 60, [](Random& random, int, TestSurfel& s) {
    const double scale = PowerOfTen(random, -12, 12);
    s.SigmaU *= scale;
    s.SigmaV *= scale;
    s.Area *= scale * scale;
  }));
  families.back().Judge = false; // 1e24 of weight in a sum beside 1e-24
  families.push_back(MakeFamily("needles", 60,
    [](Random& random, int, TestSurfel& s) { s.SigmaU *= PowerOfTen(random, -18, 0); }));
  families.push_back(MakeFamily("no extent", 60, [](Random& random, int, TestSurfel& s) {
    s.SigmaU = random.Integer(0, 1) == 0 ? 0.0 : 1e-30;
    s.SigmaV = 0.0;
  }));
  families.push_back(MakeFamily("far away", 60, [](Random& random, int, TestSurfel& s) {
    const double scale = PowerOfTen(random, 1, 14);
    for (double& x : s.Position)
    {
      x *= scale;
    }
    s.SigmaU *= scale;
    s.SigmaV *= scale;
    s.Area *= scale * scale;
  }));
  families.back().Judge = false; // z-ranges at 1e14 are float's grid
  return families;
}

std::vector<Family> ValuesAndViews()
{
  std::vector<Family> families;
  families.push_back(MakeFamily("opacities", 60, [](Random& random, int, TestSurfel& s) {
    const float values[] = { 0.0f, 1e-30f, 1e-7f, 0.5f, 1.0f, 1e7f, 1e30f, -1.0f };
    s.Opacity = values[random.Integer(0, 7)];
    s.Color[3] = values[random.Integer(3, 4)];
  }));
  families.push_back(MakeFamily("coincident", 60, [](Random& random, int, TestSurfel& s) {
    s.Position = { 0.1, -0.1, random.Integer(0, 1) == 0 ? 2.0 : 3.0 };
  }));
  families.push_back(MakeFamily("map coordinates", 60, [](Random&, int, TestSurfel&) {}));
  families.back().Cloud.LocalToWorld.T = { 1e7, -1e7, 5e6 };
  families.back().Camera.WorldToCamera.T = { -1e7, 1e7, -5e6 };
  families.push_back(MakeFamily("parallel", 60, [](Random&, int, TestSurfel&) {}));
  families.back().Camera.Parallel = true;
  families.back().Camera.Fx = families.back().Camera.Fy = 15.0;
  for (const double angle : { 0.001, 179.0, 179.999 })
  {
    Family family = MakeFamily(
      "view angle", 60, [](Random&, int i, TestSurfel& s) { s.Position[0] *= i % 3 == 0 ? 0 : 1; });
    family.Name += " " + std::to_string(angle);
    family.Camera.Fx = family.Camera.Fy = 0.5 * Height / std::tan(0.5 * angle * Pi / 180.0);
    family.Judge = angle > 1.0; // 2e6 px: a pixel is finer than float's grid of the splats' places
    families.push_back(family);
  }
  Family odd = MakeFamily("NaN, infinity, denormals", 60, [](Random&, int, TestSurfel&) {});
  constexpr float infinity = std::numeric_limits<float>::infinity();
  const float values[] = { std::numeric_limits<float>::quiet_NaN(), infinity, -infinity, 1e-45f,
    -1e-45f, 3.4e38f, -3.4e38f, 1e-38f };
  Random random(77);
  for (int i = 0; i < 60; i += 2)
  {
    const float value = values[random.Integer(0, 7)];
    switch (random.Integer(0, 4))
    {
      case 0:
        odd.Cloud.Positions[3 * i + random.Integer(0, 2)] = value;
        break;
      case 1:
        odd.Cloud.Covariances[6 * i + random.Integer(0, 5)] = value;
        break;
      case 2:
        odd.Cloud.AreaVectors[3 * i + random.Integer(0, 2)] = value;
        break;
      case 3:
        odd.Cloud.Colors[4 * i + random.Integer(0, 3)] = value;
        break;
      default:
        odd.Cloud.Opacities[i] = value;
    }
  }
  odd.Judge = false; // what has no value has no reference
  families.push_back(odd);
  return families;
}

/// The lens that gives a point at infinity a circle of confusion of this radius in px.
Lens LensOf(double confusion, const View& view)
{
  return { confusion * Focus / view.Fx, Focus };
}

void CheckAgainstDoublePrecision(
  const SplatContext& context, const SurfelCloud& cloud, const Picture& picture, long& judged)
{
  const std::vector<ReferencePixel> reference = RenderByBruteForce(context, { cloud });
  const bool opaque = std::all_of(cloud.Opacities, cloud.Opacities + cloud.NumberOfSurfels,
    [](float opacity) { return opacity == 1.0f; });
  const double shortCut = ShortCutBound(context, opaque);
  for (std::size_t i = 0; i < reference.size(); ++i)
  {
    const ReferencePixel& r = reference[i];
    if (r.Undecided)
    {
      continue;
    }
    ++judged;
    for (int c = 0; c < 4; ++c)
    {
      CHECK_NEAR(picture.Color[4 * i + c], r.Color[c], r.ColorBound + shortCut);
    }
  }
}

/// One family under all settings. Returns the number of pixels that the reference judged.
long CheckFamily(const Family& family)
{
  const TestHierarchy hierarchy(family.Cloud);
  const SurfelCloud leaves = family.Cloud.Get(), nodes = hierarchy.Get();
  long judged = 0;
  for (const double confusion : { 0.0, 1e-6, 1e-3, 1.0, 30.0, 1e3, 1e6 })
  {
    for (const KernelType kernel : { KernelType::Gaussian, KernelType::PearsonII })
    {
      SplatContext context;
      context.Camera = family.Camera;
      context.Optics = confusion > 0.0 ? LensOf(confusion, family.Camera) : Lens();
      context.Settings.Kernel = kernel;
      struct Choice
      {
        CutRule Rule;
        double Error;
        int Cells;
      };
      for (const Choice& choice : { Choice{ CutRule::Leaves, 1.0, 1 },
             Choice{ CutRule::Leaves, 1.0, 3 }, Choice{ CutRule::Moments, 1.0, 1 },
             Choice{ CutRule::Moments, 50.0, 4 }, Choice{ CutRule::Paper, 1.0, 1 } })
      {
        context.Cut.Rule = choice.Rule;
        context.Cut.Error = choice.Error;
        context.Sampling.Count = choice.Cells;
        const SurfelCloud& cloud = choice.Rule == CutRule::Leaves ? leaves : nodes;
        const Picture one = RenderPicture(context, { cloud });
        CHECK(IsSane(one));
        CHECK(Same(one, RenderPicture(context, { cloud }, ThreadExecutor(2))));
        CHECK(Same(one, RenderPicture(context, { cloud }, ThreadExecutor(8))));
      }
      // The judge knows no coarse grids: an approximation with a test of its own.
      if (family.Judge && confusion <= 30.0)
      {
        context.Sampling.Count = 1;
        context.CoarseGrids = context.SkipHidden = false;
        CheckAgainstDoublePrecision(context, leaves, RenderPicture(context, { leaves }), judged);
      }
    }
  }
  return judged;
}

/// Of processor time, since other programs may keep the machine busy. A release build takes a few
/// seconds for each case; quadratic work would take hours. A sanitizer takes up to 200 times as
/// long for large buffers, and is not there to measure time.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr double MaxSeconds = std::numeric_limits<double>::infinity();
#else
constexpr double MaxSeconds = 100.0;
#endif

/// Of all threads.
double SecondsSince(std::clock_t start)
{
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}
/// The smallest picture, and the largest that anybody asks for.
TEST_CASE("Picture sizes")
{
  const auto begin = std::clock();
  Family family = MakeFamily("sizes", 60, [](Random&, int, TestSurfel&) {});
  for (const int size : { 1, 8192 })
  {
    const auto start = std::clock();
    SplatContext context;
    context.Camera = PinholeView(size, size, 0.8 * size);
    context.Optics = LensOf(0.02 * size, context.Camera);
    const Picture one = RenderPicture(context, { family.Cloud.Get() }, ThreadExecutor(2));
    CHECK(IsSane(one));
    CHECK(Same(one, RenderPicture(context, { family.Cloud.Get() }, ThreadExecutor(3))));
    std::printf("%d x %d: %.2f s\n", size, size, SecondsSince(start));
  }
  CHECK(SecondsSince(begin) < MaxSeconds);
}

/// A million surfels at one place, with and without their hierarchy: quadratic work would take
/// hours.
TEST_CASE("Coincident")
{
  const auto begin = std::clock();
  TestCloud cloud;
  TestSurfel s;
  s.Position = { 0, 0, 3.0 };
  s.SigmaU = s.SigmaV = 0.2;
  s.Area = 0.2;
  for (int i = 0; i < 1000000; ++i)
  {
    cloud.Add(s);
  }
  const auto start = std::clock();
  const TestHierarchy hierarchy(cloud, ThreadExecutor(2));
  for (const double confusion : { 0.0, 12.0 })
  {
    SplatContext context;
    context.Camera = PinholeView(Width, Height, FocalLength);
    context.Optics = LensOf(confusion, context.Camera);
    context.Settings.Kernel = confusion > 0.0 ? KernelType::PearsonII : KernelType::Gaussian;
    for (const SurfelCloud& each : { cloud.Get(), hierarchy.Get() })
    {
      const Picture picture = RenderPicture(context, { each }, ThreadExecutor(2));
      CHECK(IsSane(picture));
      CHECK_NEAR(picture.At(Width / 2, Height / 2, 3), 1.0, 1e-4);
    }
  }
  std::printf("a million at one place: %.2f s\n", SecondsSince(start));
  CHECK(SecondsSince(begin) < MaxSeconds);
}
}

TEST_CASE("Families of clouds")
{
  std::vector<Family> families = PlacesAndShapes();
  for (Family& family : ValuesAndViews())
  {
    families.push_back(std::move(family));
  }
  for (const Family& family : families)
  {
    const auto start = std::clock();
    const long judged = CheckFamily(family);
    const double seconds = SecondsSince(start);
    std::printf("%-26s %6.2f s, %6ld pixels judged\n", family.Name.c_str(), seconds, judged);
    CHECK(seconds < MaxSeconds);
    CHECK((!family.Judge || judged > 5000));
  }
}
