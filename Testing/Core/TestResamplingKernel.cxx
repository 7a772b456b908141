// SPDX-License-Identifier: BSD-3-Clause
/**
 * Mass, variance and bounding box of the resampling kernel, by numerical integration of the form
 * that the raster evaluates, for cut-offs and covariances of all kinds.
 */
#include "Core/Lens/ResamplingKernel.h"
#include "TestScene.h"
#include "Testing/Shared/Check.h"

#include <algorithm>
#include <cstdio>
#include <set>
#include <vector>

using namespace SurfelSplatting;

namespace
{
constexpr double Pi = 3.14159265358979324;

ResamplingKernel KernelOf(
  KernelType type, const Footprint& w, double squaredConfusion, const TruncatedGaussian& gaussian)
{
  return MakeKernel(
    ChooseProfile<double>(type, gaussian, w, BlurShape<double>(w, squaredConfusion)), w);
}

ResamplingKernel GaussianKernel(const Footprint& w, const TruncatedGaussian& gaussian)
{
  return KernelOf(KernelType::Gaussian, w, 0.0, gaussian);
}

ResamplingKernel LensKernel(
  const Footprint& w, double squaredConfusion, const TruncatedGaussian& gaussian)
{
  return KernelOf(KernelType::PearsonII, w, squaredConfusion, gaussian);
}

struct Moments
{
  double Mass = 0, XX = 0, YY = 0, XY = 0;
};

/// The kernel at q as a share of its peak (ResamplingKernel.h).
double ShapeAt(const ResamplingKernel& k, double q, double support)
{
  if (k.Shape < 0.0)
  {
    return std::exp(-0.5 * q);
  }
  const double x = 1.0 - q / support, u = std::min(1.0, (k.Shape - SmoothShape) * x);
  const BellWeights<double> bell = BellOf(k.Shape);
  return k.Shape >= SmoothShape ? u * u * (3.0 - 2.0 * u)
                                : x * (bell.Edge + x * (bell.Square + bell.Fourth * x * x));
}

/**
 * Integral over the support in polar coordinates of the ellipse, dx + K dy = sqrt(q / A) cos(t), dy
 * = sqrt(q / B) sin(t), dx dy = dq dt / (2 sqrt(A B)): eight angles are exact for second moments,
 * and five-point Gauss-Legendre panels of length 1/2 in q exact to rounding. They begin anew where
 * a plateau ends.
 */
Moments Integrate(const ResamplingKernel& k, double support)
{
  constexpr double Nodes[5] = { -0.906179845938664, -0.538469310105683, 0.0, 0.538469310105683,
    0.906179845938664 };
  constexpr double Weights[5] = { 0.236926885056189, 0.478628670499366, 0.568888888888889,
    0.478628670499366, 0.236926885056189 };
  const double steepness = k.Shape - SmoothShape;
  const double borders[3] = { 0.0, steepness > 1.0 ? support * (1.0 - 1.0 / steepness) : 0.0,
    support };
  const int panels = static_cast<int>(std::ceil(2.0 * support));
  Moments m;
  for (int i = 0; i < 10 * panels; ++i)
  {
    const int part = i % 2, panel = i / 10;
    const double length = (borders[part + 1] - borders[part]) / panels;
    const double q = borders[part] + length * (panel + 0.5 + 0.5 * Nodes[i / 2 % 5]);
    const double dq = 0.5 * length * Weights[i / 2 % 5];
    for (int j = 0; j < 8; ++j)
    {
      const double t = Pi * j / 4.0;
      const double dy = std::sqrt(q / k.B) * std::sin(t);
      const double dx = std::sqrt(q / k.A) * std::cos(t) - k.K * dy;
      const double u = dx + k.K * dy;
      const double value = k.Peak * ShapeAt(k, k.A * u * u + k.B * dy * dy, support);
      const double share = value * dq * Pi / 4.0 / (2.0 * std::sqrt(k.A * k.B));
      m.Mass += share;
      m.XX += share * dx * dx;
      m.YY += share * dy * dy;
      m.XY += share * dx * dy;
    }
  }
  return m;
}

/// Random positive semi-definite matrix; every third of rank one, some very long.
Symmetric2 RandomCovariance(Random& random, int index)
{
  const double angle = random.Uniform(0.0, Pi);
  const double major = std::pow(10.0, random.Uniform(-6.0, 6.0));
  const double minor = index % 3 == 0 ? 0.0 : major * random.Uniform(0.0, 1.0);
  const double c = std::cos(angle), s = std::sin(angle);
  return { major * c * c + minor * s * s, major * s * s + minor * c * c, (major - minor) * c * s };
}

void CheckBox(const ResamplingKernel& k, double support)
{
  double right = 0.0, top = 0.0;
  constexpr int Steps = 4000;
  for (int i = 0; i < Steps; ++i)
  {
    const double angle = 2.0 * Pi * i / Steps;
    const double dy = std::sqrt(support / k.B) * std::sin(angle);
    const double dx = std::sqrt(support / k.A) * std::cos(angle) - k.K * dy;
    right = std::max(right, dx);
    top = std::max(top, dy);
  }
  // Rounding in double, amplified by up to 1e6 = the condition of the longest covariances.
  CHECK(right <= k.HalfWidth * (1.0 + 1e-9));
  CHECK(top <= k.HalfHeight * (1.0 + 1e-9));
  // Not larger than needed: the samples miss the extreme by at most 1 - cos(pi / Steps).
  const double missed = 1.0 - std::cos(Pi / Steps) + 1e-9;
  CHECK(right >= k.HalfWidth * (1.0 - missed));
  CHECK(top >= k.HalfHeight * (1.0 - missed));
}

void CheckKernel(
  const Symmetric2& projected, const Symmetric2& variance, double cutoff, const ResamplingKernel& k)
{
  const TruncatedGaussian gaussian(cutoff);
  const Moments m = Integrate(k, gaussian.Support());
  const double wxx = projected.XX + variance.XX, wyy = projected.YY + variance.YY;
  const double determinant = wxx * wyy - projected.XY * projected.XY;
  // The integration is exact to rounding; tau loses digits as c^2 at small c, and the determinant
  // those of its terms.
  const double rounding = 1e-12 + 1e-15 / (cutoff * cutoff);
  const double condition = 1e-15 * wxx * wyy / determinant;
  CHECK_NEAR(m.Mass, 1.0, rounding + condition);
  CHECK_NEAR(m.XX / wxx, 1.0, rounding + condition);
  CHECK_NEAR(m.YY / wyy, 1.0, rounding + condition);
  CHECK_NEAR(
    m.XY / std::sqrt(wxx * wyy), projected.XY / std::sqrt(wxx * wyy), rounding + condition);
  CHECK_NEAR(Footprint(projected, variance).Determinant / determinant, 1.0, rounding + condition);
  CheckBox(k, gaussian.Support());
}

TEST_CASE("Moments")
{
  Random random(2);
  std::set<double> smooth;
  std::set<int> kinds; // bell, bell in focus, smooth, smooth with a plateau
  for (double cutoff : { 0.01, 0.1, 0.5, 1.0, 2.0, 2.5, 3.0, 4.0, 8.0, 20.0 })
  {
    for (int i = 0; i < 40; ++i)
    {
      const Symmetric2 projected = RandomCovariance(random, i);
      const double v = random.Uniform(0.1, 100.0);
      const Symmetric2 variance{ v, i % 2 ? v : v * random.Uniform(0.2, 5.0), 0.0 };
      const Footprint w(projected, variance);
      const TruncatedGaussian gaussian(cutoff);
      CheckKernel(projected, variance, cutoff, GaussianKernel(w, gaussian));
      // The disc's own variance, C^2 / 4, is part of the isotropic one; every other is nearly all
      // blur.
      const double share = i % 2 ? random.Uniform(0.0, 1.0) : 1.0 - 0.1 * random.Uniform(0.0, 1.0);
      const Symmetric2 little{ i % 2 ? projected.XX : 0.0, i % 2 ? projected.YY : 0.0,
        i % 2 ? projected.XY : 0.0 };
      const ResamplingKernel lens = LensKernel(
        Footprint(little, variance), 4.0 * std::min(variance.XX, variance.YY) * share, gaussian);
      kinds.insert(
        static_cast<int>(std::min(2.0 + SmoothShape, lens.Shape)) - (lens.Shape < 1.0 ? 1 : 0));
      smooth.insert(std::max(lens.Shape, SmoothShape));
      CheckKernel(little, variance, cutoff, lens);
    }
  }
  CHECK(kinds.size() >= 4);
  CHECK(smooth.size() > 50);
  CHECK(*smooth.rbegin() > SmoothShape + 1.0); // with a plateau
}

/// The kurtosis E[q^2] of a kernel, q = x' W^-1 x, by the midpoint rule.
double Kurtosis(const ResamplingKernel& k, double support, double scale)
{
  constexpr int Steps = 20000;
  double mass = 0.0, squares = 0.0;
  for (int i = 0; i < Steps; ++i)
  {
    const double q = support * (i + 0.5) / Steps, value = ShapeAt(k, q, support);
    mass += value;
    squares += value * q * q / (scale * scale);
  }
  return squares / mass;
}

/// Smooth kernels have the kurtosis of the disc convolved with the splat, 8 (n + 2) / (n + 3), up
/// to where that of focus takes over.
TEST_CASE("Kurtosis")
{
  const TruncatedGaussian gaussian(2.5);
  const Symmetric2 variance{ 100.0, 100.0, 0.0 };
  double last = 1e300;
  for (double share : { 1.0, 0.98, 0.93, 0.85, 0.8, 0.75, 0.67, 0.65, 0.6, 0.3 })
  {
    const double squaredConfusion = 400.0 * share;
    const ResamplingKernel k =
      LensKernel(Footprint({ 0, 0, 0 }, variance), squaredConfusion, gaussian);
    const double n = 48.0 * 100.0 * 100.0 / (squaredConfusion * squaredConfusion) - 3.0;
    CHECK((k.Shape <= 1.0) == (n >= 1.99));
    if (n >= 1.99)
    {
      CHECK(last > SmoothShape); // a bell from here on
      continue;
    }
    CHECK(k.Shape < last); // softer and softer
    const double scale = gaussian.Support() / (k.HalfWidth * k.HalfWidth / 100.0);
    // A cell of the midpoint rule is 1/20000 of the support; the step at n = 0 is 1/1000 of it.
    CHECK_NEAR(Kurtosis(k, gaussian.Support(), scale), 8.0 * (n + 2.0) / (n + 3.0), 1e-4);
    last = k.Shape;
  }
}

/// Distance of a kernel of variance 1 to the disc of radius C convolved with the kernel in focus of
/// variance 1 - C^2 / 4, root mean square over the plane, relative.
double OffConvolution(double confusion, const TruncatedGaussian& gaussian)
{
  const double rest = 1.0 - 0.25 * confusion * confusion;
  const ResamplingKernel focus =
    LensKernel(Footprint({ 0, 0, 0 }, { rest, rest, 0.0 }), 0.0, gaussian);
  const ResamplingKernel lens =
    LensKernel(Footprint({ 0, 0, 0 }, { 1.0, 1.0, 0.0 }), confusion * confusion, gaussian);
  const auto at = [&](const ResamplingKernel& k, double x, double y) {
    const double q = k.A * x * x + k.B * y * y;
    return q < gaussian.Support() ? k.Peak * ShapeAt(k, q, gaussian.Support()) : 0.0;
  };
  constexpr int Points = 4000, Steps = 90;
  double off = 0.0, all = 0.0;
  for (int i = 0; i < Steps; ++i)
  {
    const double r = 4.5 * (i + 0.5) / Steps;
    double mean = 0.0;
    for (int p = 0; p < Points; ++p) // Vogel's spiral
    {
      const double u = confusion * std::sqrt((p + 0.5) / Points), angle = 2.399963229728653 * p;
      mean += at(focus, r - u * std::cos(angle), u * std::sin(angle)) / Points;
    }
    const double difference = at(lens, r, 0.0) - mean;
    off += r * difference * difference;
    all += r * mean * mean;
  }
  return std::sqrt(off / all);
}

/// Where a surfel is as wide as its blur and wider, its kernel is close to the disc convolved with
/// that in focus. With the kernel in focus itself up to a share of 0.48, it was off by 0.053.
TEST_CASE("Disc and kernel in focus")
{
  const TruncatedGaussian gaussian(2.5);
  for (const double share : { 0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.65, 0.7 })
  {
    const double off = OffConvolution(2.0 * std::sqrt(share), gaussian);
    std::printf("the lens has %.2f of the variance: off by %.4f\n", share, off);
    CHECK(off < 0.045);
  }
}

/// Integral of a kernel over y at each of some x, equally far apart about 0.
std::vector<double> Marginal(
  const ResamplingKernel& k, const TruncatedGaussian& gaussian, int places, double step)
{
  constexpr int Steps = 400;
  std::vector<double> sums(static_cast<std::size_t>(places));
  for (int i = 0; i < places; ++i)
  {
    const double x = step * (i - places / 2);
    for (int j = 0; j < Steps; ++j)
    {
      const double y = k.HalfHeight * (2.0 * (j + 0.5) / Steps - 1.0), slanted = x + k.K * y;
      const double q = k.A * slanted * slanted + k.B * y * y;
      sums[static_cast<std::size_t>(i)] += q < gaussian.Support()
        ? k.Peak * ShapeAt(k, q, gaussian.Support()) * 2.0 * k.HalfHeight / Steps
        : 0.0;
    }
  }
  return sums;
}

/// Largest difference between what the left parts of two surfels cover: of one with the kernel of a
/// lens, and of the disc convolved with that in focus, summed along y.
double OffAcross(const Symmetric2& own, double confusion, const TruncatedGaussian& gaussian)
{
  const double v = 0.25 * confusion * confusion;
  constexpr int Places = 801, Points = 200;
  const double step = 8.0 * std::sqrt(own.XX + v) / Places;
  const std::vector<double> lens =
    Marginal(LensKernel(Footprint(own, { v, v, 0.0 }), 4.0 * v, gaussian), gaussian, Places, step);
  const std::vector<double> focus =
    Marginal(LensKernel(Footprint({ 0, 0, 0 }, own), 0.0, gaussian), gaussian, Places, step);
  double off = 0.0, largest = 0.0;
  for (int i = 0; i < Places; ++i)
  {
    double mean = 0.0; // over the disc, whose points lie at confusion cos(angle)
    for (int p = 0; p < Points; ++p)
    {
      const double angle = Pi * (p + 0.5) / Points, s = std::sin(angle);
      const double at = i - confusion * std::cos(angle) / step, below = std::floor(at);
      const auto focusAt = [&](double place) {
        return place >= 0.0 && place < Places ? focus[static_cast<std::size_t>(place)] : 0.0;
      };
      const double value = focusAt(below) + (at - below) * (focusAt(below + 1.0) - focusAt(below));
      mean += 2.0 * s * s / Points * value;
    }
    off += step * (lens[static_cast<std::size_t>(i)] - mean);
    largest = std::max(largest, std::abs(off));
  }
  return largest;
}

/// Surfels at a silhouette are thin across it, and lie side by side along it. With the kurtosis of
/// the whole kernel, their sum would be off by up to 0.018 of the coverage.
TEST_CASE("Silhouettes of thin surfels")
{
  const TruncatedGaussian gaussian(2.5);
  for (const double along : { 0.15, 0.6, 1.5, 3.0 })
  {
    for (const double confusion : { 0.5, 1.0, 1.5, 2.0, 3.0, 4.0 })
    {
      const double off = OffAcross({ 0.15, along, 0.0 }, confusion, gaussian);
      std::printf("%.2f by 0.15 px^2, blur %.1f px: off by %.4f\n", along, confusion, off);
      CHECK(off < 0.005);
    }
  }
}

LensShape RandomShape(Random& random)
{
  const double ratio = std::pow(10.0, random.Uniform(-1.0, 1.0)), angle = random.Uniform(0.0, Pi);
  const double c = std::cos(angle), s = std::sin(angle);
  return { ratio * c * c + s * s / ratio, ratio * s * s + c * c / ratio,
    (ratio - 1.0 / ratio) * c * s };
}

/// The map that makes a disc of an ellipse makes of its footprint the disc's, with the same kernel.
TEST_CASE("Ellipses")
{
  Random random(6);
  const TruncatedGaussian gaussian(2.5);
  for (int i = 0; i < 200; ++i)
  {
    const LensShape shape = RandomShape(random), root = shape.Root();
    CHECK_NEAR(root.XX * root.XX + root.XY * root.XY, shape.XX, 1e-13 * shape.XX);
    CHECK_NEAR(root.XX * root.YY - root.XY * root.XY, 1.0, 1e-12);
    CHECK_NEAR(shape.Smallest() + shape.Largest(), shape.XX + shape.YY, 1e-12 * shape.Largest());
    const double confusion = std::pow(10.0, random.Uniform(0.0, 1.5));
    const double v = 0.25 * confusion * confusion, u = random.Uniform(0.1, 20.0);
    const Symmetric2 own{ u, random.Uniform(0.1, 20.0), 0.09 * u };
    const Symmetric2 lens{ v * shape.XX, v * shape.YY, v * shape.XY };
    const Footprint w(own, lens);
    const double wxx = own.XX + lens.XX, wyy = own.YY + lens.YY, wxy = own.XY + lens.XY;
    CHECK_NEAR(w.XX / wxx, 1.0, 1e-12);
    CHECK_NEAR(w.XY, wxy, 1e-12 * (wxx + wyy));
    CHECK_NEAR(w.Determinant / (wxx * wyy - wxy * wxy), 1.0, 1e-9);

    const double a = root.YY, b = -root.XY, c = root.XX; // the inverse of root
    const Symmetric2 mapped{ a * a * own.XX + 2.0 * a * b * own.XY + b * b * own.YY,
      b * b * own.XX + 2.0 * b * c * own.XY + c * c * own.YY,
      a * b * own.XX + (a * c + b * b) * own.XY + b * c * own.YY };
    const Symmetric2 disc{ v, v, 0.0 };
    const Footprint ofDisc(mapped, disc);
    const KernelProfile<double> profile = ChooseProfile<double>(KernelType::PearsonII, gaussian, w,
      BlurShape<double>(w, 4.0 * v, { shape.XX, shape.YY, shape.XY }));
    const KernelProfile<double> expected = ChooseProfile<double>(
      KernelType::PearsonII, gaussian, ofDisc, BlurShape<double>(ofDisc, 4.0 * v));
    CHECK_NEAR(profile.Reach, expected.Reach, 1e-6 * expected.Reach);
    CHECK_NEAR(profile.Peak, expected.Peak, 1e-6 * expected.Peak);
    CHECK_NEAR(profile.Shape, expected.Shape, 1e-6 * expected.Shape);
  }
}

/// All blur: the uniform disc. None: that of focus. In between, what is not blur takes the border
/// in.
TEST_CASE("Limits")
{
  const TruncatedGaussian gaussian(2.5);
  const Symmetric2 variance{ 100.0, 100.0, 0.0 };
  const Footprint w({ 0, 0, 0 }, variance);
  const ResamplingKernel disc = LensKernel(w, 400.0, gaussian);
  CHECK_NEAR(disc.Peak, 1.0 / (Pi * 400.0), 1e-15); // 1 / (pi C^2)
  CHECK_NEAR(disc.HalfWidth, 20.0, 0.003);          // C; its border is 1e-3 wide in q
  double last = 1e30;
  for (double share : { 1.0, 0.99, 0.98, 0.95, 0.9, 0.85 })
  {
    const double shape = LensKernel(w, 400.0 * share, gaussian).Shape;
    CHECK(shape >= SmoothShape);
    CHECK(shape < last);
    last = shape;
  }
  CHECK(LensKernel(w, 0.0, gaussian).Shape == 1.0);
  const Symmetric2 little{ 1.0, 1.0, 0.0 };
  CHECK(LensKernel(Footprint({ 3, 2, 1 }, little), 0.0, gaussian).Shape == 1.0);
}

/// A kernel changes continuously with the blur, everywhere, and ends in zero: nothing jumps when
/// focus or camera move.
TEST_CASE("Continuity")
{
  const TruncatedGaussian gaussian(2.5);
  const Symmetric2 variance{ 100.0, 100.0, 0.0 };
  const Footprint w({ 0, 0, 0 }, variance);
  constexpr int Steps = 20000, Places = 60;
  double last[Places] = {}, largest = 0.0;
  for (int i = 0; i <= Steps; ++i)
  {
    // The blur's share grows up to 0.95: a disc has an edge.
    const ResamplingKernel k = LensKernel(w, 380.0 * i / Steps, gaussian);
    CHECK(ShapeAt(k, gaussian.Support(), gaussian.Support()) < 1e-12);
    for (int place = 0; place < Places; ++place)
    {
      const double x = 0.5 * place, q = k.A * x * x; // px
      const double value =
        q < gaussian.Support() ? k.Peak * ShapeAt(k, q, gaussian.Support()) : 0.0;
      largest = i > 0 ? std::max(largest, std::abs(value - last[place])) : largest;
      last[place] = value;
    }
  }
  const double peak = LensKernel(w, 0.0, gaussian).Peak;
  std::printf("largest change of %d: %.2e of the peak in focus\n", Steps, largest / peak);
  CHECK(largest < 0.002 * peak);
}

/// The share of mass and variance of a Gaussian ended at q = 2c: integrals of e^-t and t e^-t over
/// t = q/2 < c.
TEST_CASE("Truncation")
{
  const TruncatedGaussian paper(2.5);
  CHECK_NEAR(paper.Mass, 0.917915001, 1e-9);
  CHECK_NEAR(paper.Tau, 0.776436275, 1e-9);
  for (double c : { 0.05, 1.0, 2.5, 6.0 })
  {
    constexpr int Steps =
      20000; // midpoint rule: c^3 / (24 Steps^2) times the second derivative (<= 3)
    double mass = 0.0, moment = 0.0;
    for (int i = 0; i < Steps; ++i)
    {
      const double t = c * (i + 0.5) / Steps;
      mass += std::exp(-t) * c / Steps;
      moment += t * std::exp(-t) * c / Steps;
    }
    const double error = 3.0 * c * c * c / (24.0 * Steps * Steps);
    const TruncatedGaussian gaussian(c);
    CHECK_NEAR(gaussian.Mass, mass, error + 1e-14);
    CHECK_NEAR(gaussian.Tau * mass, moment, 2.0 * error + 1e-14);
    CHECK_NEAR(gaussian.Support(), 2.0 * c, 0.0);
  }
}

/// Rounding can make a projected covariance indefinite: the kernel stays positive definite, its box
/// holds the support.
TEST_CASE("Indefinite")
{
  const TruncatedGaussian gaussian(2.5);
  const Symmetric2 variance{ 1.0, 1.0, 0.0 };
  for (double excess : { 1e-7, 1e-3, 0.3 })
  {
    const Symmetric2 projected{ 1e4, 1e2, 1e3 * (1.0 + excess) };
    const ResamplingKernel k = GaussianKernel(Footprint(projected, variance), gaussian);
    CHECK(k.A > 0.0);
    CHECK(k.B > 0.0);
    CHECK(k.Peak > 0.0);
    CHECK_NEAR(Integrate(k, gaussian.Support()).Mass, 1.0, 1e-12);
    CheckBox(k, gaussian.Support());
  }
}
}
