// SPDX-License-Identifier: BSD-3-Clause
/**
 * Gaussians in space against closed forms and integrals along the rays: optical depths and
 * opacities, their order among one another, surfels and other props, colours by harmonics, and
 * what nodes keep.
 */
#include "Core/Lens/GaussianFootprint.h"
#include "TestScene.h"
#include "Testing/Shared/Check.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

using namespace SurfelSplatting;

namespace
{
double Quadratic(const Symmetric3& s, const Vector3& a, const Vector3& b)
{
  return a[0] * (s.XX * b[0] + s.XY * b[1] + s.XZ * b[2]) +
    a[1] * (s.XY * b[0] + s.YY * b[1] + s.YZ * b[2]) +
    a[2] * (s.XZ * b[0] + s.YZ * b[1] + s.ZZ * b[2]);
}

Symmetric3 Inverse(const Symmetric3& s)
{
  const Symmetric3 adjoint{ s.YY * s.ZZ - s.YZ * s.YZ, s.XX * s.ZZ - s.XZ * s.XZ,
    s.XX * s.YY - s.XY * s.XY, s.YZ * s.XZ - s.XY * s.ZZ, s.XY * s.XZ - s.XX * s.YZ,
    s.XY * s.YZ - s.YY * s.XZ };
  const double det = s.XX * adjoint.XX + s.XY * adjoint.XY + s.XZ * adjoint.XZ;
  return Mix(adjoint, 1.0 / det, {}, 0.0);
}

/// L S L'.
Symmetric3 Transformed(const Affine3& m, const Symmetric3& s)
{
  const auto element = [&](int i, int j) { return Quadratic(s, m.L[i], m.L[j]); };
  return { element(0, 0), element(1, 1), element(2, 2), element(0, 1), element(1, 2),
    element(0, 2) };
}

struct Ray
{
  Vector3 Origin, Direction; ///< unit length
};

Ray RayOf(const View& view, int x, int y)
{
  const double a = (x + 0.5 - view.Cx) / view.Fx, b = (y + 0.5 - view.Cy) / view.Fy;
  if (view.Parallel)
  {
    return { { a, b, 0.0 }, { 0.0, 0.0, 1.0 } };
  }
  const double inverse = 1.0 / std::sqrt(a * a + b * b + 1.0);
  return { { 0, 0, 0 }, { a * inverse, b * inverse, inverse } };
}

/// Integral of exp(-d' S^-1 d / 2) along a ray, by the trapezoidal rule, which converges faster
/// than any power for it; and the smallest q = d' S^-1 d on it.
struct RayIntegral
{
  double Sum = 0.0, LeastQ;

