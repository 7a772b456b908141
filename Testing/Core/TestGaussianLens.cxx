// SPDX-License-Identifier: BSD-3-Clause
/**
 * Gaussians in space through the lens: mass kept over every blur, against means of pinholes, no
 * jumps while the blur grows, the ramp that stands for T over the lens, and runs on cells against
 * pixels.
 */
#include "Core/Lens/GaussianFootprint.h"
#include "Core/Lens/LensVisibility.h"
#include "TestScene.h"
#include "Testing/Shared/Check.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

using namespace SurfelSplatting;

namespace
{
constexpr int Size = 128;
constexpr double Focal = 200.0, Focus = 1.0, Depth = 2.0;

/// A lens with which a point at Depth has this circle of confusion, px.
Lens LensOf(double confusion)
{
  return { confusion / (Focal * (1.0 / Focus - 1.0 / Depth)), Focus };
}

SplatContext ContextOf(double confusion)
{
  SplatContext context;
  context.Camera = PinholeView(Size, Size, Focal);
  context.Optics = LensOf(confusion);
  return context;
}

/// Deviations on the screen, px.
TestCloud One(CloudKind kind, double sigmaX, double sigmaY, float density)
{
  TestCloud cloud;
  cloud.Kind = kind;
  const double x = sigmaX * Depth / Focal, y = sigmaY * Depth / Focal;
  const double c = std::cos(0.5), s = std::sin(0.5);
  cloud.Add(TestGaussian{ { 0.0031, 0.0043, Depth },
    { c * c * x * x + s * s * y * y, s * s * x * x + c * c * y * y, 1e-6, c * s * (x * x - y * y),
      0.0, 0.0 },
    density, { { 1, 1, 1, 1 } } });
  return cloud;
}

/// Thin Gaussians: the sum of alpha is 2 pi o sqrt(det W_0) of captures, and M f^2 |p| / z^3 of
/// volumes, from focus to a blur of 20 px, with and without cells.
TEST_CASE("Mass")
{
  for (const CloudKind kind : { CloudKind::Capture, CloudKind::Volume })
  {
    double worst = 0.0, worstSharp = 0.0, worstCells = 0.0;
    const float density = kind == CloudKind::Capture ? 1e-3f : 0.1f;
    const TestCloud cloud = One(kind, 2.0, 0.7, density);
    const double root = std::sqrt((4.0 + 0.3) * (0.49 + 0.3)); // of det W_0
    const double mass = cloud.Get().Area(0) * Focal * Focal / (Depth * Depth);
    const double expected = kind == CloudKind::Capture ? density * 2.0 * Pi * root : mass;
    for (double c = 0.0; c <= 20.0; c = 1.1 * c + 0.05)
    {
      for (const bool cells : { false, true })
      {
        SplatContext context = ContextOf(c);
        context.CoarseGrids = cells; // with them, runs
        const double off = std::abs(SumOfAlpha(RenderPicture(context, cloud)) / expected - 1.0);
        double& largest = cells ? worstCells : c < 2.0 ? worstSharp : worst;
        largest = std::max(largest, off);
      }
    }
    std::printf(
      "mass: off by %.4f in focus, %.4f blurred, %.4f on cells\n", worstSharp, worst, worstCells);
    // A capture ends at q = 9, beyond which are exp(-9/2) = 1.1 % of it; a volume's opacity is less
    // than its depth, of 1e-3. The blurred kernels step down within a pixel or two, which sums over
    // pixels see. A disc that is 1.5 cells in radius covers one cell more or less: the mass of many
    // is kept, not that of one.
    CHECK(worstSharp < 0.0135);
    CHECK(worst < 0.009);
    CHECK(worstCells < 0.25);
  }
}

/// A Gaussian and a needle alone: the mean of 400 pinholes.
TEST_CASE("Mean of pinholes")
{
  for (const double sigmaY : { 2.0, 0.3 })
  {
    for (const double c : { 1.0, 3.0, 6.0, 12.0 })
    {
      const TestCloud cloud = One(CloudKind::Capture, 4.0, sigmaY, 0.5f);
      SplatContext context = ContextOf(c);
      context.CoarseGrids = false;
      const Picture blurred = RenderPicture(context, cloud);
      context.Sampling.Count = 400;
      context.Sampling.Pinholes = true;
      const Picture mean = RenderPicture(context, cloud);
      const double peak = *std::max_element(mean.Color.begin(), mean.Color.end());
      const double worst = LargestDifference(blurred, mean) / peak;
      std::printf("C %.0f px, %.1f px across: off by %.3f of the peak\n", c, sigmaY, worst);
      // Mass, variance and kurtosis agree. The disc's edge is as wide as the Gaussian in each
      // direction, which no function of q is: measured.
      CHECK(worst < (sigmaY > 1.0 ? 0.18 : 0.32));
      CHECK_NEAR(SumOfAlpha(blurred) / SumOfAlpha(mean), 1.0, 0.012);
    }
  }
}

/// While C grows by 0.8 %, no pixel changes by more than the footprint's peak does, but for what a
/// kernel that ends at q = 9 or 20 leaves there.
TEST_CASE("No jumps")
{
  for (const CloudKind kind : { CloudKind::Capture, CloudKind::Volume })
  {
    double worst = 0.0, at = 0.0;
    const TestCloud cloud = One(kind, 1.5, 0.5, kind == CloudKind::Capture ? 0.8f : 80.0f);
    Picture last(Size, Size);
    for (double c = 0.05; c < 24.0; c *= 1.008)
    {
      SplatContext context = ContextOf(c);
      context.CoarseGrids = false;
      const Picture next = RenderPicture(context, cloud);
      const double change = c > 0.05 ? LargestDifference(last, next) : 0.0;
      at = change > worst ? c : at;
      worst = std::max(worst, change);
      std::copy(next.Color.begin(), next.Color.end(), last.Color.begin());
    }
    std::printf("largest change %.5f at C = %.2f px\n", worst, at);
    // In focus, where a capture ends, a pixel has 0.8 exp(-10.67 / 2) = 0.0038.
    CHECK(worst < 0.0045);
  }
}

/// Ein(t), by the midpoint rule.
double DepthOfOpacity(double depth)
{
  constexpr int Steps = 2000;
  double sum = 0.0;
  for (int i = 0; i < Steps; ++i)
  {
    const double t = depth * (i + 0.5) / Steps;
    sum -= std::expm1(-t) / t;
  }
  return sum * depth / Steps;
}

/// A Gaussian spread by the lens hides as much in the mean.
TEST_CASE("Kept opacity")
{
  for (const double depth : { 0.01, 0.3, 1.0, 3.0, 6.0 })
  {
    for (const double ratio : { 1.0, 0.9, 0.5, 0.1, 0.001 })
    {
      const double kept = KeepOpacity(depth, depth * ratio);
      CHECK(kept <= depth * ratio);
      CHECK_NEAR(DepthOfOpacity(kept) / (ratio * DepthOfOpacity(depth)), 1.0, 0.016);
    }
  }
  for (const double depth : { 20.0, 200.0 })
  {
    CHECK_NEAR(DepthOfOpacity(KeepOpacity(depth, 0.001 * depth)) / (0.001 * DepthOfOpacity(depth)),
      1.0, 0.016);
  }
}

/// T of a ramp without blur. @param s component of the lens point along the moment
double RampAt(double mean, double moment, double s)
{
  return ReconstructRamp<double>(mean, { moment * moment, moment * s, 0.0 }, 0.0f);
}

/// Means over the disc, by the midpoint rule in the angle.
struct RampOverLens
{
  double Mean = 0.0, Moment = 0.0, Least = 1.0, Most = 0.0, FromLine = 0.0, FromSegment = 0.0;
  double Falls = 0.0; ///< largest step down towards the side that is seen

