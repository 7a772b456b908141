// SPDX-License-Identifier: BSD-3-Clause
/**
 * Wide splats on coarse grids: the same picture as at full resolution but for a known small error,
 * no seams, and time that does not follow the splats' area.
 */
#include "Core/Raster/CoarseGrid.h"
#include "TestScene.h"
#include "Testing/Shared/Check.h"
#include "WholeLens.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

using namespace SurfelSplatting;

namespace
{
Picture Render(SplatContext context, const TestCloud& cloud, bool coarse)
{
  context.CoarseGrids = coarse;
  return RenderPicture(context, cloud);
}

/// One splat for each cell that it is wide; levels 0 (the picture) and from LowestCoarseLevel on.
TEST_CASE("Levels")
{
  CHECK(CoarseCell(0.0) == 1);
  CHECK(CoarseCell(1.0) == 1);
  CHECK(CoarseCell(5.2) == 1); // 1.15 cells of 2 px are 2.3 px
  CHECK(CoarseCell(5.3) == 2);
  CHECK(CoarseCell(35.9) == 2);
  CHECK(CoarseCell(36.0) == 4);
  CHECK(CoarseCell(143.9) == 4);
  CHECK(CoarseCell(144.0) == 8);
  CHECK(CoarseCell(1e12) == 1 << HighestCoarseLevel);
  CHECK(CoarseSize(64, 4) == 17);
  CHECK(CoarseSize(65, 4) == 18);
  CHECK(CoarseSize(1, 64) == 2);
}

/// Mass, centre and variance of a lonely blurred splat are those at full resolution.
void TestLonelySplat(KernelType kernel)
{
  Random random(3);
  for (int i = 0; i < 20; ++i)
  {
    SplatContext context;
    context.Settings.Kernel = kernel;
    context.Camera = PinholeView(256, 256, 200.0);
    const double confusion = random.Uniform(20.0, 50.0); // px, at z = 2
    context.Optics = { 0.01 * confusion, 1.0 };
    TestSurfel s;
    s.Position = { random.Uniform(-0.1, 0.1), random.Uniform(-0.1, 0.1), 2.0 };
    s.Area = 1e-3;
    TestCloud cloud;
    cloud.Add(s);
    double moments[2][5] = {};
    for (int coarse = 0; coarse < 2; ++coarse)
    {
      const Picture picture = Render(context, cloud, coarse == 1);
      double* m = moments[coarse];
      for (int y = 0; y < 256; ++y)
      {
        for (int x = 0; x < 256; ++x)
        {
          const double a = picture.At(x, y, 3), dx = x - 128.0, dy = y - 128.0;
          m[0] += a;
          m[1] += a * dx;
          m[2] += a * dy;
          m[3] += a * (dx * dx + dy * dy);
        }
      }
      m[1] /= m[0];
      m[2] /= m[0];
      m[3] = m[3] / m[0] - m[1] * m[1] - m[2] * m[2];
    }
    // A kernel with an edge, sampled at cells of 1/6 to 1/3 of its radius: Gauss's circle problem.
    CHECK_NEAR(moments[1][0] / moments[0][0], 1.0, 0.06);
    const double largestShift = 0.04 * confusion; // of 2000 the largest: half a cell at most
    CHECK_NEAR(moments[1][1], moments[0][1], largestShift);
    CHECK_NEAR(moments[1][2], moments[0][2], largestShift);
    CHECK_NEAR(moments[1][3] / moments[0][3], 1.0, 0.06);
  }
}

/// A white plane that recedes from blur through focus into blur: coverage stays what it is,
/// whatever grid its parts are on.
void TestTiltedPlane(KernelType kernel)
{
  SplatContext context;
  context.Settings.Kernel = kernel;
  context.Camera = PinholeView(256, 192, 250.0);
  context.Optics = { 0.25, 3.0 };
  TestCloud cloud;
  Random random(5);
  for (int j = 0; j < 420; ++j)
  {
    for (int i = 0; i < 300; ++i)
    {
      // y = -0.4: the lower half of the picture from z = 1.1 on
      const double d = 0.02;
      TestSurfel s = SquareSurfel({ (i - 149.5) * d, -0.4, 0.6 + j * d }, d, 0.9); // not saturated
      s.Normal = { 0, 1, 0 };
      cloud.Add(s);
    }
  }
  const Picture fine = Render(context, cloud, false);
  const Picture coarse = Render(context, cloud, true);
  double lowest = 2.0, largest = 0.0, lowestFine = 2.0;
  for (int y = 8; y < 60; ++y)
  {
    for (int x = 8; x < 248; ++x)
    {
      lowest = std::min<double>(lowest, coarse.At(x, y, 3));
      lowestFine = std::min<double>(lowestFine, fine.At(x, y, 3));
      largest = std::max<double>(largest, std::abs(coarse.At(x, y, 3) - fine.At(x, y, 3)));
    }
  }
  std::printf("plane: coverage from %.4f, %.4f at full resolution, off by %.4f at most\n", lowest,
    lowestFine, largest);
  // Where grids of different cells meet, gaps between their z-ranges leak: 0.015 measured.
  CHECK(lowest > lowestFine - 0.02);
  // Cells sample the edges of discs, 1/3 to 2/3 of a cell wide here; fewest splats overlap where
  // the blur is smallest, on cells of 2 px.
  CHECK(largest < 0.03);
}

/// A blurred floor and the wall that it meets are one surface: no light from behind comes through
/// the corner.
TEST_CASE("Corner")
{
  for (const double height : { 0.4, 0.15 })
  {
    SplatContext context;
    context.Camera = PinholeView(192, 192, 250.0);
    context.Optics = { 0.5, 0.8 };
    TestCloud cloud;
    constexpr double d = 0.02;
    for (int j = 0; j < 150; ++j)
    {
      for (int i = -120; i < 120; ++i)
      {
        TestSurfel floor = SquareSurfel({ (i + 0.5) * d, -height, (j + 0.5) * d }, d, 0.9);
        floor.Normal = { 0, 1, 0 };
        cloud.Add(floor);
        cloud.Add(SquareSurfel({ (i + 0.5) * d, (j + 0.5) * d - height, 3.0 }, d, 0.9));
      }
    }
    const Picture fine = Render(context, cloud, false), coarse = Render(context, cloud, true);
    double lost = 0.0;
    for (int y = 40; y < 152; ++y)
    {
      for (int x = 40; x < 152; ++x)
      {
        lost = std::max<double>(lost, fine.At(x, y, 3) - coarse.At(x, y, 3));
      }
    }
    std::printf("corner: %.4f of coverage lost at most\n", lost);
    CHECK(lost < 0.04); // 0.023 and 0.033 measured, with each layer drawn as one as well
  }
}

/// A textured cloud with things at several depths: close to full resolution, and far fewer
/// fragments.
TEST_CASE("Textured scene")
{
  SplatContext context;
  context.Camera = PinholeView(256, 256, 250.0);
  context.Optics = { 0.35, 4.0 };
  TestCloud cloud;
  Random random(6);
  for (int i = 0; i < 60000; ++i)
  {
    TestSurfel s;
    const double depths[] = { 1.2, 4.0, 9.0 };
    const double z = depths[i % 3];
    const double reach = i % 3 == 0 ? 0.25 : 0.8;
    s.Position = { random.Uniform(-reach, reach) * z, random.Uniform(-reach, reach) * z, z };
    const double area = 4.0 * reach * reach * z * z / 20000.0;
    s.Area = area;
    s.SigmaU = s.SigmaV = 0.6 * std::sqrt(area);
    const float light = static_cast<float>(0.5 + 0.4 * std::sin(9.0 * s.Position[0]));
    s.Color = { { light, i % 3 == 0 ? 0.9f : 0.2f, 0.5f, 1.0f } };
    cloud.Add(s);
  }
  context.CoarseGrids = false;
  Splatter splatter;
  Picture fine(256, 256), coarse(256, 256);
  splatter.Render(context, { cloud.Get() }, SerialExecutor(), fine.Get());
  const std::uint64_t fragments = splatter.Statistics().Fragments;
  context.CoarseGrids = true;
  splatter.Render(context, { cloud.Get() }, SerialExecutor(), coarse.Get());
  const double psnr = -10.0 * std::log10(MeanSquareDifference(fine, coarse));
  std::printf("scene: %.1f dB, off by %.3f at most, %.1f times fewer fragments\n", psnr,
    LargestDifference(fine, coarse),
    static_cast<double>(fragments) / static_cast<double>(splatter.Statistics().Fragments));
  CHECK(psnr > 44.0); // 44.5 measured; either is at 37.6 to 37.8 dB from the mean of 400 pinholes
  CHECK(splatter.Statistics().CoarseCells > 0);
  CHECK(4 * splatter.Statistics().Fragments < fragments);
}

/// A splat on a coarse grid, so wide that all cells have its full weight.
void AddWide(SplatList& list, float weight, float opacity, const float (&color)[3], float near,
  const LensFootprint& footprint)
{
  Splat s{};
  s.A = s.B = 1e-30f;
  s.Shape = GaussianShape;
  s.Weight = weight;
  s.Opacity = opacity;
  s.Red = color[0];
  s.Green = color[1];
  s.Blue = color[2];
  s.Near = near;
  s.Far = near + 1.0f;
  s.Gradient = NoGradient;
  list.Add(s, { 0, 0, 17, 17 });
  const std::size_t i = list.Splats.Size() - 1;
  list.Levels[i] = 1;
  list.Parts.back().Levels = 1u << 1;
  list.Footprints[i] = footprint;
}

/// Turns the layers of the splats into tents of 32 x 32 px.
/// @param work keeps them
void ResolveTents(SplatList& list, CoarseWork& work)
{
  Pool<TileRaster> rasters;
  RasterSettings settings{ 5.0f, 1.0f };
  settings.LensRadius = 0.1f;
  ResolveCoarseLevels(list, { { 32, 32 } }, settings, SerialExecutor(), rasters, work);
}

/// Means and covariances of a cell's splats, weighted with coverage and opacity; the z-range of
/// most of them.
TEST_CASE("Tents")
{
  SplatList list;
  list.Clear(true);
  const float weights[] = { 0.3f, 0.1f }, opacities = 0.75f, nears[] = { 2.0f, 2.5f };
  const float colors[2][3] = { { 0.9f, 0.1f, 0.5f }, { 0.2f, 0.6f, 0.5f } };
  const LensFootprint points[] = { WholeLens(0.2f, -0.1f, 0.0f), WholeLens(-0.3f, 0.4f, 0.0f) };
  for (int i = 0; i < 2; ++i)
  {
    AddWide(list, weights[i], opacities, colors[i], nears[i], points[i]);
  }
  AddWide(list, 0.2f, 1.0f, colors[0], 9.0f, points[0]); // a layer of its own
  CoarseWork work;
  ResolveTents(list, work);
  CHECK(list.Tents.Size() == 2 * 17 * 17);
  const double share[] = { 0.75, 0.25 };
  const auto mean = [&](double a, double b) { return share[0] * a + share[1] * b; };
  const auto covariance = [&](const double(&a)[2], const double(&b)[2]) {
    return mean(a[0] * b[0], a[1] * b[1]) - mean(a[0], a[1]) * mean(b[0], b[1]);
  };
  const double x[] = { points[0].MeanX, points[1].MeanX },
               y[] = { points[0].MeanY, points[1].MeanY };
  const double red[] = { colors[0][0], colors[1][0] }, green[] = { colors[0][1], colors[1][1] };
  int first = 0;
  for (std::size_t i = 0; i < list.Tents.Size(); ++i)
  {
    const Tent& t = *list.Tents[i];
    if (t.Depth > 5.0f)
    {
      CHECK_NEAR(t.XX, 0.0, 1e-6); // one splat
      CHECK_NEAR(t.RedX, 0.0, 1e-6);
      CHECK_NEAR(t.Near, 9.0, 2e-3); // a difference of squares of 0.5
      CHECK_NEAR(t.Far, 10.0, 2e-3);
      continue;
    }
    ++first;
    CHECK_NEAR(t.Weight, 0.4, 1e-6);
    CHECK_NEAR(t.Opacity, 0.75, 1e-6);
    CHECK_NEAR(t.Red, mean(red[0], red[1]), 1e-6);
    CHECK_NEAR(t.Green, mean(green[0], green[1]), 1e-6);
    CHECK_NEAR(t.PointX, mean(x[0], x[1]), 1e-6);
    CHECK_NEAR(t.PointY, mean(y[0], y[1]), 1e-6);
    CHECK_NEAR(t.RedX, covariance(red, x), 1e-6);
    CHECK_NEAR(t.RedY, covariance(red, y), 1e-6);
    CHECK_NEAR(t.GreenX, covariance(green, x), 1e-6);
    CHECK_NEAR(t.GreenY, covariance(green, y), 1e-6);
    CHECK_NEAR(t.BlueX, 0.0, 1e-6);
    CHECK_NEAR(t.XX, covariance(x, x), 1e-6);
    CHECK_NEAR(t.XY, covariance(x, y), 1e-6);
    CHECK_NEAR(t.YY, covariance(y, y), 1e-6);
    // Depths 2.5 and 3: 1.4 deviations of 0.5 sqrt(3) / 4; half ranges of 0.5.
    CHECK_NEAR(t.Depth, 2.625, 1e-5);
    CHECK_NEAR(t.Near, 2.625 - 0.5 - 1.4 * 0.125 * std::sqrt(3.0), 1e-4);
    CHECK_NEAR(t.Far, 2.625 + 0.5 + 1.4 * 0.125 * std::sqrt(3.0), 1e-4);
  }
  CHECK(first == 17 * 17);
}

/// Two surfaces that light splats bridge are two tents, with the opacities, colours and lens points
/// of each.
TEST_CASE("Tents of two surfaces")
{
  SplatList list;
  list.Clear(true);
  const float weights[] = { 0.4f, 0.35f }, opacities[] = { 0.9f, 0.4f }, nears[] = { 2.0f, 4.6f };
  const float colors[2][3] = { { 0.9f, 0.1f, 0.5f }, { 0.2f, 0.6f, 0.3f } };
  const LensFootprint points[] = { WholeLens(0.4f, -0.2f, 0.0f), WholeLens(-0.3f, 0.35f, 0.0f) };
  AddWide(list, weights[0], opacities[0], colors[0], nears[0], points[0]);
  for (const float bridge : { 2.9f, 3.8f })
  {
    AddWide(list, 0.004f, opacities[0], colors[0], bridge, points[0]);
  }
  AddWide(list, weights[1], opacities[1], colors[1], nears[1], points[1]);
  CoarseWork work;
  ResolveTents(list, work);
  CHECK(list.Tents.Size() == 2 * 17 * 17);
  for (std::size_t i = 0; i < list.Tents.Size(); ++i)
  {
    const Tent& t = *list.Tents[i];
    const int k = t.Depth < 4.0f ? 0 : 1;
    CHECK_NEAR(t.Weight, weights[k], 0.02);
    CHECK_NEAR(t.Depth, nears[k] + 0.5f, 0.06);
    CHECK_NEAR(t.Opacity, opacities[k], 0.03);
    CHECK_NEAR(t.Red, colors[k][0], 0.03);
    CHECK_NEAR(t.Green, colors[k][1], 0.03);
    CHECK_NEAR(t.Blue, colors[k][2], 0.03);
    CHECK_NEAR(t.PointX, points[k].MeanX, 0.03);
    CHECK_NEAR(t.PointY, points[k].MeanY, 0.03);
    for (const float covariance : { t.RedX, t.RedY, t.GreenX, t.BlueY, t.XX, t.XY, t.YY })
    {
      CHECK_NEAR(covariance, 0.0, 0.01); // one splat
    }
    CHECK((k == 0 ? t.Far - 4.0f : 4.0f - t.Near) < 0.0f);
  }
}

/// A pinhole has no wide splats here and is left alone, bit for bit.
TEST_CASE("Pinhole")
{
  SplatContext context;
  context.Camera = PinholeView(64, 64, 60.0);
  TestCloud cloud;
  Random random(7);
  for (int i = 0; i < 500; ++i)
  {
    TestSurfel s;
    s.Position = { random.Uniform(-1.0, 1.0), random.Uniform(-1.0, 1.0), 2.0 };
    s.SigmaU = s.SigmaV = 0.03;
    s.Area = 0.01;
    cloud.Add(s);
  }
  CHECK(LargestDifference(Render(context, cloud, false), Render(context, cloud, true)) == 0.0);
}
}

TEST_CASE("Lonely splat and tilted plane")
{
  for (KernelType kernel : { KernelType::Gaussian, KernelType::PearsonII })
  {
    TestLonelySplat(kernel);
    TestTiltedPlane(kernel);
  }
}
