// SPDX-License-Identifier: BSD-3-Clause
/**
 * The lens against integrals over its points: cells and sample points, where blur is centred,
 * edges, and planes that recede.
 */
#include "Core/Lens/ResamplingKernel.h"
#include "Core/Lens/SubApertures.h"
#include "TestScene.h"
#include "Testing/Shared/Check.h"

#include <algorithm>
#include <cstdio>

using namespace SurfelSplatting;

namespace
{
struct Moments
{
  double X = 0, Y = 0, Squares = 0;
};

Moments MomentsOf(const std::vector<ApertureSample>& points)
{
  Moments m;
  for (const ApertureSample& p : points)
  {
    m.X += p.X / static_cast<double>(points.size());
    m.Y += p.Y / static_cast<double>(points.size());
    m.Squares += (p.X * p.X + p.Y * p.Y) / static_cast<double>(points.size());
  }
  return m;
}

/// Mean and mean squared distance are the disc's, 0 and 1/2, whatever the number.
TEST_CASE("Moments")
{
  for (int count = 1; count <= 200; ++count)
  {
    const std::vector<ApertureSample> points = ApertureSamples(count);
    CHECK(points.size() == static_cast<std::size_t>(count));
    const Moments p = MomentsOf(points);
    const double rounding = 1e-14;
    CHECK_NEAR(p.X, 0.0, rounding);
    CHECK_NEAR(p.Y, 0.0, rounding);
    CHECK_NEAR(p.Squares, count > 1 ? 0.5 : 0.0, rounding);
    if (count >= 6)
    {
      CHECK(std::hypot(points[0].X, points[0].Y) < 0.15); // innermost first
    }
  }
  // Evenly over the disc: a quarter of many points lies in the inner half of the radius.
  int inner = 0;
  for (const ApertureSample& p : ApertureSamples(1000))
  {
    inner += std::hypot(p.X, p.Y) < 0.5 ? 1 : 0;
    CHECK(std::hypot(p.X, p.Y) < 1.0);
  }
  CHECK_NEAR(inner, 250, 30); // one ring more or less
}

/// All cells together have the lens's area, mean and covariance.
TEST_CASE("Cells")
{
  for (int count = 1; count <= 200; ++count)
  {
    const std::vector<ApertureCell> cells = ApertureCells(count);
    CHECK(cells.size() == static_cast<std::size_t>(count));
    double area = 0, x = 0, y = 0, xx = 0, yy = 0, xy = 0, largest = 0;
    for (const ApertureCell& cell : cells)
    {
      const ApertureSample& c = cell.Center;
      const LensShape& s = cell.Shape;
      const double own = 0.25 * cell.Radius * cell.Radius;
      CHECK_NEAR(s.XX * s.YY - s.XY * s.XY, 1.0, 1e-12);
      area += 4.0 * own;
      x += c.X / count;
      y += c.Y / count;
      xx += (c.X * c.X + own * s.XX) / count;
      yy += (c.Y * c.Y + own * s.YY) / count;
      xy += (c.X * c.Y + own * s.XY) / count;
      largest = std::max(largest, std::hypot(c.X, c.Y) + cell.Radius * std::sqrt(s.Largest()));
      CHECK(std::hypot(c.X, c.Y) > std::hypot(cells[0].Center.X, cells[0].Center.Y) - 1e-9);
    }
    const double rounding = 1e-13;
    CHECK_NEAR(x, 0.0, rounding);
    CHECK_NEAR(y, 0.0, rounding);
    CHECK_NEAR(xx, 0.25, rounding);
    CHECK_NEAR(yy, 0.25, rounding);
    CHECK_NEAR(xy, 0.0, rounding);
    CHECK_NEAR(area, 1.0, 0.08); // ellipses stand for sectors
    CHECK(largest < 1.43);
  }
  CHECK(ApertureCells(1)[0].Radius == 1.0);
  CHECK(ApertureCells(7)[0].Shape.Largest() == 1.0); // a disc in the middle
  CHECK_NEAR(ApertureCells(7)[0].Radius, 1.0 / std::sqrt(7.0), 1e-15);
}

/// The part of a disc around 0, as a share, that lies below x.
double PartOfDisc(double x)
{
  const double t = std::fmin(std::fmax(x, -1.0), 1.0);
  return 0.5 + (t * std::sqrt(1.0 - t * t) + std::asin(t)) / Pi;
}

/// Together, the cells blur an edge as the whole lens does.
TEST_CASE("Profile of an edge")
{
  for (int count = 1; count <= 64; ++count)
  {
    const std::vector<ApertureCell> cells = ApertureCells(count);
    double squares = 0.0;
    constexpr int directions = 60, places = 100;
    for (int d = 0; d < directions; ++d)
    {
      const double cosine = std::cos(Pi * d / directions), sine = std::sin(Pi * d / directions);
      for (int i = 0; i <= places; ++i)
      {
        const double x = 1.3 * (2.0 * i / places - 1.0);
        double part = 0.0;
        for (const ApertureCell& c : cells)
        {
          const LensShape& s = c.Shape;
          const double along =
            cosine * cosine * s.XX + 2.0 * cosine * sine * s.XY + sine * sine * s.YY;
          part += PartOfDisc(
                    (x - cosine * c.Center.X - sine * c.Center.Y) / (c.Radius * std::sqrt(along))) /
            count;
        }
        squares += std::pow(part - PartOfDisc(x), 2) / (directions * places) * 1.3;
      }
    }
    CHECK(std::sqrt(squares) <= (count == 1 ? 1e-12 : 0.046 / count));
  }
}

/// The plane in focus stays where it is, and all else moves by C times the place on the lens.
TEST_CASE("Cell views")
{
  View view = PinholeView(80, 60, 70.0);
  view.Fy = 65.0;
  const Lens lens{ 0.2, 3.0 };
  for (bool pinholes : { false, true })
  {
    std::vector<ApertureSample> places = ApertureSamples(13);
    const std::vector<ApertureCell> parts = ApertureCells(13);
    for (std::size_t i = 0; i < parts.size() && !pinholes; ++i)
    {
      places[i] = parts[i].Center;
    }
    const std::vector<SubAperture> cells = DivideLens(view, lens, { 13, pinholes });
    CHECK(cells.size() == 13);
    for (std::size_t i = 0; i < cells.size(); ++i)
    {
      CHECK_NEAR(cells[i].Optics.Radius, pinholes ? 0.0 : 0.2 * parts[i].Radius, 1e-15);
      CHECK(cells[i].Optics.Shape.XY == (pinholes ? 0.0 : parts[i].Shape.XY));
      for (double z : { 1.0, 3.0, 8.0 })
      {
        const Vector3 p{ 0.3 * z, -0.2 * z, z };
        const Vector3 q = cells[i].Camera.WorldToCamera.Apply(p);
        const double confusion = lens.Radius * (1.0 / lens.FocalDistance - 1.0 / z); // signed
        const View& v = cells[i].Camera;
        CHECK_NEAR(v.Fx * q[0] / q[2] + v.Cx - (view.Fx * 0.3 + view.Cx),
          view.Fx * confusion * places[i].X, 1e-12);
        CHECK_NEAR(v.Fy * q[1] / q[2] + v.Cy - (-view.Fy * 0.2 + view.Cy),
          view.Fy * confusion * places[i].Y, 1e-12);
      }
    }
  }
  CHECK(DivideLens(view, Lens(), { 7, false }).size() == 1); // a pinhole
  CHECK(DivideLens(view, lens, ApertureSampling()).size() == 1);
  CHECK(DivideLens(view, lens, ApertureSampling())[0].Optics.Radius == 0.2);
  CHECK(DivideLens(view, lens, { 1, true })[0].Optics.Radius == 0.0);
  view.Parallel = true;
  CHECK(DivideLens(view, lens, { 7, true }).size() == 1);
}

/// The area that points of the lens see, against the sum over 20,000 of them.
TEST_CASE("Visible area over the lens")
{
  Random random(3);
  const std::vector<ApertureSample> points = ApertureSamples(20000);
  for (int i = 0; i < 400; ++i)
  {
    const double base = random.Uniform(-1.0, 1.0), angle = random.Uniform(0.0, 2.0 * Pi);
    const bool twoSided = random.Integer(0, 1) == 0;
    const double slope = 1.0 - base;
    const VisibleAreaOf<double> area{ base, slope * std::cos(angle), slope * std::sin(angle),
      twoSided };
    double x = 0, y = 0, sum = 0;
    for (const ApertureSample& u : points)
    {
      const double signedArea = base + area.X * u.X + area.Y * u.Y;
      const double seen = twoSided ? std::abs(signedArea) : std::max(0.0, signedArea);
      CHECK(signedArea <= 1.0 + 1e-12);
      x += seen * u.X / 20000.0;
      y += seen * u.Y / 20000.0;
      sum += seen / 20000.0;
    }
    const MeanVisibleArea<double> mean = MeanOverLens(area);
    const bool whole = base >= slope; // all of the lens sees the same side
    CHECK_NEAR(mean.Area, sum, whole ? 1e-4 : 0.01 * slope);
    CHECK(std::hypot(mean.X, mean.Y) <= UniformLens + 1e-12);
    // The means of u times the area: the points' second moments are not quite a disc's.
    CHECK_NEAR(mean.Area * mean.X, x, whole ? 2e-4 * slope : 0.01 * slope);
    CHECK_NEAR(mean.Area * mean.Y, y, whole ? 2e-4 * slope : 0.01 * slope);
  }
  const MeanVisibleArea<double> flat = MeanOverLens<double>({ 1.0, 0.0, 0.0, true });
  CHECK(flat.Area == 1.0);
  CHECK(flat.X == 0.0);
  const MeanVisibleArea<double> hidden = MeanOverLens<double>({ -10.0, 11.0, 0.0, false });
  CHECK(hidden.Area == 0.0);
  CHECK(std::isfinite(hidden.X));
}

/// What is seen of leaves whose normals spread, against the sum over 20,000 of them.
TEST_CASE("Facing leaves")
{
  Random random(4);
  constexpr int count = 20000;
  for (int i = 0; i < 200; ++i)
  {
    const double spread = random.Uniform(0.0, 2.0), area = random.Uniform(-1.2, 1.2) * spread;
    const bool twoSided = random.Integer(0, 1) == 0;
    const auto mean = [&](double middle) {
      double sum = 0.0;
      for (int k = 0; k < count; ++k)
      {
        const double x = middle + spread * ((2.0 * k + 1.0) / count - 1.0);
        sum += (twoSided ? std::abs(x) : std::max(0.0, x)) / count;
      }
      return sum;
    };
    const FacingArea<double> facing = MeanFacingArea<double>(area, spread, twoSided);
    if (std::abs(area) < spread)
    {
      const double step = 1e-3 * spread;
      CHECK_NEAR(facing.Area, mean(area), 1e-6);
      CHECK_NEAR(facing.Slope, (mean(area + step) - mean(area - step)) / (2.0 * step), 2e-3);
    }
    else
    {
      CHECK(facing.Area == area);
      CHECK(facing.Slope == 1.0);
    }
  }
  const FacingArea<double> flat = MeanFacingArea<double>(0.5, 0.0, false);
  CHECK(flat.Area == 0.5);
  CHECK(MeanFacingArea<double>(0.0, 0.0, true).Area == 0.0);
}

/// Share of a disc of radius c convolved with a Gaussian that lies beyond an edge at distance x.
double DiscEdge(double x, double c, double variance)
{
  constexpr int steps = 4000;
  double beyond = 0.0;
  for (int i = 0; i < steps; ++i)
  {
    const double u = -1.0 + (2.0 * i + 1.0) / steps;
    const double density = 2.0 / Pi * std::sqrt(1.0 - u * u) * 2.0 / steps;
    beyond += density * 0.5 * std::erfc((x - c * u) / std::sqrt(2.0 * variance));
  }
  return beyond;
}

/// The edge of a half plane out of focus, of surfels and of their hierarchy, is nearly that of the
/// lens's disc convolved with pixel filter and reconstruction kernel.
TEST_CASE("Disc edge")
{
  for (double confusion : { 8.0, 12.0, 20.0, 40.0 })
  {
    SplatContext context;
    context.Camera = PinholeView(192, 8, 1000.0);
    context.Optics = { 0.0, 3.0 };
    context.Optics.Radius = confusion / (1000.0 * (1.0 - 1.0 / 3.0));
    TestCloud cloud;
    for (int j = -90; j < 90; ++j)
    {
      for (int i = -190; i < 0; ++i)
      {
        cloud.Add(SquareSurfel({ (i + 0.5) * 1e-3, (j + 0.5) * 1e-3, 1.0 }, 1e-3)); // 1 px apart
      }
    }
    TestHierarchy hierarchy(cloud);
    for (const SurfelCloud& drawn : { cloud.Get(), hierarchy.Get() })
    {
      const Picture picture = RenderPicture(context, { drawn });
      double largest = 0.0;
      for (int x = 0; x < 192; ++x)
      {
        largest = std::max(
          largest, std::abs(picture.At(x, 4, 3) - DiscEdge(x + 0.5 - 96.0, confusion, 1.25)));
      }
      std::printf("edge, C = %g px%s: off by %.4f at most\n", confusion,
        drawn.Clusters ? ", hierarchy" : "", largest);
      // Nodes of the default error have about 0.37 of the blur's deviation: so have their borders.
      CHECK(largest <= (drawn.Clusters ? 0.04 : 0.015));
    }
  }
}

/// Picture of the plane y = -0.4 with a smooth texture, as the lens sees it.
double PlaneTexture(double x, double z)
{
  return 0.5 + 0.2 * std::sin(2.5 * x) + 0.2 * std::sin(1.7 * z);
}

double PlaneThroughLens(const SplatContext& context, double px, double py)
{
  const View& v = context.Camera;
  const Lens& lens = context.Optics;
  double sum = 0.0;
  const std::vector<ApertureSample> points = ApertureSamples(400);
  for (const ApertureSample& u : points)
  {
    // From (R u, 0) through the pixel's point of the plane in focus, down to y = -0.4.
    const double f = lens.FocalDistance;
    const double ox = lens.Radius * u.X, oy = lens.Radius * u.Y;
    const double dx = (px - v.Cx) / v.Fx * f - ox, dy = (py - v.Cy) / v.Fy * f - oy;
    const double t = (-0.4 - oy) / dy;
    sum += PlaneTexture(ox + t * dx, t * f);
  }
  return sum / static_cast<double>(points.size());
}

/// A receding plane, far out of focus in front and behind: coverage and texture are the lens's. The
/// blur's gradient along the picture is half of what puts its foreground at infinity.
/// @param errors of the colour and of the coverage, with the paper's kernel and with Pearson's
void RecedingPlane(bool coarseGrids, double (&errors)[2], double (&coverages)[2])
{
  SplatContext context;
  context.CoarseGrids = coarseGrids;
  context.Camera = PinholeView(96, 96, 96.0);
  context.Camera.Cy = 120.0; // looks down
  context.Optics = { 0.16, 3.0 };
  TestCloud cloud;
  const double d = 0.01;
  for (int j = 0; j < 700; ++j)
  {
    for (int i = -450; i < 450; ++i)
    {
      TestSurfel s = SquareSurfel({ (i + 0.5) * d, -0.4, 0.25 + j * d }, d, 0.8); // not saturated
      if (std::abs(s.Position[0]) > 0.8 * s.Position[2] + 0.3)
      {
        continue;
      }
      s.Normal = { 0, 1, 0 };
      const float light = static_cast<float>(PlaneTexture(s.Position[0], s.Position[2]));
      s.Color = { { light, light, light, 1.0f } };
      cloud.Add(s);
    }
  }
  for (KernelType kernel : { KernelType::Gaussian, KernelType::PearsonII })
  {
    context.Settings.Kernel = kernel;
    const Picture picture = RenderPicture(context, { cloud.Get() });
    double& error = errors[kernel == KernelType::PearsonII];
    double& coverage = coverages[kernel == KernelType::PearsonII];
    for (int y = 20; y < 90; y += 3)
    {
      for (int x = 10; x < 90; x += 4)
      {
        const double truth = PlaneThroughLens(context, x + 0.5, y + 0.5);
        const double alpha = picture.At(x, y, 3);
        error = std::max(error, std::abs(picture.At(x, y, 0) / alpha - truth));
        coverage = std::max(coverage, std::abs(alpha - 0.8));
      }
    }
  }
}

TEST_CASE("Receding plane")
{
  for (const bool coarseGrids : { false, true })
  {
    double errors[2] = { 0, 0 }, coverages[2] = { 0, 0 };
    RecedingPlane(coarseGrids, errors, coverages);
    std::printf("receding plane%s: colour off by %.4f, coverage by %.4f; Gaussian %.4f, "
                "%.4f\n",
      coarseGrids ? " on coarse grids" : "", errors[1], coverages[1], errors[0], coverages[0]);
    CHECK(5.0 * errors[1] < errors[0]);
    CHECK(errors[1] < 0.001);
    // Ripple's compensation. On coarse grids, what leaks from one tent to the next: 0.0066.
    CHECK(coverages[1] < (coarseGrids ? 0.015 : 0.004));
  }
}

/// White where x is left of 0, or right of it.
void AddHalfWall(TestCloud& cloud, double z, bool left)
{
  const double d = 0.004 * z;
  for (int j = -60; j < 60; ++j)
  {
    for (int i = 0; i < 60; ++i)
    {
      TestSurfel s = SquareSurfel({ (left ? -i - 0.5 : i + 0.5) * d, (j + 0.5) * d, z }, d);
      s.Color = { { 0, 0, 1, 1 } };
      cloud.Add(s);
    }
  }
}

/// How much of the light from behind passes two walls that cover half of the lens each.
double LightBetweenWalls(KernelType kernel, bool sameSide, bool secondBehindFocus)
{
  SplatContext context;
  context.Camera = PinholeView(64, 64, 250.0);
  context.Optics = { 0.06, 3.0 }; // 10 px at the first wall
  context.Settings.Kernel = kernel;
  TestCloud cloud;
  AddHalfWall(cloud, 1.0, true);
  // In front of the focus the picture of a wall lies on the other side of the lens than behind it.
  AddHalfWall(cloud, secondBehindFocus ? 8.0 : 1.3, sameSide != secondBehindFocus);
  const Picture picture = RenderPicture(context, cloud);
  return 1.0 - 0.5 * (picture.At(31, 32, 3) + picture.At(32, 32, 3));
}

/// Two walls that leave nothing, or half of the light: with the paper's kernel, whose layers are
/// independent, a quarter either way.
TEST_CASE("Walls before the lens")
{
  for (const bool behind : { false, true })
  {
    const double same = LightBetweenWalls(KernelType::PearsonII, true, behind);
    const double opposite = LightBetweenWalls(KernelType::PearsonII, false, behind);
    std::printf("walls on one side: %.3f of the light passes (truly 0.5), on both: %.3f (0)\n",
      same, opposite);
    CHECK_NEAR(LightBetweenWalls(KernelType::Gaussian, true, behind), 0.25, 0.03);
    CHECK_NEAR(LightBetweenWalls(KernelType::Gaussian, false, behind), 0.25, 0.03);
    // T is reconstructed linearly (TestLensVisibility).
    CHECK(same > 0.35);
    CHECK(opposite < 0.14);
  }
}

/// What a plane alone gives: the same as if T did not depend on the point of the lens, but for what
/// the centroids of its layers do not allow.
TEST_CASE("Plane alone")
{
  SplatContext context;
  context.Camera = PinholeView(64, 64, 80.0);
  context.Optics = { 0.2, 2.0 };
  context.CoarseGrids = false;
  for (const double coverage : { 0.7, 1.0 })
  {
    TestCloud cloud;
    for (int j = -80; j < 80; ++j)
    {
      for (int i = -80; i < 80; ++i)
      {
        TestSurfel s = SquareSurfel({ (i + 0.5) * 0.03, (j + 0.5) * 0.03, 3.5 }, 0.03, coverage);
        const float light = static_cast<float>(0.5 + 0.4 * std::sin(3.0 * s.Position[0]));
        s.Color = { { light, 0.5f, 1.0f - light, 1.0f } };
        cloud.Add(s);
      }
    }
    const Picture whole = RenderPicture(context, cloud);
    double lowest = 1.0, largest = 0.0;
    for (std::size_t i = 3; i < whole.Color.size(); i += 4)
    {
      lowest = std::min<double>(lowest, whole.Color[i]);
      largest = std::max<double>(largest, whole.Color[i]);
    }
    std::printf("a plane of coverage %.1f: alpha %.5f to %.5f\n", coverage, lowest, largest);
    // RippleLoss makes up to 4 % more of this, and Gauss's circle problem 1 %.
    CHECK(lowest > coverage - 0.01);
    CHECK(largest < std::min(1.0 + 1e-6, 1.05 * coverage));
  }
}

/// Largest difference of the coverage of one picture to the mean of 200 pinholes.
double OffPinholes(SplatContext context, const TestCloud& cloud)
{
  const Picture one = RenderPicture(context, cloud);
  context.Sampling = { 200, true, false };
  return LargestDifference(one, RenderPicture(context, cloud));
}

/// Surfels at the rim of a thinly sampled pole that passes through the plane in focus: nearly
/// edge-on, each seen from a part of the lens, and thin on the screen. With lens points as if they
/// were as wide as long, the rim is off by 0.044.
TEST_CASE("Rim of a pole")
{
  SplatContext context;
  context.Camera = PinholeView(96, 96, 1000.0);
  context.Optics = { 0.15, 2.0 };
  context.CoarseGrids = false;
  TestCloud cloud;
  const double d = 0.012, radius = 0.06, slant = 0.6; // 6 px apart; the pole recedes
  const int around = 32;
  for (int j = -24; j < 24; ++j)
  {
    for (int i = 0; i < around; ++i)
    {
      const double angle = 2.0 * Pi * (i + 0.5 * (j & 1)) / around;
      TestSurfel s = SquareSurfel({ 0, 0, 0 }, d);
      s.Normal = { std::cos(angle), std::sin(angle) * std::sin(slant),
        -std::sin(angle) * std::cos(slant) };
      s.Position = { radius * s.Normal[0], j * d * std::cos(slant) + radius * s.Normal[1],
        2.0 + j * d * std::sin(slant) + radius * s.Normal[2] };
      cloud.Add(s);
    }
  }
  const double off = OffPinholes(context, cloud);
  std::printf("rim of a pole: coverage off by %.4f\n", off);
  CHECK(off < 0.035);
}

/// Depth of cells is the innermost one's, their statistics are sums, and their threads agree.
TEST_CASE("Cells")
{
  SplatContext context;
  context.Camera = PinholeView(64, 48, 60.0);
  context.Optics = { 0.1, 2.0 };
  TestCloud cloud;
  Random random(9);
  for (int i = 0; i < 4000; ++i)
  {
    TestSurfel s;
    s.Position = { random.Uniform(-1, 1), random.Uniform(-1, 1), random.Uniform(1.5, 4.0) };
    s.SigmaU = s.SigmaV = 0.03;
    s.Area = 0.005;
    s.Color = { { 0.9f, static_cast<float>(random.Uniform(0, 1)), 0.1f, 1.0f } };
    cloud.Add(s);
  }
  context.Sampling = { 7, false, true };
  Splatter splatter;
  Picture seven(64, 48), threaded(64, 48);
  splatter.Render(context, { cloud.Get() }, SerialExecutor(), seven.Get());
  CHECK(splatter.Statistics().Surfels == 4000);
  CHECK(splatter.Statistics().Splats > 7 * 2000);
  splatter.Render(context, { cloud.Get() }, ThreadExecutor(3), threaded.Get());
  CHECK(seven.Color == threaded.Color);
  CHECK(seven.Depth == threaded.Depth);
  // The mean of pictures that were rendered one by one.
  std::vector<double> sum(seven.Color.size(), 0.0);
  for (const SubAperture& cell : DivideLens(context.Camera, context.Optics, context.Sampling))
  {
    SplatContext alone = context;
    alone.Sampling = ApertureSampling();
    alone.Camera = cell.Camera;
    alone.Optics = cell.Optics;
    const Picture picture = RenderPicture(alone, cloud);
    for (std::size_t i = 0; i < sum.size(); ++i)
    {
      sum[i] += picture.Color[i] / 7.0;
    }
    for (std::size_t i = 0; cell.Center[0] == 0.0 && i < picture.Depth.size(); ++i)
    {
      CHECK((picture.Depth[i] == 0.0f || seven.Color[4 * i + 3] < 0.5f ||
        picture.Depth[i] == seven.Depth[i]));
    }
  }
  for (std::size_t i = 0; i < sum.size(); ++i)
  {
    CHECK_NEAR(seven.Color[i], sum[i], 1e-6);
  }
}
}