  RampOverLens(double mean, double moment, double border)
  {
    constexpr int Steps = 1000;
    double last = 1.0;
    for (int i = 0; i < Steps; ++i)
    {
      const double angle = Pi * (i + 0.5) / Steps, s = std::cos(angle);
      const double strip = 2.0 * std::sin(angle) * std::sin(angle) / Steps;
      const double t = RampAt(mean, moment, s);
      this->Mean += strip * t;
      this->Moment += strip * s * t;
      this->Least = std::min(this->Least, t);
      this->Most = std::max(this->Most, t);
      this->FromLine = std::max(this->FromLine, std::abs(t - mean - 4.0 * moment * s));
      this->FromSegment += strip * std::abs(t - (s > border ? 1.0 : 0.0));
      this->Falls = std::max(this->Falls, t - last);
      last = t;
    }
  }
};

/// The chord that cuts off a segment of this area, as a share of the disc.
double SegmentBorder(double area)
{
  double low = -1.0, high = 1.0;
  for (int i = 0; i < 60; ++i)
  {
    const double t = 0.5 * (low + high);
    const double right = (std::acos(t) - t * std::sqrt(1.0 - t * t)) / Pi;
    (right > area ? low : high) = t;
  }
  return low;
}

TEST_CASE("Ramp")
{
  double worst[2] = {};
  for (int i = 1; i < 100; ++i)
  {
    const double mean = 0.01 * i, border = SegmentBorder(mean);
    for (int k = 0; k <= 40; ++k)
    {
      const double r = 0.025 * k, moment = r * LargestMoment(mean);
      const RampOverLens ramp(mean, moment, border);
      CHECK(ramp.Least >= 0.0);
      CHECK(ramp.Most <= 1.0);
      CHECK(ramp.Falls <= 0.0);
      CHECK(std::isfinite(ramp.Mean)); // the limits below do not see NaN
      worst[0] = std::max(worst[0], std::abs(ramp.Mean - mean));
      worst[1] = std::max(worst[1], std::abs(ramp.Moment - moment));
      if (k <= 1)
      {
        CHECK_NEAR(ramp.FromLine, 0.0, 4e-4); // straight where T hardly varies
      }
      if (k == 40)
      {
        CHECK_NEAR(ramp.FromSegment, 0.0, 0.02); // the fit of its border
      }
    }
  }
  std::printf("ramp: mean and moment off by %.4f, %.4f\n", worst[0], worst[1]);
  // LensVisibility.h
  CHECK(worst[0] < 0.0081);
  CHECK(worst[1] < 0.0076);
  for (const double mean : { 0.0, 1.0, -1e-7, 1.0 + 1e-7 })
  {
    for (const double moment : { 0.0, 1e-4, 0.3 })
    {
      const double t = RampAt(mean, moment, 0.5);
      CHECK(t >= 0.0);
      CHECK(t <= 1.0);
    }
  }
}

/// The light of a fragment that comes from all about its lens point sees more of what is hidden
/// there, and less of what is not.
TEST_CASE("Blurred ramp")
{
  for (const double mean : { 0.1, 0.5, 0.8 })
  {
    const double moment = 0.9 * LargestMoment(mean), squared = moment * moment;
    const double border = SegmentBorder(mean), hidden = border - 0.2, seen = border + 0.2;
    double low = 0.0, high = 1.0;
    for (const double spread : { 0.0, 0.1, 0.3, 0.6, 1.0 })
    {
      const auto at = [&](double s) {
        return ReconstructRamp<double>(
          mean, { squared, moment * s, squared * spread }, BlurOfRamp(1.0f));
      };
      CHECK(at(hidden) >= low);
      CHECK(at(seen) <= high);
      low = at(hidden);
      high = at(seen);
    }
    CHECK(low > 0.0);
    CHECK(high < 1.0);
  }
  // Where pixels are not square, the share of the lens exceeds 1: as sharp as without blur.
  const double moment = 0.8 * LargestMoment(0.5), squared = moment * moment;
  for (const double s : { -0.5, -0.1, 0.0, 0.1, 0.5 })
  {
    CHECK(ReconstructRamp<double>(0.5, { squared, moment * s, -squared }, BlurOfRamp(1.0f)) ==
      RampAt(0.5, moment, s));
  }
  CHECK(BlurOfRamp(0.0f) == 0.0f);
  CHECK(WeightOfRamp(0.0f) == 0.0f);
  CHECK(WeightOfRamp(1.0f) == 1.0f);
}

/// An ellipse on the lens that lets 1 - opacity through.
struct HidingEllipse
{
  double X, Y, Long, Short, Angle, Opacity;

