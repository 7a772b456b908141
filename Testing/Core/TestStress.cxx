// SPDX-License-Identifier: BSD-3-Clause
/**
 * Input that nobody should send but somebody will: no crash, no NaN, no negative pixel, alpha in
 * [0, 1], bounded time. Most useful under -DSURFELSPLATTING_SANITIZE=address,undefined.
 */
#include "TestScene.h"
#include "Testing/Shared/Check.h"

#include <algorithm>
#include <limits>

using namespace SurfelSplatting;

namespace
{
constexpr float Infinity = std::numeric_limits<float>::infinity();
constexpr float NotANumber = std::numeric_limits<float>::quiet_NaN();

const float OddValues[] = { NotANumber, Infinity, -Infinity, 1e-45f, -1e-45f, 1e-38f, 3.4e38f,
  -3.4e38f, 1e20f, -1e20f, 0.0f, -0.0f, -1.0f };

SplatContext MakeContext(int width = 40, int height = 36)
{
  SplatContext context = TestContext();
  context.Camera = PinholeView(width, height, 40.0);
  context.Optics = { 0.05, 2.0 };
  return context;
}

TestSurfel BigSurfel(double z)
{
  TestSurfel s;
  s.Position = { 0, 0, z };
  s.SigmaU = s.SigmaV = 0.2;
  s.Area = 0.3;
  return s;
}

/// Every field of one surfel takes every odd value, between two good surfels.
TEST_CASE("Odd fields")
{
  enum Field
  {
    Position = 0,
    Covariance = 3,
    AreaVector = 9,
    Color = 12,
    Opacity = 16,
    End = 17
  };
  for (int field = 0; field < End; ++field)
  {
    for (float value : OddValues)
    {
      TestCloud cloud;
      cloud.Add(BigSurfel(1.0));
      cloud.Add(BigSurfel(2.0));
      cloud.Add(BigSurfel(3.0));
      if (field < Covariance)
      {
        cloud.Positions[3 + field] = value;
      }
      else if (field < AreaVector)
      {
        cloud.Covariances[6 + field - Covariance] = value;
      }
      else if (field < Color)
      {
        cloud.AreaVectors[3 + field - AreaVector] = value;
      }
      else if (field < Opacity)
      {
        cloud.Colors[4 + field - Color] = value;
      }
      else
      {
        cloud.Opacities[1] = value;
      }
      Splatter splatter;
      Picture picture(40, 36);
      splatter.Render(MakeContext(), { cloud.Get() }, SerialExecutor(), picture.Get());
      CHECK(IsSane(picture));
      // The data contract: not drawn, and counted. The near surfel is in front of everything else
      // and unharmed.
      CHECK((std::isfinite(value) || splatter.Statistics().InvalidSurfels == 1));
      CHECK(splatter.Statistics().Splats >= 2);
    }
  }
}

/// A surfel with a NaN opacity must not dim its neighbours by its weight.
TEST_CASE("Invalid leaves no trace")
{
  TestCloud valid, invalid;
  valid.Add(BigSurfel(1.0));
  invalid.Add(BigSurfel(1.0));
  invalid.Add(BigSurfel(1.0));
  invalid.Opacities[1] = NotANumber;
  const Picture a = RenderPicture(MakeContext(), valid), b = RenderPicture(MakeContext(), invalid);
  CHECK(std::equal(a.Color.begin(), a.Color.end(), b.Color.begin()));
}

TEST_CASE("Sizes")
{
  for (double radius = 1e-12; radius < 2e12; radius *= 100.0)
  {
    for (double area : { 0.0, 1e-30, 1e-12, 1.0, radius * radius, 1e12, 1e30 })
    {
      TestCloud cloud;
      TestSurfel s = BigSurfel(2.0);
      s.SigmaU = s.SigmaV = radius;
      s.Area = area;
      cloud.Add(s);
      s.SigmaV = 0.0;
      s.Normal = { 0.6, 0.0, -0.8 };
      cloud.Add(s);
      cloud.Add(BigSurfel(3.0));
      const Picture picture = RenderPicture(MakeContext(), cloud);
      CHECK(IsSane(picture));
      CHECK(SumOfAlpha(picture) > 0.0);
    }
  }
}

TEST_CASE("Transforms")
{
  TestCloud cloud;
  cloud.Add(BigSurfel(2.0));
  const double values[] = { 0.0, 1e-200, 1e-30, 1e30, 1e200, INFINITY, NAN };
  for (double value : values)
  {
    for (int i = 0; i < 12; ++i)
    {
      cloud.LocalToWorld = Affine3();
      (i < 9 ? cloud.LocalToWorld.L[i / 3][i % 3] : cloud.LocalToWorld.T[i - 9]) = value;
      CHECK(IsSane(RenderPicture(MakeContext(), cloud)));
    }
    cloud.LocalToWorld.L = { { { value, 0, 0 }, { 0, value, 0 }, { 0, 0, value } } };
    CHECK(IsSane(RenderPicture(MakeContext(), cloud)));
  }
  // Flattened along the view direction: still a surface, and seen.
  cloud.LocalToWorld = Affine3();
  cloud.LocalToWorld.L[2][2] = 0.0;
  cloud.LocalToWorld.T[2] = 2.0;
  const Picture flat = RenderPicture(MakeContext(), cloud);
  CHECK(IsSane(flat));
  CHECK(SumOfAlpha(flat) > 1.0);
}

TEST_CASE("Lens")
{
  TestCloud cloud;
  cloud.Add(BigSurfel(1.0));
  cloud.Add(BigSurfel(5.0));
  for (double confusion = 1e-6; confusion < 2e6; confusion *= 10.0)
  {
    SplatContext context = MakeContext();
    context.Optics.FocalDistance = 2.0;
    context.Optics.Radius = confusion / (40.0 * 0.5); // C = f R |1/2 - 1/1|
    CHECK(IsSane(RenderPicture(context, cloud)));
  }
  for (double focus : { 1e-300, 1e-9, 1e9, 1e300, static_cast<double>(INFINITY) })
  {
    SplatContext context = MakeContext();
    context.Optics.FocalDistance = focus;
    CHECK(IsSane(RenderPicture(context, cloud)));
    context.Optics.Radius = 1e200;
    CHECK(IsSane(RenderPicture(context, cloud)));
  }
}

/// At, behind and just before the lens, with near planes that let everything through.
TEST_CASE("Near lens")
{
  for (double near : { -1e300, 0.0, 1e-300, 1e-3 })
  {
    for (double z : { -1.0, -0.0, 0.0, 1e-320, 1e-300, 1e-150, 1e-40, 1e-20, 1e-10, 1e-5, 1e-2 })
    {
      for (bool parallel : { false, true })
      {
        TestCloud cloud;
        TestSurfel s = BigSurfel(z);
        s.Position[0] = 1e-3;
        s.Normal = { 0.6, 0.0, -0.8 };
        cloud.Add(s);
        s.Position = { 0, 0, z };
        s.Normal = { 1, 0, 0 };
        s.TwoSided = true;
        cloud.Add(s);
        SplatContext context = MakeContext();
        context.Camera.Near = near;
        context.Camera.Parallel = parallel;
        CHECK(IsSane(RenderPicture(context, cloud)));
      }
    }
  }
}

TEST_CASE("View angles")
{
  TestCloud cloud;
  for (double x : { 0.0, 0.01, 1.0, -3.0 })
  {
    TestSurfel s = BigSurfel(2.0);
    s.Position[0] = x;
    cloud.Add(s);
  }
  for (double f = 1e-30; f < 1e31; f *= 1e3)
  {
    for (bool parallel : { false, true })
    {
      SplatContext context = MakeContext();
      context.Camera.Parallel = parallel;
      context.Camera.Fx = context.Camera.Fy = f;
      CHECK(IsSane(RenderPicture(context, cloud)));
      context.Camera.Fy = 1.0 / f;
      CHECK(IsSane(RenderPicture(context, cloud)));
    }
  }
}

/// Coordinates of a map projection: the picture is the same as near the origin, since T is
/// subtracted in double.
TEST_CASE("Far from origin")
{
  TestCloud near, far;
  for (int i = 0; i < 20; ++i)
  {
    TestSurfel s = BigSurfel(2.0 + 0.1 * i);
    s.Position[0] = 0.125 * (i - 10);
    near.Add(s);
    far.Add(s);
  }
  SplatContext context = MakeContext();
  const Picture expected = RenderPicture(context, near);
  far.LocalToWorld.T = { 1e7, -2e7, 3e7 };
  context.Camera.WorldToCamera.T = { -1e7, 2e7, -3e7 };
  const Picture picture = RenderPicture(context, far);
  CHECK(std::equal(expected.Color.begin(), expected.Color.end(), picture.Color.begin()));

  // The same coordinates in the points themselves: 3e7 * 2^-52 = 7e-9 world units, 1.3e-7 px at z =
  // 2 and f = 40.
  for (std::size_t i = 0; i < far.Positions.size(); ++i)
  {
    far.Positions[i] += far.LocalToWorld.T[i % 3];
  }
  far.LocalToWorld = Affine3();
  const Picture moved = RenderPicture(context, far);
  for (std::size_t i = 0; i < moved.Color.size(); ++i)
  {
    CHECK_NEAR(moved.Color[i], expected.Color[i], 1e-6);
  }
}

/// Float depths at 1e7 are whole numbers: rounding may join surfaces, never tear one apart.
TEST_CASE("Far away")
{
  TestCloud cloud;
  for (int i = -10; i <= 10; ++i)
  {
    TestSurfel s = BigSurfel(1e7 + 0.1 * i);
    s.Position[0] = 0.25 * i;
    s.Normal = { 0.3713906763541037, 0.0, -0.9284766908852594 };
    cloud.Add(s);
  }
  SplatContext context = MakeContext();
  context.Camera.Fx = context.Camera.Fy = 40.0 * 5e6;
  context.Optics.Radius = 0.0;
  class Sink : public LayerSink
  {
  public:
    float Sum[40 * 36] = {}, Largest[40 * 36] = {};
    void Receive(int x, int y, const VisibleLayer& layer) override
    {
      float& largest = this->Largest[y * 40 + x];
      this->Sum[y * 40 + x] += layer.Alpha;
      largest = std::max(largest, layer.Alpha);
    }
  } sink;
  const Picture picture = RenderPicture(context, { cloud.Get() }, SerialExecutor(), nullptr, &sink);
  CHECK(IsSane(picture));
  for (int i = 0; i < 40 * 36; ++i)
  {
    CHECK(sink.Sum[i] - sink.Largest[i] < 0.001f); // tails of the kernels may leak
  }
}

TEST_CASE("Opacities and colors")
{
  for (float value : { -1.0f, -1e30f, 2.0f, 1e30f })
  {
    TestCloud cloud;
    TestSurfel s = BigSurfel(2.0);
    s.Opacity = value;
    cloud.Add(s);
    s = BigSurfel(2.0);
    s.Color = { { value, 0.5f, -value, 1.0f } };
    cloud.Add(s);
    s.Position[2] = 4.0; // behind what may be opaque
    cloud.Add(s);
    CHECK(IsSane(RenderPicture(MakeContext(), cloud)));
    cloud.Opacity = value;
    CHECK(IsSane(RenderPicture(MakeContext(), cloud)));
  }
  TestCloud cloud;
  cloud.Add(BigSurfel(2.0));
  cloud.Opacity = NAN;
  CHECK(IsSane(RenderPicture(MakeContext(), cloud)));
}

/// Lights that are broken or stand on a surfel.
TEST_CASE("Lights")
{
  TestCloud cloud;
  cloud.Add(BigSurfel(2.0));
  cloud.Surface.Lit = true;
  cloud.Surface.Specular = 0.5;
  cloud.Surface.SpecularPower = 1e6;
  for (double value : { 0.0, -5.0, 1e300, static_cast<double>(NAN) })
  {
    SplatContext context = MakeContext();
    Light light;
    light.Positional = true;
    light.Position = { 0, 0, 2 };
    light.Attenuation = { value, value, value };
    context.Lights.push_back(light);
    light.Position = { 0, 0, 0 };
    light.ConeCosine = value;
    context.Lights.push_back(light);
    light.Color = { value, value, value };
    context.Lights.push_back(light);
    CHECK(IsSane(RenderPicture(context, cloud)));
  }
}

TEST_CASE("Frame sizes")
{
  TestCloud cloud;
  for (double x : { -0.3, 0.0, 0.4 })
  {
    TestSurfel s = BigSurfel(1.5);
    s.Position[0] = x;
    cloud.Add(s);
  }
  for (int size = 1; size <= 70; ++size)
  {
    CHECK(IsSane(RenderPicture(MakeContext(size, 5), cloud)));
    CHECK(IsSane(RenderPicture(MakeContext(3, size), cloud)));
  }
  CHECK(RenderPicture(MakeContext(0, 0), cloud).Color.empty());
  CHECK(RenderPicture(MakeContext(0, 7), cloud).Color.empty());
}

TEST_CASE("Empty")
{
  const Picture none = RenderPicture(MakeContext(), std::vector<SurfelCloud>());
  CHECK(IsSane(none));
  CHECK_NEAR(SumOfAlpha(none), 0.0, 0.0);
  CHECK_NEAR(SumOfAlpha(RenderPicture(MakeContext(), TestCloud())), 0.0, 0.0);
  const Picture threads =
    RenderPicture(MakeContext(), std::vector<SurfelCloud>(2), ThreadExecutor(3));
  CHECK_NEAR(SumOfAlpha(threads), 0.0, 0.0);
}

/// Settings outside of their ranges draw nothing or something, and break nothing.
TEST_CASE("Settings")
{
  TestCloud cloud;
  cloud.Add(BigSurfel(2.0));
  const double values[] = { 0.0, -1.0, 1e-9, 1e-300, 1e6, 1e300, -1e300, INFINITY, NAN };
  for (double value : values)
  {
    SplatContext context = MakeContext();
    context.Settings.Cutoff = value;
    CHECK(IsSane(RenderPicture(context, cloud)));
    context = MakeContext();
    context.Settings.Prefilter = value;
    CHECK(IsSane(RenderPicture(context, cloud)));
    context = MakeContext();
    context.Camera.Cx = value;
    context.Camera.Far = value;
    CHECK(IsSane(RenderPicture(context, cloud)));
  }
}

/// A limit that is NaN, zero or infinite hides or does not hide; it breaks nothing.
TEST_CASE("Depth limits")
{
  TestCloud cloud;
  cloud.Add(BigSurfel(2.0));
  std::vector<float> limit(40 * 36);
  for (std::size_t i = 0; i < limit.size(); ++i)
  {
    limit[i] = OddValues[i % (sizeof(OddValues) / sizeof(float))];
  }
  CHECK(IsSane(RenderPicture(MakeContext(), { cloud.Get() }, SerialExecutor(), limit.data())));
}
}
