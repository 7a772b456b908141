// SPDX-License-Identifier: BSD-3-Clause
/**
 * Formulas of the set-up that the brute-force splatter does not have, against plain ones: the
 * paper's circumellipse, points of the lens, colour gradients of nodes, normals as colours.
 */
#include "Core/Splats/SetupFootprint.h"
#include "Core/Splats/SplatMaker.h"
#include "Core/Surfels/NodePacking.h"
#include "TestScene.h"
#include "Testing/Shared/Check.h"

#include <algorithm>
#include <cmath>

using namespace SurfelSplatting;

namespace
{
/// The splat of one surfel or node.
struct OneSplat
{
  Splat S;
  PixelBox Box;
  float Near;
  LensFootprint Footprint{};
  unsigned char GridLevel;
  SplatGradient Gradient;
  bool IsVisible;

  OneSplat(const SplatContext& context, const SurfelCloud& cloud, std::size_t index, int level)
    : OneSplat(context, cloud, { index, 1, static_cast<std::uint32_t>(level) })
  {
  }

  OneSplat(const SplatContext& context, const SurfelCloud& cloud, const CutRange& run)
  {
    SplatOutput output{ &this->S, &this->Box, &this->Near,
      context.HasLens() ? &this->Footprint : nullptr, &this->GridLevel, &this->Gradient, 0 };
    SplatMaker maker;
    maker.Set(context, cloud);
    maker.Make(run, output);
    this->IsVisible = output.Count == 1;
  }
};

struct Matrix2
{
  double XX, YY, XY;
};

double Form(const Matrix2& m, const double (&x)[2], const double (&y)[2])
{
  return m.XX * x[0] * y[0] + m.YY * x[1] * y[1] + m.XY * (x[0] * y[1] + x[1] * y[0]);
}

/// M S M' + variance, px^2, for a pinhole camera with fx = fy = f.
Matrix2 FootprintOnScreen(const Symmetric3& s, const Vector3& p, double f, double variance)
{
  const double z = p[2],
               m[2][3] = { { f / z, 0, -f * p[0] / (z * z) }, { 0, f / z, -f * p[1] / (z * z) } };
  const double full[3][3] = { { s.XX, s.XY, s.XZ }, { s.XY, s.YY, s.YZ }, { s.XZ, s.YZ, s.ZZ } };
  double w[2][2] = { { variance, 0 }, { 0, variance } };
  for (int a = 0; a < 2; ++a)
  {
    for (int b = 0; b < 2; ++b)
    {
      for (int i = 0; i < 3; ++i)
      {
        for (int j = 0; j < 3; ++j)
        {
          w[a][b] += m[a][i] * full[i][j] * m[b][j];
        }
      }
    }
  }
  return { w[0][0], w[1][1], w[0][1] };
}

SplatContext Context()
{
  SplatContext context;
  context.Camera = PinholeView(400, 300, 300.0);
  context.Optics = { 0.1, 2.0 };
  context.CoarseGrids = false;
  return context;
}

/// In the axes x of A x = l B x, the larger of both forms; no mixed term. This defines it.
TEST_CASE("Circumellipse")
{
  Random random(4);
  for (int i = 0; i < 200; ++i)
  {
    const double u = random.Uniform(0.01, 9), v = random.Uniform(0.01, 9);
    const Matrix2 a{ u, v, random.Uniform(-0.99, 0.99) * std::sqrt(u * v) };
    const double s = random.Uniform(0.05, 5), t = random.Uniform(0.05, 5);
    const Matrix2 b{ s, t, i % 2 == 0 ? 0.0 : random.Uniform(-0.9, 0.9) * std::sqrt(s * t) };
    const Symmetric2 e =
      Circumellipse<double>({ a.XX, a.YY, a.XY }, Symmetric2{ b.XX, b.YY, b.XY });
    // det(A - l B) = 0
    const double determinant = b.XX * b.YY - b.XY * b.XY;
    const double half = 0.5 * (a.XX * b.YY + a.YY * b.XX - 2.0 * a.XY * b.XY) / determinant;
    const double root = std::sqrt(half * half - (a.XX * a.YY - a.XY * a.XY) / determinant);
    double axes[2][2];
    for (int k = 0; k < 2; ++k)
    {
      const double l = half + (k == 0 ? root : -root);
      axes[k][0] = a.XY - l * b.XY;
      axes[k][1] = l * b.XX - a.XX;
      const double forms[2] = { Form(a, axes[k], axes[k]), Form(b, axes[k], axes[k]) };
      const double largest = std::fmax(forms[0], forms[1]);
      CHECK_NEAR(Form({ e.XX, e.YY, e.XY }, axes[k], axes[k]) / largest, 1.0, 1e-9);
    }
    const double scale =
      std::hypot(axes[0][0], axes[0][1]) * std::hypot(axes[1][0], axes[1][1]) * (e.XX + e.YY);
    CHECK_NEAR(Form({ e.XX, e.YY, e.XY }, axes[0], axes[1]) / scale, 0.0, 1e-9);
  }
}

/// Surfels go to the lowest grid over GridStagger of the blur's deviation: hardly any below, all
/// above, in between as many as the deviation says, four leaves and their nodes together.
TEST_CASE("One after another to grids")
{
  Random random(6);
  TestCloud points;
  for (int i = 0; i < 512; ++i)
  {
    TestSurfel s;
    s.Position = { random.Uniform(-0.3, 0.3), random.Uniform(-0.3, 0.3), 4.0 };
    s.Area = 1e-4;
    points.Add(s);
  }
  const TestHierarchy hierarchy(points);
  const SurfelCloud cloud = hierarchy.Get();
  const HierarchyLayout& layout = cloud.Clusters->Layout();
  SplatContext context = Context();
  context.CoarseGrids = true;
  const double least = LowestCellsPerDeviation * (1 << LowestCoarseLevel);
  for (const double share : { -0.02, 0.1, 0.25, 0.5, 0.75, 0.9, 1.02 })
  {
    const double deviation = least * (1.0 + GridStagger * share);
    const double confusion = 2.0 * std::sqrt(deviation * deviation - context.Settings.Prefilter);
    context.Optics.Radius *= confusion / (300.0 * context.Optics.RelativeCircleOfConfusion(4.0));
    int groups[3] = {};
    for (int level = 0; level < 3; ++level)
    {
      for (std::size_t j = 0; j < layout.Count(level, 0); ++j)
      {
        const std::size_t four = j >> (2 - level) << (2 - level);
        const auto levelOf = [&](std::size_t node) {
          CutRange run{ layout.Begin(level, 0) + node, 1, static_cast<std::uint32_t>(level) };
          run.FirstLeaf = node << level;
          return OneSplat(context, cloud, run).GridLevel;
        };
        CHECK(levelOf(j) == levelOf(four));
        groups[level] += levelOf(j) > 0;
      }
    }
    CHECK_NEAR(groups[2] / 128.0, std::min(std::max(share, 0.0), 1.0), 0.02);
    CHECK(groups[0] == 4 * groups[2]);
    CHECK(groups[1] == 2 * groups[2]);
  }
}

using Vector2 = std::array<double, 2>;

Vector2 Multiply(const LensShape& s, const Vector2& x)
{
  return { s.XX * x[0] + s.XY * x[1], s.XY * x[0] + s.YY * x[1] };
}

/// LensVisibility.h: M = C/4 S^(1/2) W^-1, and the share of the weight at offset d, the area that
/// is seen from there. Of an ellipse the points are those of the disc that its root maps to it.
TEST_CASE("Points of the lens")
{
  SplatContext context = Context();
  Random random(5);
  int seen = 0;
  for (int i = 0; i < 200; ++i)
  {
    context.Optics.Shape = i % 2 == 0 ? LensShape() : LensShape{ 2.0, 0.625, 0.5 };
    TestCloud cloud;
    TestSurfel surfel;
    surfel.Position = { random.Uniform(-0.3, 0.3), random.Uniform(-0.3, 0.3),
      random.Uniform(1.0, 5.0) };
    surfel.Normal = random.Direction();
    surfel.TwoSided = random.Integer(0, 1) == 0;
    surfel.SigmaU = 0.02;
    surfel.SigmaV = 0.01;
    cloud.Add(surfel);
    const OneSplat splat(context, cloud.Get(), 0, 0);
    const Vector3 p = cloud.Get().Position(0), a = cloud.Get().AreaVector(0);
    const double radius = context.Optics.Radius;
    const double side = surfel.TwoSided && Dot(a, p) > 0.0 ? -1.0 : 1.0;
    const auto areaFrom = [&](double ux, double uy) {
      return -side * Dot(a, { p[0] - radius * ux, p[1] - radius * uy, p[2] });
    };
    const LensShape root = context.Optics.Shape.Root();
    Vector2 v = Multiply( // by the point of the disc
      root, { areaFrom(1, 0) - areaFrom(0, 0), areaFrom(0, 1) - areaFrom(0, 0) });
    const double largest = areaFrom(0, 0) + std::hypot(v[0], v[1]);
    v = { v[0] / largest, v[1] / largest };
    if (!splat.IsVisible)
    {
      CHECK(largest < 1e-3 * std::abs(Dot(a, p))); // or outside of the picture
      continue;
    }
    ++seen;
    CHECK(largest > 0.0);
    const double confusion = 300.0 * radius * (1.0 / context.Optics.FocalDistance - 1.0 / p[2]);
    Matrix2 w = FootprintOnScreen(cloud.Get().Covariance(0), p, 300.0, 1.0);
    const LensShape& shape = context.Optics.Shape;
    w.XX += 0.25 * confusion * confusion * shape.XX;
    w.YY += 0.25 * confusion * confusion * shape.YY;
    w.XY += 0.25 * confusion * confusion * shape.XY;
    const double det = w.XX * w.YY - w.XY * w.XY;
    const auto perPixel = [&](const Vector2& v) { // M'v = C/4 W^-1 S^(1/2) v
      const Vector2 x = Multiply(root, v);
      return Vector2{ 0.25 * confusion / det * (w.YY * x[0] - w.XY * x[1]),
        0.25 * confusion / det * (w.XX * x[1] - w.XY * x[0]) };
    };
    const auto share = [&](const Vector2& v) { // L v = C S^(1/2) M'v
      const Vector2 x = Multiply(root, perPixel(v));
      return Vector2{ confusion * x[0], confusion * x[1] };
    };
    const LensFootprint& f = splat.Footprint;
    CHECK_NEAR(f.PerForm * splat.S.A * det / w.YY, 0.25 * confusion, 1e-5 * std::abs(confusion));
    CHECK(f.Back == (surfel.TwoSided ? 1.0f : 0.0f));
    const double trace = shape.XX * w.YY - 2.0 * shape.XY * w.XY + shape.YY * w.XX; // of S W^-1 det
    CHECK_NEAR(f.Share, 0.125 * confusion * confusion * trace / det, 1e-5);
    const MeanVisibleArea<double> mean =
      MeanOverLens<double>({ areaFrom(0, 0) / largest, v[0], v[1], surfel.TwoSided });
    const double squared = v[0] * v[0] + v[1] * v[1];
    const Vector2 known = share(v), m = share({ mean.X, mean.Y }), slope = perPixel(v);
    const double l = (known[0] * v[0] + known[1] * v[1]) / squared;
    const double line = 4.0 * mean.Area * (mean.X * v[0] + mean.Y * v[1]) / squared;
    CHECK_NEAR(f.Area, l * l * areaFrom(0, 0) / largest + (1.0 - l * l) * mean.Area, 1e-6);
    CHECK_NEAR(f.AreaX, (l * l + (1.0 - l * l) * line) * slope[0], 1e-6);
    CHECK_NEAR(f.AreaY, (l * l + (1.0 - l * l) * line) * slope[1], 1e-6);
    CHECK_NEAR(f.MeanX, mean.X - m[0], 1e-6);
    CHECK_NEAR(f.MeanY, mean.Y - m[1], 1e-6);
  }
  CHECK(seen > 100);
}

/// What other sheets cover as well is left out where the lens blurs them together, by the same
/// share of a node as of its leaves; in focus nothing is.
TEST_CASE("Overlap")
{
  const double depths[] = { 2.0, 2.1, 2.5, 6.0 };
  for (const double z : depths)
  {
    TestCloud cloud;
    for (int i = 0; i < 4; ++i)
    {
      TestSurfel surfel = SquareSurfel({ 0.01 * (i % 2), 0.01 * (i / 2), z }, 0.01);
      surfel.Overlap = 102;
      cloud.Add(surfel);
    }
    TestHierarchy hierarchy(cloud);
    const SplatContext context = Context(); // in focus at 2
    SurfelCloud alone = hierarchy.Get();
    alone.Overlaps = nullptr;
    const double blur = std::pow(0.5 * 300.0 * 0.1 * (1.0 / 2.0 - 1.0 / z), 2);
    const double own = (1.0 / 12.0 + 0.28 * 0.28) * std::pow(0.01 * 300.0 / z, 2);
    const double share = blur / (blur + own + context.Settings.Prefilter);
    const OneSplat leaf(context, hierarchy.Get(), 0, 0), whole(context, alone, 0, 0);
    CHECK_NEAR(leaf.S.Weight / whole.S.Weight, 1.0 - 0.4 * share * share, 1e-6);
    if (z == 2.0)
    {
      CHECK(leaf.S.Weight == whole.S.Weight);
    }
    const OneSplat node(context, hierarchy.Get(), 6, 2);
    for (HierarchyNode& n : hierarchy.Nodes)
    {
      n.Sides &= 1;
    }
    const OneSplat wholeNode(context, alone, 6, 2);
    CHECK_NEAR(node.S.Weight / wholeNode.S.Weight, 1.0 - 0.4 * share * share, 1e-4);
  }
}

/// W^-1 M H' for the node's covariance and the colour's first moment H.
TEST_CASE("Gradients of nodes")
{
  SplatContext context = Context();
  context.Settings.Kernel = KernelType::Gaussian; // its Tilt is 1
  context.Optics.Radius = 0.0;
  Random random(6);
  for (int i = 0; i < 50; ++i)
  {
    TestCloud cloud;
    for (int k = 0; k < 2; ++k)
    {
      TestSurfel surfel;
      surfel.Position = { 0.2 + 0.1 * k, -0.1 + random.Uniform(-0.1, 0.1), 2.0 + 0.05 * k };
      surfel.SigmaU = surfel.SigmaV = 0.05;
      surfel.Area = 0.01;
      for (int c = 0; c < 3; ++c)
      {
        surfel.Color[static_cast<std::size_t>(c)] = static_cast<float>(random.Uniform(0, 1));
      }
      cloud.Add(surfel);
    }
    const TestHierarchy hierarchy(cloud);
    const SurfelCloud nodes = hierarchy.Get();
    const OneSplat splat(context, nodes, 2, 1);
    REQUIRE(splat.IsVisible);
    REQUIRE(splat.S.Gradient == 0);
    const Vector3 p = nodes.Position(2);
    const double blur = MinNodeBlur * 300.0 / p[2];
    const double variance = std::fmax(1.0, blur * blur * Norm(nodes.AreaVector(2)));
    const Matrix2 w = FootprintOnScreen(nodes.Covariance(2), p, 300.0, variance);
    const double determinant = w.XX * w.YY - w.XY * w.XY;
    const ColorMoments moments = UnpackColor(nodes.NodeColors[0]);
    const float actual[3][2] = { { splat.Gradient.RedX, splat.Gradient.RedY },
      { splat.Gradient.GreenX, splat.Gradient.GreenY },
      { splat.Gradient.BlueX, splat.Gradient.BlueY } };
    for (int c = 0; c < 3; ++c)
    {
      const double* h = moments.First[c];
      const double x = 300.0 / p[2] * (h[0] - p[0] / p[2] * h[2]);
      const double y = 300.0 / p[2] * (h[1] - p[1] / p[2] * h[2]);
      CHECK_NEAR(actual[c][0], (w.YY * x - w.XY * y) / determinant, 1e-6);
      CHECK_NEAR(actual[c][1], (w.XX * y - w.XY * x) / determinant, 1e-6);
    }
  }
}

/// (n + 1) / 2 of the side that is seen, in the world, however the camera is turned.
TEST_CASE("Normals as colours")
{
  SplatContext context = Context();
  context.Colors = Paint::Normals;
  context.Camera.WorldToCamera.L = { { { 0, 0, -1 }, { 0, 1, 0 }, { 1, 0, 0 } } }; // looks along x
  Random random(7);
  for (int i = 0; i < 100; ++i)
  {
    TestCloud cloud;
    TestSurfel surfel;
    surfel.Position = { 2, 0, 0 };
    surfel.Normal = random.Direction();
    surfel.TwoSided = true;
    cloud.Add(surfel);
    const OneSplat splat(context, cloud.Get(), 0, 0);
    if (std::abs(surfel.Normal[0]) < 0.05)
    {
      continue; // edge-on
    }
    REQUIRE(splat.IsVisible);
    const double side = surfel.Normal[0] > 0.0 ? -1.0 : 1.0;
    CHECK_NEAR(splat.S.Red, 0.5 + 0.5 * side * surfel.Normal[0], 1e-6);
    CHECK_NEAR(splat.S.Green, 0.5 + 0.5 * side * surfel.Normal[1], 1e-6);
    CHECK_NEAR(splat.S.Blue, 0.5 + 0.5 * side * surfel.Normal[2], 1e-6);
  }
}
}