  /// q, 1 at the border
  double Distance(double x, double y) const
  {
    const double dx = x - this->X, dy = y - this->Y;
    const double c = std::cos(this->Angle), s = std::sin(this->Angle);
    const double along = (c * dx + s * dy) / this->Long, across = (c * dy - s * dx) / this->Short;
    return along * along + across * across;
  }

  double Mean() const { return 1.0 - this->Opacity * this->Long * this->Short; }

  /// Closed forms: minus those of what is hidden, a disc's having the covariance I / 4.
  LensMoments<double> Moments() const
  {
    const double h = 1.0 - this->Mean(), c = std::cos(2.0 * this->Angle);
    const double a = 0.25 * this->Long * this->Long, b = 0.25 * this->Short * this->Short;
    const double xx = this->X * this->X, yy = this->Y * this->Y;
    return { -h * this->X, -h * this->Y, -h * (2.0 * (a + b + xx + yy) - 1.0),
      -h * ((a - b) * c + xx - yy),
      -h * ((a - b) * std::sin(2.0 * this->Angle) + 2.0 * this->X * this->Y) };
  }
};

/// Leaves before the lens, most of which no first moment shows.
TEST_CASE("Ellipse on the lens")
{
  Random random(31);
  for (int i = 0; i < 200; ++i)
  {
    const double length = random.Uniform(0.2, 0.9), width = length * random.Uniform(0.2, 1.0);
    const double away = (1.0 - length) * random(), direction = random.Uniform(0.0, 2.0 * Pi);
    const HidingEllipse shape{ away * std::cos(direction), away * std::sin(direction), length,
      width, random.Uniform(0.0, Pi), random.Uniform(0.5, 1.0) };
    for (int k = 0; k < 50; ++k)
    {
      const double radius = std::sqrt(random()), angle = random.Uniform(0.0, 2.0 * Pi);
      const double x = radius * std::cos(angle), y = radius * std::sin(angle);
      const double q = shape.Distance(x, y);
      const EllipseOnLens<double> e = ReconstructEllipse(shape.Mean(), shape.Moments(), x, y);
      CHECK_NEAR(e.Opacity, shape.Opacity, 1e-6);
      const double inside = std::clamp(0.5 + EllipseSlope * (1.0 - q), 0.0, 1.0);
      CHECK_NEAR(e.Seen, 1.0 - shape.Opacity * inside, 1e-5);
    }
  }
}

/// A Gaussian spot on the lens in front of a linear T, by quadrature over the plane.
TEST_CASE("Moments behind a fragment")
{
  Random random(38);
  for (int repeat = 0; repeat < 20; ++repeat)
  {
    const double xx = random(), yy = random(), xy = random.Uniform(-0.9, 0.9) * std::sqrt(xx * yy);
    const ShareOfLens share{ static_cast<float>(xx), static_cast<float>(xy),
      static_cast<float>(yy) };
    const LensMoments<double> t{ random.Uniform(-0.2, 0.2), random.Uniform(-0.2, 0.2), 0, 0, 0 };
    const double x = random.Uniform(-0.7, 0.7), y = random.Uniform(-0.7, 0.7), alpha = random();
    const auto line = [&](double u, double v) { return 0.6 + 4.0 * (t.X * u + t.Y * v); };
    // Points u + d: d = R z, R R' = (1 - L) / 4 by Cholesky; 3 points of Gauss and Hermite.
    const double a = std::sqrt(0.25 * (1.0 - xx)), b = -0.25 * xy / a;
    const double c = std::sqrt(std::max(0.0, 0.25 * (1.0 - yy) - b * b));
    const double nodes[] = { -std::sqrt(3.0), 0.0, std::sqrt(3.0) }, weights[] = { 1, 4, 1 };
    LensMoments<double> hidden{ 0, 0, 0, 0, 0 };
    for (int i = 0; i < 9; ++i)
    {
      const double u = x + a * nodes[i % 3], v = y + b * nodes[i % 3] + c * nodes[i / 3];
      const double hides = alpha * weights[i % 3] * weights[i / 3] / 36.0 * line(u, v);
      hidden.X += hides * u;
      hidden.Y += hides * v;
      hidden.Rim += hides * (2.0 * (u * u + v * v) - 1.0);
      hidden.Across += hides * (u * u - v * v);
      hidden.Diagonal += hides * 2.0 * u * v;
    }
    if (b * b > 0.25 * (1.0 - yy)) // no such share: 1 - L has a negative eigenvalue
    {
      continue;
    }
    const LensMoments<double> behind = MomentsBehind<double>(
      t, share, share.MomentsAt(x, y), { alpha * line(x, y), alpha, 0.0, 0.5 }, 1.0f);
    CHECK_NEAR(behind.X, t.X - hidden.X, 1e-6);
    CHECK_NEAR(behind.Y, t.Y - hidden.Y, 1e-6);
    CHECK_NEAR(behind.Rim, -hidden.Rim, 1e-6);
    CHECK_NEAR(behind.Across, -hidden.Across, 1e-6);
    CHECK_NEAR(behind.Diagonal, -hidden.Diagonal, 1e-6);
  }
}

/// The smallest ellipse is as large as what is hidden; impossible moments harm nothing.
TEST_CASE("Any moments on the lens")
{
  const LensMoments<double> none{ 0.0, 0.0, 0.0, 0.0, 0.0 };
  for (const double mean : { 0.0, 0.2, 0.7, 1.0 })
  {
    // The same everywhere.
    const double h = std::max(1.0 - mean, 1e-4);
    CHECK_NEAR(ReconstructEllipse(mean, none, 0.3, 0.4).Opacity, h, 1e-9);
    CHECK_NEAR(ReconstructEllipse(mean, none, 0.3, 0.4).Seen, 1.0 - h, 1e-9);
  }
  Random random(37);
  for (int i = 0; i < 2000; ++i)
  {
    const auto moment = [&] { return random.Uniform(-0.3, 0.3); };
    const LensMoments<double> t{ moment(), moment(), moment(), moment(), moment() };
    const double mean = random.Uniform(-1e-7, 1.0 + 1e-7);
    const EllipseOnLens<double> e = ReconstructEllipse(mean, t, moment(), moment());
    CHECK(e.Opacity >= std::min(1.0, 1.0 - mean));
    CHECK(e.Opacity <= 1.0);
    CHECK(e.Seen >= 0.0);
    CHECK(e.Seen <= 1.0);
    const double ramp = random(), seen = SeenBetween(ramp, e.Seen, random());
    CHECK(seen >= std::min(ramp, e.Seen) - 1e-9);
    CHECK(seen <= ramp + 1e-9);
  }
}

TestCloud RandomCloud(CloudKind kind, int count, double depth, Random& random)
{
  TestCloud cloud;
  cloud.Kind = kind;
  for (int i = 0; i < count; ++i)
  {
    TestGaussian g;
    const double z = random.Uniform(depth, depth + 2.0), sigma = random.Uniform(0.01, 0.06);
    g.Position = { random.Uniform(-0.4, 0.4) * z, random.Uniform(-0.4, 0.4) * z, z };
    g.Covariance = RandomCovariance({ sigma, sigma * random(), sigma * random() }, random);
    g.Density = static_cast<float>(kind == CloudKind::Capture ? random() : 12.0 * random());
    g.Color = { { static_cast<float>(random()), static_cast<float>(random()), 0.3f, 1.0f } };
    cloud.Add(g);
  }
  return cloud;
}

/// In focus, with a hole and a border: nothing, surfels, or opaque Gaussians.
TestCloud SharpSheet(int kind)
{
  TestCloud sheet;
  sheet.Kind = kind == 2 ? CloudKind::Capture : CloudKind::Surfels;
  for (int i = 0; kind > 0 && i < 100 * 100; ++i)
  {
    const Vector3 p{ (i % 100 - 49.5) * 0.01, (i / 100 - 49.5) * 0.01, Focus };
    if (std::hypot(p[0] - 0.1, p[1] - 0.1) <= 0.02 || p[0] >= 0.12)
    {
      continue;
    }
    if (kind == 1)
    {
      sheet.Add(SquareSurfel(p, 0.01));
    }
    else
    {
      sheet.Add(TestGaussian{ p, { 5e-5, 5e-5, 0, 0, 0, 0 }, 0.98f, { { 0, 1, 0, 1 } } });
    }
  }
  return sheet;
}

/// Runs on cells against pixels, in pictures that are no multiple of a tile, and behind sharp
/// sheets.
TEST_CASE("Cells against pixels")
{
  for (const CloudKind kind : { CloudKind::Capture, CloudKind::Volume })
  {
    for (const int sheet : { 0, 1, 2 })
    {
      Random random(7);
      const TestCloud cloud = RandomCloud(kind, 6000, 2.0, random), front = SharpSheet(sheet);
      SplatContext context = ContextOf(12.0);
      context.Camera.Width = 109;
      context.Camera.Height = 97;
      const std::vector<SurfelCloud> clouds{ cloud.Get(), front.Get() };
      const Picture cells = RenderPicture(context, clouds);
      context.SkipHidden = false;
      const Picture allCells = RenderPicture(context, clouds);
      context.CoarseGrids = false;
      const Picture allPixels = RenderPicture(context, clouds);
      context.SkipHidden = true;
      const Picture pixels = RenderPicture(context, clouds);
      const double largest = LargestDifference(pixels, cells);
      const double root = std::sqrt(MeanSquareDifference(pixels, cells));
      const double hiddenCells = LargestDifference(cells, allCells);
      std::printf("cells, sheet %d: off by %.4f at most, %.5f (RMS); hidden ones %.5f\n", sheet,
        largest, root, hiddenCells);
      // Bilinear interpolation at cells of 3/4 of a deviation of the blur, which were chosen by
      // RMS.
      CHECK(largest < 0.08);
      CHECK(root < 0.012);
      CHECK(LargestDifference(pixels, allPixels) <= 1.0 / 512.0);
      // Unless hidden ones are skipped, a surfel's layer is open outside of the picture as well,
      // and there is no run in such tiles. Cells begin with 1/4 or more where a pixel is open: what
      // they skip is 4 times as much in it.
      CHECK(hiddenCells <= (sheet == 1 ? 0.08 : 4.0 / 512.0));
    }
  }
}

/// Dense clouds: what is left of the light agrees with pinholes.
TEST_CASE("Dense clouds")
{
  for (const CloudKind kind : { CloudKind::Capture, CloudKind::Volume })
  {
    Random random(8);
    const TestCloud cloud = RandomCloud(kind, 3000, 1.2, random);
    SplatContext context = ContextOf(16.0);
    const Picture blurred = RenderPicture(context, cloud);
    context.Sampling.Count = 100;
    context.Sampling.Pinholes = true;
    const Picture mean = RenderPicture(context, cloud);
    const double root = std::sqrt(MeanSquareDifference(blurred, mean));
    const double alpha = SumOfAlpha(blurred) / (Size * Size),
                 other = SumOfAlpha(mean) / (Size * Size);
    std::printf("dense: alpha %.4f against %.4f, RMS %.4f\n", alpha, other, root);
    // Moments stand for T over the lens, and cells for pixels: measured.
    CHECK_NEAR(alpha, other, 0.03);
    CHECK(root < 0.025);
  }
}

/// Leaves that overlap are no finer than leaves at the same places that do not: through the lens
/// their nodes are as coarse, and in focus there are none.
TEST_CASE("Nodes of overlapping leaves")
{
  constexpr int Across = 64;
  std::uint64_t nodes[2][2];
  for (const bool overlap : { false, true })
  {
    const double pixel = Depth / Focal, deviation = (overlap ? 1.5 : 0.25) * pixel;
    const double variance = deviation * deviation;
    TestCloud sheet;
    sheet.Kind = CloudKind::Capture;
    for (int i = 0; i < Across * Across; ++i)
    {
      const Vector3 p{ (i % Across - 0.5 * Across) * pixel, (i / Across - 0.5 * Across) * pixel,
        Depth };
      sheet.Add(TestGaussian{ p, { variance, variance, 1e-6, 0, 0, 0 }, 0.5f, { { 1, 1, 1, 1 } } });
    }
    const TestHierarchy hierarchy(sheet);
    for (const bool blurred : { false, true })
    {
      const SplatContext context = ContextOf(blurred ? 4.0 : 0.0);
      CutWork work;
      std::vector<CutRange> runs;
      nodes[overlap][blurred] = SelectCut(hierarchy.Get(),
        { context.Camera, context.Optics, 4.0, SpacePrefilter }, {}, SerialExecutor(), work, runs)
                                  .Nodes;
    }
  }
  std::printf("nodes of the lens: %d, of leaves that overlap %d\n", static_cast<int>(nodes[0][1]),
    static_cast<int>(nodes[1][1]));
  CHECK(nodes[1][0] == Across * Across);
  CHECK(nodes[0][1] < Across * Across / 2);
  CHECK(nodes[1][1] <= nodes[0][1]);
}

/// A blurred sheet of many small Gaussians with a border, each of which hides next to nothing of
/// the lens: its tiles are doubtful, so that seven cells change them. A sharp one has no doubts.
TEST_CASE("Seven cells of a dense sheet")
{
  TestCloud sheet;
  sheet.Kind = CloudKind::Capture;
  Random random(9);
  for (int i = 0; i < 40000; ++i)
  {
    const Vector3 p{ random.Uniform(-0.8, 0.1), random.Uniform(-0.8, 0.8),
      Depth + random.Uniform(0.0, 0.02) };
    sheet.Add(TestGaussian{ p, { 2.5e-5, 2.5e-5, 1e-6, 0, 0, 0 }, 0.9f, { { 1, 1, 1, 1 } } });
  }
  for (const bool grids : { true, false })
  {
    SplatContext context = ContextOf(40.0);
    context.CoarseGrids = grids;
    const Picture one = RenderPicture(context, sheet);
    context.Sampling.Count = 7;
    const Picture seven = RenderPicture(context, sheet);
    context.Sampling.Everywhere = true;
    const Picture everywhere = RenderPicture(context, sheet);
    const double left = std::sqrt(MeanSquareDifference(seven, everywhere));
    const double all = std::sqrt(MeanSquareDifference(one, everywhere));
    std::printf("seven cells: RMS %.4f of everywhere's, of one picture %.4f\n", left, all);
    CHECK(all > 0.02);
    // Where one picture has no light left, nothing is in doubt, though cells may have some.
    CHECK(left < 0.25 * all);
  }
  SplatContext sharp = ContextOf(0.0);
  sharp.Optics = { 0.01, Depth };
  const Picture one = RenderPicture(sharp, sheet);
  sharp.Sampling.Count = 7;
  CHECK(LargestDifference(one, RenderPicture(sharp, sheet)) == 0.0);
}
}
