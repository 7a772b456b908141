// SPDX-License-Identifier: BSD-3-Clause
/**
 * Pictures whose pixels are known: circle of confusion, mass of a splat, sums over regular grids,
 * edges in and out of focus, occlusion, a linear texture.
 */
#include "Core/Lens/LayerLeaks.h"
#include "ReferenceKernel.h"
#include "ReferenceSplat.h"
#include "TestScene.h"
#include "Testing/Shared/Check.h"

#include <algorithm>
#include <functional>

using namespace SurfelSplatting;

namespace
{
constexpr double Pi = 3.14159265358979324;

/// Cut-off at which truncation takes e^-20 of the mass: kernels are Gaussians for every purpose
/// here.
constexpr double NoTruncation = 20.0;

class LayerCollector : public LayerSink
{
public:
  explicit LayerCollector(const View& view)
    : Width(view.Width)
    , Count(static_cast<std::size_t>(view.Width) * view.Height, 0)
    , Covered(Count.size(), 0.0)
    , Largest(Count.size(), 0.0)
  {
  }
  void Receive(int x, int y, const VisibleLayer& layer) override
  {
    const std::size_t i = static_cast<std::size_t>(y) * this->Width + x;
    this->Count[i]++;
    this->Covered[i] += layer.Red;
    this->Largest[i] = std::max<double>(this->Largest[i], layer.Red);
  }

