// SPDX-License-Identifier: BSD-3-Clause
/**
 * The hierarchy: every node's values against sums over its leaves, coverage from all sides at every
 * level, degenerate clouds, and the same at any number of threads.
 */
#include "Check.h"
#include "NodeMoments.h"
#include "TestScene.h"

#include <algorithm>
#include <cmath>
#include <limits>

using namespace SurfelSplatting;

namespace
{
void TestLayout()
{
  CHECK(HierarchyLayout(0, 0).NumberOfNodes() == 0 && HierarchyLayout(0, 0).NumberOfLevels() == 0);
  CHECK(HierarchyLayout(1, 0).NumberOfNodes() == 1 && HierarchyLayout(1, 0).NumberOfLevels() == 1);
  CHECK(HierarchyLayout(0, 3).NumberOfNodes() == 3 + 2 + 1);
  const HierarchyLayout layout(5, 2);
  CHECK(layout.NumberOfLevels() == 4 && layout.NumberOfLeaves() == 7);
  CHECK(layout.Count(1, 0) == 3 && layout.Count(1, 1) == 1 && layout.Begin(1, 1) == 10);
  CHECK(layout.RootLevel(0) == 3 && layout.RootLevel(1) == 1);
  CHECK(layout.Begin(3, 0) == 7 + 4 + 3);
  // All of them: 7 + 4 + 3 + 2 (a tree's only node is repeated up to the other's root).
  CHECK(layout.NumberOfNodes() == 16);
  for (std::uint64_t n : { 63u, 64u, 65u, 1000u, 4097u })
  {
    CHECK(HierarchyLayout(n, 0).NumberOfNodes() < 2 * n + 40);
    CHECK(HierarchyLayout(n, 0).Count(HierarchyLayout(n, 0).RootLevel(0), 0) == 1);
  }
}

/// A bumpy ball, one-sided, and a two-sided sheet whose normals point either way.
TestCloud BallAndSheet(int count, Random& random)
{
  TestCloud cloud;
  for (int i = 0; i < count; ++i)
  {
    TestSurfel s;
    s.Normal = random.Direction();
    const double r = 1.0 + 0.05 * std::sin(9.0 * s.Normal[0]) * std::sin(9.0 * s.Normal[1]);
    for (int c = 0; c < 3; ++c)
    {
      s.Position[c] = r * s.Normal[c];
    }
    s.Area = 12.57 / count * random.Uniform(0.5, 1.5);
    s.SigmaU = 0.5 * std::sqrt(s.Area);
    s.SigmaV = 0.4 * std::sqrt(s.Area);
    s.Color = { { static_cast<float>(random.Uniform(0, 1)),
      static_cast<float>(0.5 + 0.5 * s.Normal[1]), 0.3f, 1.0f } };
    s.Opacity = static_cast<float>(random.Uniform(0.3, 1.0));
    cloud.Add(s);
    s.TwoSided = true;
    s.Position = { random.Uniform(-2, 2), random.Uniform(-2, 2), 2.0 };
    s.Normal = { 0.0, 0.0, random.Integer(0, 1) ? 1.0 : -1.0 };
    cloud.Add(s);
  }
  return cloud;
}

struct LeafSums
{
  double Area = 0, Opacity = 0, Mass = 0;
  Vector3 AreaVector{ 0, 0, 0 }, Position{ 0, 0, 0 };
  double Color[3] = { 0, 0, 0 };
};

/// Sums over the leaves of node j of a level, in double.
LeafSums SumLeaves(const TestHierarchy& h, std::size_t first, std::size_t last, bool twoSided)
{
  LeafSums sums;
  for (std::size_t i = first; i < last; ++i)
  {
    const double a = h.Areas[i];
    const Vector3 vector{ h.AreaVectors[3 * i], h.AreaVectors[3 * i + 1],
      h.AreaVectors[3 * i + 2] };
    const double sign = twoSided && Dot(vector, sums.AreaVector) < 0.0 ? -1.0 : 1.0;
    const double mass = a * h.LeafColors[4 * i + 3] * h.Opacities[i];
    sums.Area += a;
    sums.Opacity += a * h.Opacities[i];
    sums.Mass += mass;
    for (int c = 0; c < 3; ++c)
    {
      sums.AreaVector[c] += sign * vector[c];
      sums.Position[c] += a * h.Positions[3 * i + c];
      sums.Color[c] += mass * h.LeafColors[4 * i + c];
    }
  }
  return sums;
}

void CheckNode(const TestHierarchy& h, int level, int tree, std::size_t j)
{
  const HierarchyLayout& layout = h.Order.Layout;
  const bool twoSided = tree == HierarchyLayout::TwoSided;
  const std::size_t node = layout.Begin(level, tree) + j;
  const std::size_t first = layout.Begin(0, tree) + (j << level);
  const std::size_t last =
    layout.Begin(0, tree) + std::min<std::size_t>((j + 1) << level, layout.NumberOfLeaves(tree));
  const LeafSums sums = SumLeaves(h, first, last, twoSided);
  // Floats at every level: one rounding each.
  const double tolerance = 1e-6 * (level + 1);
  CHECK_NEAR(h.Areas[node], sums.Area, tolerance * sums.Area);
  CHECK_NEAR(h.Opacities[node], sums.Opacity / sums.Area, tolerance);
  double cosine = 1.0, farthest = 0.0, sign = 0.0;
  Symmetric3 covariance{};
  Vector3 p;
  double gradient[3][3] = {};
  for (int c = 0; c < 3; ++c)
  {
    p[c] = h.Positions[3 * node + c];
    CHECK_NEAR(p[c], sums.Position[c] / sums.Area, tolerance * 3.0);
    sign += h.AreaVectors[3 * node + c] * sums.AreaVector[c];
  }
  sign = sign < 0.0 ? -1.0 : 1.0;
  for (int c = 0; c < 3; ++c)
  {
    CHECK_NEAR(h.AreaVectors[3 * node + c], sign * sums.AreaVector[c], tolerance * sums.Area);
  }
  const Vector3 axis{ h.AreaVectors[3 * node], h.AreaVectors[3 * node + 1],
    h.AreaVectors[3 * node + 2] };
  for (std::size_t i = first; i < last; ++i)
  {
    const Vector3 d{ h.Positions[3 * i] - p[0], h.Positions[3 * i + 1] - p[1],
      h.Positions[3 * i + 2] - p[2] };
    const Vector3 a{ h.AreaVectors[3 * i], h.AreaVectors[3 * i + 1], h.AreaVectors[3 * i + 2] };
    farthest = std::max(farthest, Norm(d));
    cosine = std::min(cosine, Dot(a, axis) / (Norm(a) * Norm(axis)));
    const double share = h.Areas[i] / sums.Area;
    const float* s = h.Covariances.data() + 6 * i;
    covariance = Mix(covariance, 1.0, { s[0], s[1], s[2], s[3], s[4], s[5] }, share);
    AddOuterProduct(covariance, d, share);
    const double mass = h.Areas[i] * h.LeafColors[4 * i + 3] * h.Opacities[i] / sums.Mass;
    for (int c = 0; c < 3; ++c)
    {
      for (int x = 0; x < 3; ++x)
      {
        gradient[c][x] +=
          mass * (h.LeafColors[4 * i + c] - sums.Color[c] / sums.Mass) * h.Positions[3 * i + x];
      }
    }
  }
  CHECK(farthest <= h.Bounds[node] + 1e-6);
  CHECK(twoSided ? h.Cones[node] == -1.0f : cosine >= h.Cones[node] - 1e-5);
  const float* s = h.Covariances.data() + 6 * node;
  const double trace = covariance.Trace();
  CHECK_NEAR(s[0], covariance.XX, 1e-5 * trace);
  CHECK_NEAR(s[4], covariance.YZ, 1e-5 * trace);
  if (level > 0)
  {
    const std::size_t inner = node - layout.NumberOfLeaves();
    CHECK_NEAR(h.Colors.Colors[4 * inner + 3], sums.Mass / sums.Area, tolerance);
    // Opacities vary within the node, and means of position are by area: the first moment is about
    // centres that differ by that much.
    for (int c = 0; c < 3; ++c)
    {
      CHECK_NEAR(h.Colors.Colors[4 * inner + c], sums.Color[c] / sums.Mass, 5.0 * tolerance);
      for (int x = 0; x < 3; ++x)
      {
        CHECK_NEAR(h.Colors.Gradients[9 * inner + 3 * c + x], gradient[c][x],
          0.08 * std::sqrt(trace) + 1e-6);
      }
    }
  }
}

void TestMoments()
{
  Random random(1);
  const TestHierarchy h(BallAndSheet(700, random));
  CHECK(h.Order.Layout.NumberOfLeaves(0) == 700 && h.Order.Layout.NumberOfLeaves(1) == 700);
  for (int level = 0; level < h.Order.Layout.NumberOfLevels(); ++level)
  {
    for (int tree = 0; tree < 2; ++tree)
    {
      for (std::size_t j = 0; j < h.Order.Layout.Count(level, tree); ++j)
      {
        CheckNode(h, level, tree, j);
      }
    }
  }
}

/// Front-facing area of the ball, sum max(0, -A.v), from many sides: that of the leaves at levels
/// that the rule of coherence lets be drawn.
void TestCoverage()
{
  Random random(2);
  const TestHierarchy h(BallAndSheet(4000, random));
  const HierarchyLayout& layout = h.Order.Layout;
  for (int repeat = 0; repeat < 50; ++repeat)
  {
    const Vector3 v = random.Direction();
    double leaves = 0.0;
    for (int level = 0; level <= 4; ++level)
    {
      double sum = 0.0;
      for (std::size_t j = 0; j < layout.Count(level, 0); ++j)
      {
        const float* a = h.AreaVectors.data() + 3 * (layout.Begin(level, 0) + j);
        sum += std::max(0.0, -(a[0] * v[0] + a[1] * v[1] + a[2] * v[2]));
      }
      leaves = level == 0 ? sum : leaves;
      CHECK_NEAR(sum / leaves, 1.0, 0.01 * level + 1e-12);
    }
  }
}

bool Same(const TestHierarchy& a, const TestHierarchy& b)
{
  return a.Order.Surfels == b.Order.Surfels && a.Positions == b.Positions &&
    a.Covariances == b.Covariances && a.AreaVectors == b.AreaVectors && a.Bounds == b.Bounds &&
    a.Cones == b.Cones && a.Colors.Colors == b.Colors.Colors &&
    a.Colors.Gradients == b.Colors.Gradients;
}

void TestThreads()
{
  Random random(3);
  const TestCloud cloud = BallAndSheet(30000, random);
  const TestHierarchy one(cloud);
  for (unsigned int threads : { 2u, 8u })
  {
    CHECK(Same(one, TestHierarchy(cloud, ThreadExecutor(threads))));
  }
}

bool IsFinite(const TestHierarchy& h)
{
  for (const auto* values : { &h.Positions, &h.Covariances, &h.AreaVectors, &h.LeafCovariances,
         &h.Opacities, &h.Areas, &h.Bounds, &h.Cones, &h.Colors.Colors, &h.Colors.Gradients })
  {
    if (!std::all_of(values->begin(), values->end(), [](float x) { return std::isfinite(x); }))
    {
      return false;
    }
  }
  return true;
}

/// From outside, inside and far away, through pinhole and lens, at any error: no NaN, nothing
/// negative.
void CheckPictures(const TestHierarchy& h)
{
  for (int i = 0; i < 24; ++i)
  {
    SplatContext context;
    context.Camera = PinholeView(32, 32, i % 2 ? 30.0 : 3000.0);
    const double distances[] = { 0.0, 0.9, 5.0, 1e9 };
    context.Camera.WorldToCamera.T[2] = distances[i % 4];
    context.Camera.Near = i % 3 ? 1e-6 : 0.0;
    context.Camera.Parallel = i % 8 == 7;
    const double radii[] = { 0.0, 0.1, 1e6 };
    context.Optics = { radii[i % 3], 2.0 };
    context.Detail.Rule = i % 5 == 4 ? DetailRule::Paper : DetailRule::Moments;
    const double errors[] = { 1.0, 0.0, 100.0 };
    context.Detail.Error = errors[i / 8];
    const Picture picture = RenderPicture(context, { h.Get() });
    CHECK(std::all_of(picture.Color.begin(), picture.Color.end(),
      [](float x) { return std::isfinite(x) && x >= 0.0f; }));
  }
}

/// No point, one point, all points in one place, on a line, at extremes, without area, and NaN.
void TestDegenerate()
{
  for (int kind = 0; kind < 7; ++kind)
  {
    TestCloud cloud;
    const int count = kind == 0 ? 0 : kind == 1 ? 1 : 300;
    Random random(4);
    for (int i = 0; i < count; ++i)
    {
      TestSurfel s;
      const double t = random.Uniform(-1, 1);
      s.Position = kind == 2 ? Vector3{ 1, 2, 3 }
        : kind == 3          ? Vector3{ t, 2 * t, 3 * t }
        : kind == 4          ? Vector3{ 1e12 * t, 1e-12 * t, 1e9 * t }
                             : Vector3{ t, random.Uniform(-1, 1), random.Uniform(-1, 1) };
      s.Area = kind == 5 ? 0.0 : kind == 4 ? 1e20 : 1e-3;
      s.Normal = random.Direction();
      s.Position[0] =
        kind == 6 && i % 3 == 0 ? std::numeric_limits<double>::quiet_NaN() : s.Position[0];
      cloud.Add(s);
    }
    const TestHierarchy h(cloud);
    CHECK(IsFinite(h));
    CHECK(h.Order.NumberOfInvalidSurfels == (kind == 6 ? 100u : 0u));
    CHECK(h.Order.Layout.NumberOfLeaves() ==
      static_cast<std::size_t>(count) - h.Order.NumberOfInvalidSurfels);
    std::vector<std::uint32_t> order = h.Order.Surfels;
    std::sort(order.begin(), order.end());
    CHECK(std::adjacent_find(order.begin(), order.end()) == order.end());
    CheckPictures(h);
  }
}

/// Two parallel sheets that face away from each other, closer than a node is wide: split by their
/// normals, small nodes stay on one side.
void TestFolds()
{
  TestCloud cloud;
  Random random(5);
  for (int i = 0; i < 4096; ++i)
  {
    TestSurfel s;
    s.Position = { random.Uniform(-1, 1), random.Uniform(-1, 1), i % 2 ? 0.01 : -0.01 };
    s.Normal = { 0.0, 0.0, i % 2 ? 1.0 : -1.0 };
    cloud.Add(s);
  }
  const TestHierarchy h(cloud);
  int mixed = 0;
  for (std::size_t j = 0; j < h.Order.Layout.Count(5, 0); ++j)
  {
    const std::size_t node = h.Order.Layout.Begin(5, 0) + j;
    const float* a = h.AreaVectors.data() + 3 * node;
    mixed += Coherence({ a[0], a[1], a[2] }, h.Areas[node]) < 0.5 ? 1 : 0;
  }
  CHECK(mixed < 20); // of 128; by position alone nearly all
}
}

int main()
{
  TestLayout();
  TestMoments();
  TestCoverage();
  TestThreads();
  TestDegenerate();
  TestFolds();
  return Checks().Report("hierarchy");
}
