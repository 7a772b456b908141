// SPDX-License-Identifier: BSD-3-Clause
/**
 * What Gaussians of captures cover of one another (CaptureOverlap.h): closed forms, and foliage in
 * a wide blur against pinholes.
 */
#include "Core/Hierarchy/CaptureOverlap.h"
#include "Core/Hierarchy/NodeCheck.h"
#include "Core/Surfels/NodePacking.h"
#include "TestScene.h"
#include "Testing/Shared/Check.h"

#include <cmath>
#include <cstdio>

using namespace SurfelSplatting;

namespace
{
constexpr float Opacity = 0.8f;

/// Adds n discs at random on a square of a plane with normal n, side by side `times` over.
struct Leaflet
{
  Vector3 Center, U, V; ///< half sides
  int Discs;
  double Times;
};

void Add(const Leaflet& leaf, Random& random, TestCloud& cloud)
{
  const double side = 2.0 * Norm(leaf.U);
  const double sigma = side * std::sqrt(leaf.Times / (2.0 * Pi * Opacity * leaf.Discs));
  for (int i = 0; i < leaf.Discs; ++i)
  {
    const double u = random.Uniform(-1.0, 1.0), v = random.Uniform(-1.0, 1.0);
    TestGaussian g;
    Symmetric3 s{};
    for (int k = 0; k < 3; ++k)
    {
      g.Position[k] = leaf.Center[k] + u * leaf.U[k] + v * leaf.V[k];
    }
    const auto add = [&](const Vector3& axis) {
      const double scale = sigma / Norm(axis);
      s.XX += scale * scale * axis[0] * axis[0];
      s.YY += scale * scale * axis[1] * axis[1];
      s.ZZ += scale * scale * axis[2] * axis[2];
      s.XY += scale * scale * axis[0] * axis[1];
      s.YZ += scale * scale * axis[1] * axis[2];
      s.XZ += scale * scale * axis[0] * axis[2];
    };
    add(leaf.U);
    add(leaf.V);
    g.Covariance = s;
    g.Density = Opacity;
    cloud.Add(g);
  }
}

TestCloud MakeWall(double times)
{
  Random random(1);
  TestCloud cloud;
  cloud.Kind = CloudKind::Capture;
  Add({ { 0, 0, 3 }, { 1, 0, 0 }, { 0, 1, 0 }, 20000, times }, random, cloud);
  return cloud;
}

/// Leaves at random in a ball, each covered four times over.
TestCloud MakeFoliage()
{
  Random random(2);
  TestCloud cloud;
  cloud.Kind = CloudKind::Capture;
  for (int i = 0; i < 150; ++i)
  {
    Vector3 p;
    do
    {
      p = { random.Uniform(-1, 1), random.Uniform(-1, 1), random.Uniform(-1, 1) };
    } while (Norm(p) > 1.0);
    const double a = random.Uniform(0, 2 * Pi), z = random.Uniform(-1, 1);
    const Vector3 n{ std::sqrt(1 - z * z) * std::cos(a), std::sqrt(1 - z * z) * std::sin(a), z };
    const Vector3 other = std::abs(n[0]) < 0.7 ? Vector3{ 1, 0, 0 } : Vector3{ 0, 1, 0 };
    Vector3 u = Cross(n, other);
    const double half = 0.035 / Norm(u);
    u = { half * u[0], half * u[1], half * u[2] };
    Add({ { 0.4 * p[0], 0.4 * p[1], 3.0 + 0.4 * p[2] }, u, Cross(n, u), 40, 4.0 }, random, cloud);
  }
  return cloud;
}

/// Mean and largest share of the nodes of a level.
struct Shares
{
  double Mean = 0.0, Largest = 0.0;