  int Width;
  std::vector<int> Count;
  std::vector<double> Covered; ///< weight of white opaque layers that are not full
  std::vector<double> Largest; ///< that of one of them
};

double Confusion(const SplatContext& context, double z)
{
  return context.Camera.Fx * context.Optics.RelativeCircleOfConfusion(z);
}

/// A lens that gives a circle of confusion of radius c px at depth z.
void SetLens(SplatContext& context, double focus, double z, double c)
{
  context.Optics.FocalDistance = focus;
  context.Optics.Radius = c / (context.Camera.Fx * std::abs(1.0 / focus - 1.0 / z));
}

TEST_CASE("Circle of confusion")
{
  const Lens lens{ 0.03, 2.5 };
  for (double z : { 0.01, 0.5, 1.0, 2.4999, 2.5, 2.6, 10.0, 1e6 })
  {
    // A ray through the lens's rim and the point meets the plane in focus at this distance from the
    // ray through the lens's centre; seen from the lens, it is this much of the focal length.
    const double onFocalPlane = lens.Radius * std::abs(1.0 - lens.FocalDistance / z);
    CHECK_NEAR(lens.RelativeCircleOfConfusion(z), onFocalPlane / lens.FocalDistance,
      1e-15 * lens.Radius / z + 1e-16);
  }
  CHECK_NEAR(lens.RelativeCircleOfConfusion(2.5), 0.0, 0.0);
  CHECK_NEAR(lens.RelativeCircleOfConfusion(1e300), 0.03 / 2.5, 1e-17);
  CHECK_NEAR(Lens().RelativeCircleOfConfusion(0.1), 0.0, 0.0); // pinhole
  CHECK_NEAR((Lens{ 0.03, INFINITY }).RelativeCircleOfConfusion(3.0), 0.01, 1e-17);
}

/// 1/z is affine on the picture of a plane, and with it the signed circle of confusion: C = |a x +
/// b y + c|.
TEST_CASE("Confusion of plane")
{
  const Lens lens{ 0.05, 2.0 };
  const double f = 500.0;
  const Vector3 normal{ 0.36, -0.48, 0.8 };
  const auto signedConfusion = [&](double x, double y) {
    const double z = 3.0 / (normal[0] * x / f + normal[1] * y / f + normal[2]); // n.p = 3
    const double c = f * lens.RelativeCircleOfConfusion(z);
    return z < lens.FocalDistance ? -c : c;
  };
  const double c = signedConfusion(0, 0);
  const double a = (signedConfusion(300, 0) - c) / 300.0, b = (signedConfusion(0, 200) - c) / 200.0;
  CHECK(std::abs(a) > 1e-4);
  CHECK(std::abs(b) > 1e-4);
  for (int i = -10; i <= 10; ++i)
  {
    const double x = 37.0 * i, y = 23.0 * i * (i % 2 ? 1 : -1);
    CHECK_NEAR(signedConfusion(x, y), a * x + b * y + c, 1e-11); // C up to 20 px in double
  }
}

/// Squared L2 distance of the kernel as drawn from a uniform disc of radius 1, without the disc's
/// own part: the Gaussian of variance v / tau, ended at q = 2 cutoff and scaled to mass 1.
double DistanceFromDisc(double v, double cutoff)
{
  const TruncatedGaussian gaussian(cutoff);
  const double a = v / gaussian.Tau;
  const double peak = 1.0 / (2.0 * Pi * a * gaussian.Mass);
  const double inDisc = -std::expm1(-std::min(0.5 / a, cutoff)) / gaussian.Mass; // mass inside
  const double square = peak * peak * Pi * a * -std::expm1(-2.0 * cutoff);
  return square - 2.0 * inDisc / Pi;
}

/// Coarse grids are an approximation, see TestCoarseGrid.
SplatContext ExactContext()
{
  SplatContext context = TestContext();
  context.CoarseGrids = false;
  return context;
}

bool IsPearson(const SplatContext& context)
{
  return context.Settings.Kernel == KernelType::PearsonII;
}

/// What the lens adds to W without truncation: C^2 / 4, that of the disc, with Pearson-II kernels.
double LensVariance(const SplatContext& context, double confusion)
{
  return IsPearson(context) ? 0.25 * confusion * confusion
                            : ReferenceLensVariance(confusion, NoTruncation);
}

TEST_CASE("Defocus variance")
{
  // The paper's derivation, exp(-C^2 / 2a) = 1/4, for the Gaussian that is then ended at the
  // cut-off.
  for (double cutoff : { 0.5, 2.5, NoTruncation })
  {
    const TruncatedGaussian gaussian(cutoff);
    const double a = DefocusVariance(KernelType::Gaussian, 1.0, gaussian) / gaussian.Tau;
    CHECK_NEAR(std::exp(-0.5 / a), 0.25, 1e-15);
    CHECK_NEAR(DefocusVariance(KernelType::Gaussian, 7.0, gaussian),
      49.0 * DefocusVariance(KernelType::Gaussian, 1.0, gaussian), 1e-14);
  }
  const double v = DefocusVariance(KernelType::Gaussian, 1.0, TruncatedGaussian(NoTruncation));
  const double best = DistanceFromDisc(v, NoTruncation);
  for (double factor : { 0.9, 0.99, 0.999, 1.001, 1.01, 1.1 })
  {
    CHECK(DistanceFromDisc(factor * v, NoTruncation) > best);
  }
}

/// Weights of a lonely splat sum to the area that it deposits: its projected area, whatever blur
/// and obliqueness.
TEST_CASE("Mass")
{
  Random random(9);
  for (int i = 0; i < 60; ++i)
  {
    SplatContext context = ExactContext();
    context.Camera = PinholeView(128, 128, 200.0);
    context.Settings.Cutoff = NoTruncation;
    TestSurfel s;
    s.Position = { random.Uniform(-0.02, 0.02), random.Uniform(-0.02, 0.02), 2.0 };
    s.Normal = random.Direction();
    s.SigmaU = random.Uniform(0.0, 0.03);
    s.SigmaV = random.Uniform(0.0, 0.03);
    s.TwoSided = true;
    SetLens(context, 1.0, 2.0, i % 2 ? random.Uniform(0.0, 10.0) : 0.0);
    TestCloud cloud;
    cloud.Add(s);
    const Picture picture = RenderPicture(context, cloud);
    double sum = 0.0;
    for (std::size_t p = 0; p < picture.Depth.size(); ++p)
    {
      sum += picture.Color[4 * p]; // white: the weight, while alpha is 1 less what is left of 1
    }
    const double along = std::abs(Dot(s.Normal, s.Position));
    double seen = 0.0; // |A.(p - R u)|, mean over the lens
    const std::vector<ApertureSample> points = ApertureSamples(2000);
    for (const ApertureSample& u : points)
    {
      const double r = IsPearson(context) ? context.Optics.Radius : 0.0;
      seen += std::abs(
        Dot(s.Normal, { s.Position[0] - r * u.X, s.Position[1] - r * u.Y, s.Position[2] }));
    }
    const double deposit = 200.0 * 200.0 * s.Area * seen / 2000.0 / 8.0; // f^2 A.p / z^3
    const double variance = LensVariance(context, Confusion(context, 2.0));
    // Footprint M S M' + (h + V_I) I at the picture's middle, where M is f/z times the unit matrix
    // but for 1 % of z.
    const Vector3& n = s.Normal;
    Vector3 u, v;
    Tangents(n, u, v);
    double w[3] = { 1.0 + variance, 1.0 + variance, 0.0 };
    const Vector3 jx{ 100.0, 0.0, -50.0 * s.Position[0] }, jy{ 0.0, 100.0, -50.0 * s.Position[1] };
    for (const auto& axis : { std::make_pair(u, s.SigmaU), std::make_pair(v, s.SigmaV) })
    {
      const double x = Dot(jx, axis.first) * axis.second, y = Dot(jy, axis.first) * axis.second;
      w[0] += x * x;
      w[1] += y * y;
      w[2] += x * y;
    }
    const double smooth = (1.0 + variance) / std::sqrt(w[0] * w[1] - w[2] * w[2]);
    const double expected = deposit * ReferenceRippleCompensation(smooth, along / Norm(s.Position));
    // Sampling a Gaussian of variance >= 1 px^2 at pixels: 4 exp(-2 pi^2) = 1e-8. Rounding of the
    // centre and of offsets, 3 * 160 px * 2^-24, times the mean slope of log k, <= 1.3 per px and
    // axis: 5e-5. Area and covariance are floats. Kernels for a lens end at an ellipse whatever the
    // cut-off: pixels that it holds, against its area, by Gauss's circle problem, some 1 % for a
    // flat disc of 5 px. In focus they end in zero, but at 2.7 px: 0.0065 measured.
    // Edge-on from a point of the lens: what a fragment's mean point sees stands for the mean of
    // what its points see, 0.14 measured.
    const bool edge = along < context.Optics.Radius * std::hypot(s.Normal[0], s.Normal[1]);
    const double lens = edge ? 0.16 : 0.02;
    CHECK_NEAR(sum / expected, 1.0, !IsPearson(context) ? 5e-5 : i % 2 ? lens : 0.01);
  }
}

/// A square lattice of surfels of alternating steps u and v about a centre.
void AddGrid(TestCloud& cloud, const Vector3& centre, const Vector3& u, const Vector3& v, int nu,
  int nv, const std::function<std::array<float, 4>(int)>& color)
{
  const double spacing = Norm(u);
  const Vector3 n = Cross(u, v);
  TestSurfel s;
  s.Normal = { n[0] / Norm(n), n[1] / Norm(n), n[2] / Norm(n) };
  s.SigmaU = s.SigmaV = 0.5 * spacing;
  s.Area = spacing * Norm(v);
  for (int j = 0; j < nv; ++j)
  {
    for (int i = 0; i < nu; ++i)
    {
      const double a = i - 0.5 * (nu - 1), b = j - 0.5 * (nv - 1);
      for (int k = 0; k < 3; ++k)
      {
        s.Position[k] = centre[k] + a * u[k] + b * v[k];
      }
      s.Color = color(i);
      cloud.Add(s);
    }
  }
}

std::array<float, 4> White(int)
{
  return { { 1, 1, 1, 1 } };
}
std::array<float, 4> Red(int)
{
  return { { 1, 0, 0, 1 } };
}
std::array<float, 4> Green(int)
{
  return { { 0, 1, 0, 1 } };
}

/**
 * Ripple of a lattice of Gaussians (Poisson): the sum over the dual lattice without its origin of
 * exp(-2 pi^2 k' W k), k the frequency. Lattice steps on the screen: (d, 0) and (0, d cos(tilt)); W
 * = diag((d/2)^2 + 1, (d/2 cos)^2 + 1).
 */
double RippleBound(double d, double cosine)
{
  const double wx = 0.25 * d * d + 1.0, wy = 0.25 * d * d * cosine * cosine + 1.0;
  double sum = -1.0;
  for (int i = -4; i <= 4; ++i)
  {
    for (int j = -4; j <= 4; ++j)
    {
      const double kx = i / d, ky = j / (d * cosine);
      sum += std::exp(-2.0 * Pi * Pi * (kx * kx * wx + ky * ky * wy));
    }
  }
  return sum;
}

/// A regular grid on a plane covers it evenly, at any tilt, in one layer or nearly so. Its surfels
/// have half of their area, so that nothing of the sum is cut off.
TEST_CASE("Grid sum")
{
  for (double degrees : { 0.0, 20.0, 45.0, 60.0, 75.0, 85.0, 88.0 })
  {
    const double cosine = std::cos(degrees * Pi / 180.0), sine = std::sin(degrees * Pi / 180.0);
    SplatContext context = ExactContext();
    context.Camera = PinholeView(20, 20, 20.0); // px per world unit
    context.Camera.Parallel = true;
    context.Settings.Cutoff = NoTruncation;
    const double d = 0.2;
    TestCloud cloud;
    AddGrid(
      cloud, { 0.03, 0.01, 100.0 }, { 0, -d * cosine, d * sine }, { -d, 0, 0 }, 401, 31, White);
    for (float& area : cloud.AreaVectors)
    {
      area *= 0.5f;
    }
    LayerCollector sink(context.Camera);
    const Picture picture =
      RenderPicture(context, { cloud.Get() }, SerialExecutor(), nullptr, &sink);
    const double sigma = 20.0 * d / 2.0; // px; the pixel filter's share of the footprint:
    const double smooth =
      1.0 / std::sqrt((1.0 + sigma * sigma) * (1.0 + sigma * sigma * cosine * cosine));
    const double compensation = ReferenceRippleCompensation(smooth, cosine);
    const double ripple = RippleBound(20.0 * d, cosine);
    // The grid's borders are 6.3 standard deviations away from the middle: Gaussian tails below
    // 1e-8. Rounding: as in the test Mass, with 3 * 52 px. The kernel for a lens ends in focus as
    // well, whatever the cut-off, and ripples by up to 0.04 (measured).
    const double ends = IsPearson(context) ? 0.04 : 0.0;
    // Where a kernel is near 0, a splat's layer stays short and may leak before the next
    // one comes: of kernels that end in zero 4e-4 of the weight, and nothing of the usual Gaussian.
    // One that has not been cut off leaks in up to 52 parts, which hide up to 0.0011 of another.
    const double leaks = IsPearson(context) || degrees == 0.0 ? 0.0 : 0.0012;
    context.Settings.Cutoff = 2.5;
    LayerCollector cut(context.Camera);
    RenderPicture(context, { cloud.Get() }, SerialExecutor(), nullptr, &cut);
    for (int y = 9; y <= 10; ++y)
    {
      for (int x = 5; x < 15; ++x)
      {
        CHECK((degrees > 0.0 || sink.Count[y * 20 + x] == 1));
        CHECK((!IsPearson(context) || sink.Largest[y * 20 + x] > 0.999 * sink.Covered[y * 20 + x]));
        CHECK(cut.Count[y * 20 + x] >= 1);
        CHECK(cut.Largest[y * 20 + x] > 0.99 * cut.Covered[y * 20 + x]);
        CHECK_NEAR(
          2.0 * sink.Covered[y * 20 + x] / compensation, 1.0, ripple + ends + leaks + 2e-5);
      }
    }
  }
}

/// Share of a kernel's mass beyond a straight edge at distance x, for an isotropic variance of W.
double EdgeProfile(const SplatContext& context, double x, double variance, double confusion)
{
  if (!IsPearson(context))
  {
    return 0.5 * std::erfc(x / std::sqrt(2.0 * variance));
  }
  const double ratio = variance / (confusion * confusion);
  const ReferenceBlurKernel kernel(48.0 * ratio * ratio - 3.0);
  const double end = std::sqrt(kernel.Reach), begin = x / std::sqrt(variance);
  if (std::abs(begin) >= end)
  {
    return begin < 0.0 ? 1.0 : 0.0;
  }
  // The midpoint rule, in units of the deviation, over what lies beyond x: cells of 1/500 of it.
  constexpr int steps = 1000;
  const double du = (end - begin) / steps, dv = 2.0 * end / steps;
  double beyond = 0.0;
  for (int i = 0; i < steps; ++i)
  {
    for (int j = 0; j < steps; ++j)
    {
      const double u = begin + (i + 0.5) * du, v = -end + (j + 0.5) * dv;
      beyond += kernel.At(u * u + v * v) * du * dv;
    }
  }
  return beyond;
}

/// The edge of a half plane out of focus is that of the kernel, and near that of a disc.
TEST_CASE("Blurred edge")
{
  SplatContext context = ExactContext();
  context.Camera = PinholeView(64, 8, 100.0);
  context.Settings.Cutoff = NoTruncation;
  SetLens(context, 3.0, 1.0, 10.0);
  CHECK_NEAR(Confusion(context, 1.0), 10.0, 1e-12);
  const double lens = LensVariance(context, 10.0);
  const double variance = 1.0 + 0.25 + lens; // h + (d/2)^2 + V_I, d = 1 px
  // 6.4 standard deviations of support: 39 px beyond the picture.
  TestCloud cloud;
  AddGrid(cloud, { -0.37, 0, 1 }, { 0.01, 0, 0 }, { 0, -0.01, 0 }, 74, 90, White);
  const Picture picture = RenderPicture(context, cloud);
  const double compensation = ReferenceRippleCompensation(
    (1.0 + lens) / variance, 1.0); // the cosine is 1 within 0.07, see below
  for (int x = 0; x < 64; ++x)
  {
    const double t = x + 0.5 - 32.0; // the half plane is left of x = 32
    const double sum = compensation * EdgeProfile(context, t, variance, 10.0);
    // Cells of 1 px for an integral: 1/24 of the largest slope of the profile, 0.242 / variance.
    // The compensation varies by 0.2 (1 - smooth) sin^2 of up to 35 degrees over the grid.
    const double tolerance =
      0.242 / variance / 24.0 + 0.2 * (1.0 - (1.0 + lens) / variance) * 0.33 + 1e-6;
    // Kernels for a lens end at an ellipse: of each of its 22 rows one cell is in or out, 0.29 of
    // one of 380 px^2 by root mean square: sqrt(22) 0.29 / 380. At 9.5 px light comes through the
    // border of the lens only, where LargestCover allows 0.01: 0.0077 less than the kernel gives.
    const bool tail = IsPearson(context) && t > 9.0;
    CHECK_NEAR(picture.At(x, 4, 3), std::min(1.0, sum),
      tolerance + (IsPearson(context) ? 3.6e-3 : 0.0) + (tail ? 4e-3 : 0.0));
    // The disc's own edge, 1/2 + (u sqrt(1 - u^2) + asin u) / pi: the Gaussian that is closest in
    // L2 has a quarter of its energy outside of the disc.
    const double u = std::fmin(1.0, std::fmax(-1.0, -t / 10.0));
    const double disc = 0.5 + (u * std::sqrt(1.0 - u * u) + std::asin(u)) / Pi;
    CHECK_NEAR(picture.At(x, 4, 3), disc, IsPearson(context) ? 0.02 : 0.06);
  }
  CHECK_NEAR(picture.DepthAt(2, 4), 1.0, 1e-6);
  CHECK_NEAR(picture.DepthAt(60, 4), 0.0, 0.0); // alpha stays below one half
}

/// A wide plane, so far beyond the picture that its borders are not seen however blurred.
void AddWall(
  TestCloud& cloud, double z, double f, const std::function<std::array<float, 4>(int)>& color)
{
  const double d = z / f; // 1 px
  AddGrid(cloud, { 0, 0, z }, { d, 0, 0 }, { 0, -d, 0 }, 130, 130, color);
}

/// A patch of 12 px by 12 px in the middle.
void AddPatch(TestCloud& cloud, double z, double f)
{
  const double d = 0.5 * z / f;
  AddGrid(cloud, { 0, 0, z }, { d, 0, 0 }, { 0, -d, 0 }, 24, 24, Red);
}

struct OcclusionPictures
{
  Picture Occluder, Background, Both;
};

OcclusionPictures RenderOcclusion(double focus, double confusionZ, double confusion)
{
  SplatContext context = ExactContext();
  context.Camera = PinholeView(64, 64, 100.0);
  SetLens(context, focus, confusionZ, confusion);
  TestCloud occluder, background;
  AddPatch(occluder, 1.0, 100.0);
  AddWall(background, 3.0, 100.0, Green);
  return { RenderPicture(context, occluder), RenderPicture(context, background),
    RenderPicture(context, { occluder.Get(), background.Get() }) };
}

/// Blurred occluder O over a background B in focus: alpha O + (1 - alpha) B.
TEST_CASE("Blurred occluder")
{
  const OcclusionPictures p = RenderOcclusion(3.0, 1.0, 9.0);
  double partial = 0;
  for (int y = 0; y < 64; ++y)
  {
    for (int x = 0; x < 64; ++x)
    {
      const double alpha = p.Occluder.At(x, y, 3);
      partial += alpha > 0.05 && alpha < 0.95 ? 1 : 0;
      CHECK_NEAR(p.Background.At(x, y, 3), 1.0, 1e-6); // the wall covers, or nothing is tested
      // Light layers (GapOfLayer) join the background's, of weight 1.04 at most.
      const double off = alpha < 1.0 / 64.0 ? 0.05 * alpha + 2e-7 : 2e-7;
      CHECK_NEAR(p.Both.At(x, y, 0), alpha, off); // two roundings; so below
      CHECK_NEAR(p.Both.At(x, y, 1), (1.0 - alpha) * p.Background.At(x, y, 1), off);
    }
  }
  CHECK(partial > 300);
}

/**
 * Occluder in focus over a blurred background: its edge is that of the pixel filter, nothing of the
 * background leaks onto it, and beside it the background is blurred as if nothing stood there.
 */
TEST_CASE("No leakage")
{
  const OcclusionPictures p = RenderOcclusion(1.0, 3.0, 9.0);
  // Support of the occluder's splats in focus: sqrt(2 c / tau * (h + (d/2)^2)) = 2.6 px at c = 2.5,
  // d = 0.5 px.
  const double reach = std::sqrt(5.0 / 0.7764 * (1.0 + 0.0625));
  // Fragments of weights w that add up join the opaque layer in front until it has leaked: the sum
  // of w exp(-4 g w / LeakingWeight) with the gap g in bands. These are 9 px of blur in the world,
  // 3 * 9 / 100, and a z-range of less than 0.03. Of those too light to leak over 1/64 of a band
  // there are a hundred at most.
  const double gap = 2.0 / 0.3, joins = LeakingWeight / gap * (1.0 / 4.0 + 100.0 / 64.0);
  int inside = 0, outside = 0;
  for (int y = 0; y < 64; ++y)
  {
    for (int x = 0; x < 64; ++x)
    {
      const double distance = std::max(std::abs(x + 0.5 - 32.0), std::abs(y + 0.5 - 32.0)) - 6.0;
      if (distance < -reach)
      {
        ++inside;
        CHECK_NEAR(p.Both.At(x, y, 1), 0.0, joins);
        CHECK_NEAR(p.Both.At(x, y, 0), 1.0, joins);
      }
      if (distance > reach)
      {
        ++outside;
        CHECK_NEAR(p.Both.At(x, y, 0), 0.0, 0.0);
        CHECK_NEAR(p.Both.At(x, y, 1), p.Background.At(x, y, 1), 0.0);
      }
    }
  }
  CHECK(inside >= 36);
  CHECK(outside > 3000);
}

/// A linear texture on a plane across the view direction stays what it is under any blur. Where the
/// sum of weights passes 1, later surfels find less room: that moves the texture by 0.005 px.
void TestLinearTexture(double confusion, double coverage)
{
  SplatContext context = ExactContext();
  context.Camera = PinholeView(40, 40, 100.0);
  context.Settings.Cutoff = NoTruncation;
  SetLens(context, 1.0, 2.0, confusion);
  TestCloud cloud;
  AddGrid(cloud, { 0, 0, 2.0 }, { 0.02, 0, 0 }, { 0, -0.02, 0 }, 120, 120, [](int i) {
    return std::array<float, 4>{ { static_cast<float>(i) / 120.0f, 1, 1, 1 } };
  });
  for (float& area : cloud.AreaVectors)
  {
    area *= static_cast<float>(coverage);
  }
  const Picture picture = RenderPicture(context, cloud);
  for (int x = 0; x < 40; ++x)
  {
    // Surfel i is at pixel 20 + i - 59.5. One cell of 1 px: ripple of the first moment, 2 pi W
    // exp(-2 pi^2 W) / 120 for W >= 1.25, is 1e-12; rounding as in the test Mass: a displacement
    // of 2e-5 px, and sums of up to 5000 terms, each within 2^-24 of a sum that grows to 1
    // (random signs: 70 of them).
    const double expected = (x + 0.5 - 20.0 + 59.5) / 120.0;
    const double actual = picture.At(x, 20, 0) / static_cast<double>(picture.At(x, 20, 3));
    // The compensation varies with the cosine over the picture, by a slope of d(0.2 cos^2)/dx <=
    // 0.2 * 2 * 0.2 / 100 per px: times the variance, a displacement in px.
    const double variance = 1.25 + LensVariance(context, confusion);
    const double blur = 1.0 - 1.25 / variance;
    const double slope = 0.25 * (1.0 - blur) * 2.0 * 0.2 / 100.0;
    const double room = coverage < 0.7 ? 0.0 : 0.006;
    CHECK_NEAR(actual, expected, (slope * variance + 2e-5 + room) / 120.0 + 70 * 0x1p-24);
  }
}

TEST_CASE("Linear texture")
{
  for (const double confusion : { 0.0, 3.0, 8.0 })
  {
    TestLinearTexture(confusion, 0.5);
    TestLinearTexture(confusion, 1.0);
  }
}
}