  RayIntegral(const Ray& ray, const Vector3& p, const Symmetric3& s)
  {
    const Symmetric3 inverse = Inverse(s);
    const Vector3 o{ ray.Origin[0] - p[0], ray.Origin[1] - p[1], ray.Origin[2] - p[2] };
    const double along = Quadratic(inverse, ray.Direction, ray.Direction);
    const double nearest = -Quadratic(inverse, ray.Direction, o) / along;
    const double step = 0.25 / std::sqrt(along);
    const auto q = [&](double t) {
      const Vector3 d{ o[0] + t * ray.Direction[0], o[1] + t * ray.Direction[1],
        o[2] + t * ray.Direction[2] };
      return Quadratic(inverse, d, d);
    };
    this->LeastQ = q(nearest);
    for (int i = -40; i <= 40; ++i)
    {
      this->Sum += step * std::exp(-0.5 * q(nearest + i * step));
    }
  }
};

/// A narrow field, where a perspective footprint is the Gaussian's image: supports of 4e-4 of the
/// distance change q by as much. Large in px, so that the prefilter of 0.3 px^2 changes nothing.
constexpr double Distance = 10.0, Focal = 1e6, Deviation = 1e-3;

TestCloud OneVolume(const Vector3& p, const Symmetric3& s, double depth)
{
  TestCloud cloud;
  cloud.Kind = CloudKind::Volume;
  cloud.Add(TestGaussian{ p, s, static_cast<float>(depth / Deviation), { { 1, 1, 1, 1 } } });
  return cloud;
}

/**
 * The picture's optical depths against the integrals.
 * @param s in world space
 * @return pixels that were compared
 */
int CompareDepths(const SplatContext& context, const TestCloud& cloud, const Symmetric3& s)
{
  const View& view = context.Camera;
  const Picture picture = RenderPicture(context, cloud);
  const Vector3 p =
    cloud.LocalToWorld.Apply({ cloud.Positions[0], cloud.Positions[1], cloud.Positions[2] });
  int compared = 0;
  for (int y = 0; y < view.Height; y += 3)
  {
    for (int x = 0; x < view.Width; x += 3)
    {
      const RayIntegral integral(RayOf(view, x, y), p, s);
      const double expected = cloud.Densities[0] * integral.Sum;
      const double actual = -std::log1p(-static_cast<double>(picture.At(x, y, 3)));
      // What lies beyond the support, 1e-4 at most, is added inside; 3e-5 and 1e-4 of the depth for
      // prefilter and perspective. Beyond the support, less than 1e-4 is missing.
      CHECK_NEAR(actual, expected, 1.1e-4 + 2e-4 * expected);
      compared += expected > 0.01 ? 1 : 0;
      CHECK_NEAR(picture.At(x, y, 0), picture.At(x, y, 3), 1e-6); // white
    }
  }
  return compared;
}

SplatContext NarrowContext()
{
  SplatContext context = TestContext();
  context.Camera = PinholeView(400, 380, Focal);
  return context;
}

TEST_CASE("Optical depth")
{
  Random random(2);
  for (int i = 0; i < 6; ++i)
  {
    const Symmetric3 s = RandomCovariance(
      { Deviation, Deviation * random.Uniform(0.5, 1.0), Deviation * random.Uniform(0.3, 2.0) },
      random);
    const Vector3 p{ random.Uniform(-1e-3, 1e-3), random.Uniform(-1e-3, 1e-3), Distance };
    CHECK(CompareDepths(NarrowContext(), OneVolume(p, s, random.Uniform(0.05, 1.0)), s) > 1000);
  }
}

/// 40 degrees off the axis, the ray is 1 / cos 40 times as long as its z.
TEST_CASE("Optical depth off the axis")
{
  SplatContext context = NarrowContext();
  const double tangent = std::tan(40.0 * Pi / 180.0);
  context.Camera.Cx -= Focal * tangent;
  const double variance = Deviation * Deviation;
  const Symmetric3 s{ variance, variance, variance, 0, 0, 0 };
  CHECK(CompareDepths(context, OneVolume({ tangent * Distance, 0, Distance }, s, 0.4), s) > 1000);
}

TEST_CASE("Optical depth in a parallel projection, and of a stretched actor")
{
  Random random(3);
  const Symmetric3 s = RandomCovariance({ Deviation, 0.6 * Deviation, 1.7 * Deviation }, random);
  SplatContext parallel = NarrowContext();
  parallel.Camera.Parallel = true;
  parallel.Camera.Fx = parallel.Camera.Fy = Focal / Distance;
  CHECK(CompareDepths(parallel, OneVolume({ 1e-4, 2e-4, 3.0 }, s, 0.5), s) > 1000);
  for (const double mirror : { 1.0, -1.0 })
  {
    TestCloud cloud = OneVolume({ 1e-4, -2e-4, 0.0 }, s, 0.5);
    cloud.LocalToWorld.L = { { { 0.0, -1.3, 0.2 }, { 0.7, 0.1, 0.0 }, { 0.0, 0.3, mirror } } };
    cloud.LocalToWorld.T = { 0.0, 0.0, Distance };
    CHECK(CompareDepths(NarrowContext(), cloud, Transformed(cloud.LocalToWorld, s)) > 1000);
  }
}

/// o exp(-q/2), W = J S J' + 0.3, for all sizes in px; o < 1 as the raster holds it below 0.99.
TEST_CASE("Opacity of captures")
{
  Random random(4);
  for (int i = 0; i < 40; ++i)
  {
    SplatContext context = TestContext();
    View& view = context.Camera = PinholeView(64, 60, 80.0);
    view.Fy = 85.0;
    const double size = std::pow(10.0, random.Uniform(-3.0, -0.7));
    const Symmetric3 s = RandomCovariance({ size, size * random(), size * random() }, random);
    const Vector3 p{ random.Uniform(-0.6, 0.6), random.Uniform(-0.6, 0.6), 2.0 };
    const float opacity = static_cast<float>(random.Uniform(0.0, 1.2));
    TestCloud cloud;
    cloud.Kind = CloudKind::Capture;
    cloud.Add(TestGaussian{ p, s, opacity, { { 0.5f, 1, 1, 1 } } });
    const Picture picture = RenderPicture(context, cloud);
    const Vector3 jx{ view.Fx / p[2], 0.0, -view.Fx * p[0] / (p[2] * p[2]) };
    const Vector3 jy{ 0.0, view.Fy / p[2], -view.Fy * p[1] / (p[2] * p[2]) };
    const double xx = Quadratic(s, jx, jx) + 0.3, yy = Quadratic(s, jy, jy) + 0.3;
    const double xy = Quadratic(s, jx, jy), det = xx * yy - xy * xy;
    for (int k = 0; k < 64 * 60; ++k)
    {
      const double dx = k % 64 + 0.5 - view.Cx - view.Fx * p[0] / p[2];
      const double dy = k / 64 + 0.5 - view.Cy - view.Fy * p[1] / p[2];
      const double q = (yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy) / det;
      const double alpha = std::min<double>(MaxOpacity, opacity * std::exp(-0.5 * q));
      const float actual = picture.At(k % 64, k / 64, 3);
      if (q < LeastGaussianReach - 1e-4)
      {
        CHECK_NEAR(actual, alpha, 1e-5); // float covariances, and q in floats
        CHECK_NEAR(picture.At(k % 64, k / 64, 0), 0.5 * actual, 1e-6);
      }
      else if (q > LargestGaussianReach + 1e-4)
      {
        CHECK(actual == 0.0f);
      }
    }
  }
}

constexpr double Spacing = 0.02;
constexpr int Across = 48, Layers = 10;

/// A slab of voxels with the optical depth `depth`, seen against its layers.
TestCloud Slab(double depth)
{
  TestCloud cloud;
  cloud.Kind = CloudKind::Volume;
  const double sigma = 0.7 * Spacing, perVolume = std::pow(2.0 * Pi, 1.5) * 0.7 * 0.7 * 0.7;
  const double extinction = depth / (Layers * Spacing) / perVolume;
  TestGaussian g;
  g.Covariance = { sigma * sigma, sigma * sigma, sigma * sigma, 0, 0, 0 };
  g.Density = static_cast<float>(extinction);
  for (int i = 0; i < Across * Across * Layers; ++i)
  {
    const int x = i % Across, y = i / Across % Across, z = i / (Across * Across);
    g.Position = { (x - 0.5 * (Across - 1)) * Spacing, (y - 0.5 * (Across - 1)) * Spacing,
      z * Spacing };
    cloud.Add(g);
  }
  cloud.LocalToWorld.T = { 0.0, 0.0, 20.0 };
  return cloud;
}

/// Mean and largest distance of the middle's alphas from what they should be.
void CheckMiddle(
  const Picture& picture, double alpha, double mean, double largest, const char* what)
{
  double sum = 0.0, worst = 0.0;
  int count = 0;
  for (int y = picture.Height / 3; y < picture.Height * 2 / 3; ++y)
  {
    for (int x = picture.Width / 3; x < picture.Width * 2 / 3; ++x)
    {
      const double off = picture.At(x, y, 3) - alpha;
      sum += off;
      worst = std::max(worst, std::abs(off));
      ++count;
    }
  }
  std::printf("slab, %s: alpha off by %.5f in the mean, %.5f at most\n", what, sum / count, worst);
  CHECK_NEAR(sum / count, 0.0, mean);
  CHECK(worst <= largest);
}

/// Voxels of a homogeneous medium: exp(-t) shines through, whatever lens and nodes.
TEST_CASE("Homogeneous slab")
{
  constexpr double depth = 1.3;
  const double alpha = -std::expm1(-depth);
  const TestCloud cloud = Slab(depth);
  const TestHierarchy hierarchy(cloud);
  for (const double pixelsPerSpacing : { 0.4, 1.0, 4.0 })
  {
    SplatContext context = TestContext();
    const int size = std::max(24, static_cast<int>(Across * pixelsPerSpacing) / 2);
    context.Camera = PinholeView(size, size, pixelsPerSpacing * 20.1 / Spacing);
    // The sum of the Gaussians ripples by 2 exp(-2 pi^2 0.7^2) = 1.3e-4 of t along each axis. Where
    // the voxels are as far apart as the pixels, all of them have or lack the same four pixels at
    // their ends, of 1e-4 in each layer: 1e-3 of alpha.
    CheckMiddle(RenderPicture(context, cloud), alpha, 1e-3, 1e-3, "leaves");
    // A cube of eight voxels is no longer than a pair: the first nodes are cubes, 4.6e-3 off where
    // a voxel has 0.4 px (pairs: 2.2e-3).
    CheckMiddle(RenderPicture(context, { hierarchy.Get() }), alpha, 1e-3, 5e-3, "nodes");
    context.Optics.FocalDistance = 15.0;
    context.Optics.Radius = 4.0 / context.Camera.Fx / (1.0 / 15.0 - 1.0 / 20.1); // C = 4 px
    // Neighbours of a Gaussian leave moments of T that hide a little more of it: measured, 2e-3 by
    // first moments, up to 3e-3 less by second ones. Nodes are fewer and hide more each.
    CheckMiddle(RenderPicture(context, cloud), alpha, 3.5e-3, 3.5e-3, "leaves, lens");
    CheckMiddle(RenderPicture(context, { hierarchy.Get() }), alpha, 0.025, 0.035, "nodes, lens");
    context.Cut.Error = 0.5;
    CheckMiddle(RenderPicture(context, { hierarchy.Get() }), alpha, 7e-3, 1e-2, "nodes of 1/2");
  }
}

TestGaussian BlobAt(double z, float opacity, const std::array<float, 4>& color)
{
  const double variance = 0.04 * z * z;
  return { { 0, 0, z }, { variance, variance, 1e-6, 0, 0, 0 }, opacity, color };
}

constexpr std::array<float, 4> Red{ { 1, 0, 0, 1 } }, Green{ { 0, 1, 0, 1 } };

/// The nearer one hides the other, wherever they are stored.
TEST_CASE("Order of Gaussians")
{
  for (const bool redInFront : { true, false })
  {
    const TestGaussian red = BlobAt(redInFront ? 1.0 : 3.0, 0.7f, Red);
    const TestGaussian green = BlobAt(2.0, 0.4f, Green);
    TestCloud one, other;
    one.Kind = other.Kind = CloudKind::Capture;
    one.Add(red);
    one.Add(green);
    other.Add(green);
    other.Add(red);
    SplatContext context = TestContext();
    context.Camera = PinholeView(50, 50, 80.0);
    const Picture picture = RenderPicture(context, one);
    CHECK(Same(picture, RenderPicture(context, other)));
    const double near = redInFront ? 0.7 : 0.4, far = redInFront ? 0.4 : 0.7;
    // The centre is at the corner of four pixels: 0.5 px^2 of 256.
    const double k = std::exp(-0.5 * 0.5 / (0.04 * 80.0 * 80.0 + 0.3));
    CHECK_NEAR(picture.At(25, 25, redInFront ? 0 : 1), near * k, 1e-5);
    CHECK_NEAR(picture.At(25, 25, redInFront ? 1 : 0), (1.0 - near * k) * far * k, 1e-5);
    CHECK(picture.DepthAt(25, 25) == (redInFront ? 1.0f : 3.0f)); // where T passes 1/2
  }
}

/// A white sheet at z = 2.
TestCloud Sheet(float opacity)
{
  TestCloud cloud;
  for (int i = 0; i < 80 * 80; ++i)
  {
    TestSurfel s = SquareSurfel({ (i % 80 - 39.5) * 0.02, (i / 80 - 39.5) * 0.02, 2.0 }, 0.02);
    s.Color = { { 0, 0, 1, 1 } };
    s.Opacity = opacity;
    cloud.Add(s);
  }
  return cloud;
}

/// Before and behind a sheet: each over the other. In its plane: before or behind it.
TEST_CASE("Gaussian and surfels")
{
  for (const float opacity : { 1.0f, 0.6f })
  {
    const TestCloud sheet = Sheet(opacity);
    for (const double radius : { 0.0, 0.05 })
    {
      SplatContext context = TestContext();
      context.Camera = PinholeView(60, 60, 100.0);
      context.Optics = { radius, 1.5 };
      const Picture alone = RenderPicture(context, sheet);
      for (const double z : { 1.8, 2.0, 2.2 })
      {
        TestCloud blob;
        blob.Kind = CloudKind::Capture;
        blob.Add(BlobAt(z, 0.7f, Red));
        const Picture both = RenderPicture(context, { sheet.Get(), blob.Get() });
        const Picture single = RenderPicture(context, blob);
        double worst = 0.0;
        for (std::size_t i = 0; i < both.Depth.size(); ++i)
        {
          const double a = single.Color[4 * i + 3], s = alone.Color[4 * i + 3];
          const double red = both.Color[4 * i], blue = both.Color[4 * i + 2];
          CHECK_NEAR(both.Color[4 * i + 3], red + blue, 2e-6);
          const double front = std::abs(red - a) + std::abs(blue - (1.0 - a) * s);
          const double back = std::abs(red - (1.0 - s) * a) + std::abs(blue - s);
          worst = std::max(worst, z < 2.0 ? front : z > 2.0 ? back : std::min(front, back));
        }
        std::printf(
          "sheet of %.1f, lens %.2f, Gaussian at %.1f: off by %.1e\n", opacity, radius, z, worst);
        // In focus, sums of floats. Through the lens, the moments of a homogeneous sheet are 0 but
        // for its ripple.
        CHECK(worst <= (radius > 0.0 ? 4e-3 : 4e-6));
      }
    }
  }
}

TEST_CASE("Other props")
{
  TestCloud blob;
  blob.Kind = CloudKind::Volume;
  blob.Add(BlobAt(2.0, 200.0f, Red));
  const TestHierarchy hierarchy(blob);
  for (const double radius : { 0.0, 0.05, 0.4 })
  {
    SplatContext context = TestContext();
    context.Camera = PinholeView(60, 60, 100.0);
    context.Optics = { radius, 1.0 };
    std::vector<float> limit(60 * 60);
    for (std::size_t i = 0; i < limit.size(); ++i)
    {
      limit[i] = i % 60 < 27 ? 1.9f : 2.1f;
    }
    context.GaussianRuns = context.CoarseGrids = false;
    const Picture whole = RenderPicture(context, { hierarchy.Get() });
    context.GaussianRuns = context.CoarseGrids = true;
    const Picture part =
      RenderPicture(context, { hierarchy.Get() }, SerialExecutor(), limit.data());
    for (std::size_t i = 0; i < limit.size(); ++i)
    {
      const double expected = limit[i] < 2.0f ? 0.0 : whole.Color[4 * i + 3];
      // At the centres of cells, too much by d^2 / 6 over W: 2.2 % of 8 px at a deviation of 22 px.
      CHECK_NEAR(part.Color[4 * i + 3], expected, 0.025 * expected);
    }
  }
}

/// Coefficients of 16 harmonics, those above the first up to 0.3.
std::vector<float> RandomHarmonics(Random& random, float constant)
{
  std::vector<float> c(48);
  for (std::size_t i = 0; i < c.size(); ++i)
  {
    c[i] = i < 3 ? constant : static_cast<float>(random.Uniform(-0.3, 0.3));
  }
  return c;
}

/// Colours for the direction from the lens to the centre, in the cloud's own coordinates.
TEST_CASE("Harmonics")
{
  Random random(5);
  for (int i = 0; i < 30; ++i)
  {
    const bool dark = i % 5 == 0;
    TestCloud cloud;
    cloud.Kind = CloudKind::Capture;
    cloud.NumberOfHarmonics = 16;
    cloud.Harmonics = RandomHarmonics(random, dark ? -6.0f : 2.0f);
    const Vector3 center = random.Direction();
    cloud.Add(TestGaussian{ center, { 0.1, 0.1, 0.1, 0, 0, 0 }, 0.8f, { { 1, 1, 1, 1 } } });
    Affine3& m = cloud.LocalToWorld;
    Tangents(m.L[0] = random.Direction(), m.L[1], m.L[2]);
    for (int k = 0; k < 9; ++k)
    {
      m.L[k / 3][k % 3] *= i % 2 == 0 ? 0.4 * (1 + k % 3) : -0.7; // stretched, or mirrored
    }
    m.T = { 0.2, -0.3, 4.0 };
    SplatContext context = TestContext();
    context.Camera = PinholeView(120, 120, 90.0);
    const TestHierarchy packed(cloud);
    const Picture picture = RenderPicture(context, { packed.Get() });
    // The lens in the cloud's coordinates: L x + T = 0.
    const double det = m.Determinant();
    const std::array<Vector3, 3> cofactors = m.AreaMatrix(); // |det| L^-T
    Vector3 d = center;
    for (int k = 0; k < 3; ++k)
    {
      for (int j = 0; j < 3; ++j)
      {
        d[k] += cofactors[j][k] / std::abs(det) * m.T[j];
      }
    }
    const double length = Norm(d);
    double basis[MaxHarmonics];
    EvaluateHarmonics<double>({ d[0] / length, d[1] / length, d[2] / length }, 16, basis);
    const Vector3 p = m.Apply(center);
    const int x = static_cast<int>(90.0 * p[0] / p[2] + 60.0);
    const int y = static_cast<int>(90.0 * p[1] / p[2] + 60.0);
    REQUIRE(picture.At(x, y, 3) > 0.5f);
    for (int c = 0; c < 3; ++c)
    {
      double sum = 0.5, sizes = 0.0;
      for (int k = 0; k < 16; ++k)
      {
        sum += basis[k] * cloud.Harmonics[3 * k + c];
        sizes += k > 0 ? std::abs(basis[k]) : 0.0;
      }
      // Bytes: each coefficient is off by up to 0.3 / 254.
      CHECK_NEAR(picture.At(x, y, c) / picture.At(x, y, 3), dark ? 0.0 : std::max(0.0, sum),
        sizes * 0.3 / 254.0 + 1e-5);
    }
  }
}

/// Mass of a Gaussian by its covariance's inverse, per unit of density.
double MassOf(CloudKind kind, const Symmetric3& s)
{
  const Symmetric3 inverse = Inverse(s);
  const double determinant = s.XX * (s.YY * s.ZZ - s.YZ * s.YZ) -
    s.XY * (s.XY * s.ZZ - s.YZ * s.XZ) + s.XZ * (s.XY * s.YZ - s.YY * s.XZ);
  return kind == CloudKind::Volume ? std::pow(2.0 * Pi, 1.5) * std::sqrt(determinant)
                                   : std::sqrt(determinant * inverse.Trace()); // tr adj S
}

TEST_CASE("Optical depth of opacities")
{
  for (const double opacity : { 1e-3, 0.1, 0.3, 0.5, 0.7, 0.8, 0.9, 0.95, 0.98, 0.99, 1.0 })
  {
    double dilogarithm = 0.0; // its series is off by 1/n
    for (int n = 20000; n >= 1; --n)
    {
      dilogarithm += std::pow(opacity, n) / (static_cast<double>(n) * n);
    }
    CHECK_NEAR(DepthOverOpacity<double>(opacity), dilogarithm / opacity, 0.003);
  }
}

/// The prefilter dilates each leaf: nodes of leaves smaller than a pixel hide what they do.
TEST_CASE("Leaves smaller than a pixel")
{
  constexpr int Across = 256;
  constexpr double spacing = 0.5, deviation = 0.15, opacity = 0.1, focal = 500.0, z = 20.0;
  const double pixel = z / focal, variance = deviation * pixel * deviation * pixel;
  TestCloud cloud;
  cloud.Kind = CloudKind::Capture;
  TestGaussian g;
  g.Covariance = { variance, variance, variance, 0, 0, 0 };
  g.Density = static_cast<float>(opacity);
  for (int i = 0; i < Across * Across; ++i)
  {
    g.Position = { (i % Across - 0.5 * Across) * spacing * pixel,
      (i / Across - 0.5 * Across) * spacing * pixel, z };
    cloud.Add(g);
  }
  TestHierarchy hierarchy(cloud);
  SplatContext context = TestContext();
  context.Camera = PinholeView(96, 96, focal);
  const double area = 2.0 * Pi * (deviation * deviation + SpacePrefilter) / (spacing * spacing);
  const double alpha = -std::expm1(-area * opacity * DepthOverOpacity<double>(opacity));
  // 1e-3 of each of 4 layers is beyond the footprints' ends.
  CheckMiddle(RenderPicture(context, cloud), alpha, 5e-3, 8e-3, "small leaves");
  // Leaves of a node twice as long as wide are taken for such ones: 2 % more. Nodes ripple.
  CheckMiddle(RenderPicture(context, { hierarchy.Get() }), alpha, 0.015, 0.025, "their nodes");
  for (HierarchyNode& node : hierarchy.Nodes)
  {
    node.Normal[0] = 0; // as earlier versions stored them: taken to be as large as their leaves
  }
  const float older = RenderPicture(context, { hierarchy.Get() }).At(48, 48, 3);
  CHECK(older > 0.0f);
  CHECK(older < 0.75 * alpha);
}

/// Nodes have the masses of their Gaussians, and the mean coefficients.
TEST_CASE("Nodes")
{
  for (const CloudKind kind : { CloudKind::Capture, CloudKind::Volume })
  {
    Random random(6);
    TestCloud cloud;
    cloud.Kind = kind;
    cloud.NumberOfHarmonics = 16;
    double mass = 0.0, weights = 0.0, sums[48] = {};
    for (std::size_t i = 0; i < 300; ++i)
    {
      TestGaussian g;
      g.Position = { random(), random(), random() };
      g.Covariance = RandomCovariance({ 0.3 * random(), 0.3 * random(), 0.2 }, random);
      g.Density = static_cast<float>(random());
      g.Color[3] = static_cast<float>(random.Uniform(0.2, 1.0));
      cloud.Add(g);
      const std::vector<float> own = RandomHarmonics(random, static_cast<float>(random()));
      cloud.Harmonics.insert(cloud.Harmonics.end(), own.begin(), own.end());
      const double depth = kind == CloudKind::Capture ? DepthOverOpacity<double>(g.Density) : 1.0;
      const double ownMass = depth * g.Density * MassOf(kind, cloud.Get().Covariance(i));
      mass += ownMass;
      weights += ownMass * g.Color[3];
      for (int k = 0; k < 48; ++k)
      {
        sums[k] += ownMass * g.Color[3] * own[static_cast<std::size_t>(k)];
      }
    }
    const TestHierarchy hierarchy(cloud);
    const std::size_t root = hierarchy.NumberOfNodes() - 1;
    CHECK_NEAR(hierarchy.Get().Area(root), mass, 1e-6 * mass); // a float
    const PackedHarmonics& packed = hierarchy.Harmonics[root];
    double largest = 0.0;
    for (int k = 3; k < 48; ++k)
    {
      largest = std::max(largest, std::abs(sums[k] / weights));
    }
    for (int k = 0; k < 48; ++k)
    {
      const double actual = k < 3 ? packed.Constant[k] : packed.Unit * packed.Rest[k % 3][k / 3];
      // Floats on nine levels; bytes.
      CHECK_NEAR(actual, sums[k] / weights, (k < 3 ? 0.0 : 1.0001 * largest / 254.0) + 1e-6);
    }
  }
}
}