  Shares(const TestHierarchy& hierarchy, int level)
  {
    const SurfelCloud cloud = hierarchy.Get();
    const HierarchyLayout& layout = hierarchy.Order.Layout;
    const int tree = HierarchyLayout::TwoSided;
    const std::uint64_t count = layout.Count(level, tree);
    for (std::uint64_t j = 0; j < count; ++j)
    {
      const double share = cloud.OverlapOf(layout.Begin(level, tree) + j);
      this->Mean += share / static_cast<double>(count);
      this->Largest = std::fmax(this->Largest, share);
    }
  }
};

TEST_CASE("Patches of a wall")
{
  for (const double times : { 1.0, 3.0, 8.0 })
  {
    const TestHierarchy wall(MakeWall(times));
    const SurfelCloud cloud = wall.Get();
    CHECK(AreNodesOfKernels(cloud, wall.Order.Layout, SerialExecutor()));
    double kept = 0.0;
    const std::uint64_t patches = wall.Order.Layout.NumberOfLeaves() / 4;
    for (std::uint64_t j = 0; j < patches; ++j)
    {
      kept += (1.0 - OverlapOfPatch(cloud, 4 * j, 4 * j + 4)) / static_cast<double>(patches);
    }
    const double depth = times * DepthOverOpacity(1.0 * Opacity);
    const double expected = (1.0 - std::exp(-depth)) / depth;
    std::printf("covered %.0f times: keeps %.3f, by closed form %.3f\n", times, kept, expected);
    CHECK_NEAR(kept / expected, 1.0, 0.25); // four samples tell an area roughly
    // It is a surface, but for its grain: nodes keep all.
    CHECK(Shares(wall, 5).Mean < 0.01);
  }
}

TEST_CASE("Foliage is no surface")
{
  const TestHierarchy foliage(MakeFoliage());
  CHECK(Shares(foliage, 6).Mean > 0.4);
  CHECK(Shares(foliage, 6).Largest < 1.0);
}

TEST_CASE("Gaussians at one place, none, and few")
{
  TestCloud cloud;
  cloud.Kind = CloudKind::Capture;
  for (int i = 0; i < 9; ++i)
  {
    TestGaussian g;
    g.Density = i < 4 ? 0.9f : 0.0f;
    g.Position = { 0.0, 0.0, i < 8 ? 1.0 : 2.0 };
    cloud.Add(g);
  }
  const TestHierarchy hierarchy(cloud);
  const SurfelCloud leaves = hierarchy.Get();
  for (std::uint64_t begin = 0; begin < 9; ++begin)
  {
    for (std::uint64_t end = begin; end <= std::min<std::uint64_t>(9, begin + 4); ++end)
    {
      const double overlap = OverlapOfPatch(leaves, begin, end);
      CHECK(overlap >= 0.0);
      CHECK(overlap < 1.0);
      CHECK((end - begin > 2 || overlap == 0.0));
    }
  }
}

/// How far alphas in the middle are from those of pinholes.
struct AlphaError
{
  double Mean = 0.0, RootMeanSquare = 0.0;

  AlphaError(const Picture& picture, const Picture& truth)
  {
    double squared = 0.0;
    for (int y = 32; y < 96; ++y)
    {
      for (int x = 32; x < 96; ++x)
      {
        const double error = picture.At(x, y, 3) - truth.At(x, y, 3);
        this->Mean += error / 4096.0;
        squared += error * error / 4096.0;
      }
    }
    this->RootMeanSquare = std::sqrt(squared);
  }
};

/// Alphas of foliage that the lens blurs, with and without the overlap, against pinholes.
TEST_CASE("Foliage through the lens")
{
  const TestHierarchy foliage(MakeFoliage());
  TestHierarchy without(MakeFoliage());
  for (HierarchyNode& node : without.Nodes)
  {
    SetOverlap(0.0, node);
  }
  for (const double radius : { 0.0, 0.05, 0.1, 0.2 })
  {
    SplatContext context;
    context.Camera = PinholeView(128, 128, 300.0);
    context.Optics = { radius, 1.5 };
    const Picture picture = RenderPicture(context, { foliage.Get() });
    const Picture before = RenderPicture(context, { without.Get() });
    if (radius == 0.0)
    {
      CHECK(Same(picture, before));
      continue;
    }
    context.Cut.Rule = CutRule::Leaves;
    context.Sampling.Pinholes = true;
    context.Sampling.Count = 128;
    const Picture truth = RenderPicture(context, { foliage.Get() });
    const AlphaError error(picture, truth), old(before, truth);
    std::printf("lens %.2f: alpha off by %.3f, rms %.3f; without the overlap %.3f, %.3f\n", radius,
      error.Mean, error.RootMeanSquare, old.Mean, old.RootMeanSquare);
    // Where the blur is narrower than a leaf, leaves are drawn, of which each is a surface.
    const double left = radius < 0.1 ? 1.0 : 0.7;
    CHECK(std::abs(error.Mean) < left * old.Mean);
    CHECK(error.RootMeanSquare < left * old.RootMeanSquare);
  }
}

/// Alphas change steadily while pairs of nodes merge, although the shares of parents are others.
TEST_CASE("No jump between levels")
{
  const TestHierarchy foliage(MakeFoliage());
  SplatContext context;
  context.Camera = PinholeView(128, 128, 300.0);
  context.Optics = { 0.1, 1.5 };
  double before = 0.0, largest = 0.0, least = 1.0, most = 0.0;
  for (double error = 0.7; error < 1.4; error *= 1.004)
  {
    context.Cut.Error = error;
    const Picture picture = RenderPicture(context, { foliage.Get() });
    const double alpha = SumOfAlpha(picture) / (128.0 * 128.0);
    largest = before > 0.0 ? std::fmax(largest, std::abs(alpha - before)) : 0.0;
    before = alpha;
    least = std::fmin(least, alpha);
    most = std::fmax(most, alpha);
  }
  std::printf("mean alpha from %.4f to %.4f, in steps of %.5f at most\n", least, most, largest);
  CHECK(largest < 0.1 * (most - least));
}
}
