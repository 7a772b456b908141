// SPDX-License-Identifier: BSD-3-Clause
// What the core offers to those who come with plain arrays: LookAt, RoundSurfels, ThreadExecutor.
#include "Core/Surfels/RoundSurfels.h"
#include "TestScene.h"
#include "Testing/Shared/Check.h"

#include <limits>
#include <stdexcept>

using namespace SurfelSplatting;

namespace
{
/// A square of 41 x 41 points in the plane z = 0 that faces +z.
struct Plane
{
  static constexpr int Side = 41;
  static constexpr double Spacing = 0.1;
  std::vector<float> Positions, Normals;

  Plane()
  {
    for (int i = 0; i < Side * Side; ++i)
    {
      for (const double x : { i % Side - Side / 2, i / Side - Side / 2 })
      {
        this->Positions.push_back(static_cast<float>(Spacing * x));
      }
      this->Positions.push_back(0.0f);
      this->Normals.insert(this->Normals.end(), { 0.0f, 0.0f, 3.0f });
    }
  }

  RoundSurfels Surfels() const
  {
    return { Side * Side, this->Positions.data(), this->Normals.data(), Spacing };
  }
};

SplatContext FrontContext()
{
  SplatContext context = TestContext();
  context.Camera = LookAt({ 0, 0, 5 }, { 0, 0, 0 }, { 0, 1, 0 }, 30, 80, 60);
  return context;
}
}

TEST_CASE("LookAt")
{
  const View view = LookAt({ 1, 2, 3 }, { 1, -4, 3 }, { 1, 5, 0 }, 60, 200, 100);
  const auto onScreen = [&view](const Vector3& world) {
    const Vector3 p = view.WorldToCamera.Apply(world);
    return Vector3{ view.Fx * p[0] / p[2] + view.Cx, view.Fy * p[1] / p[2] + view.Cy, p[2] };
  };
  const Vector3 middle = onScreen({ 1, -4, 3 });
  CHECK(middle[0] == doctest::Approx(100));
  CHECK(middle[1] == doctest::Approx(50));
  CHECK(middle[2] == doctest::Approx(6));
  // Looks along -y with +x up, so that +z is to the right; the upper border is at 30 degrees.
  const Vector3 top = onScreen({ 1 + 6 * std::tan(Pi / 6), -4, 3 });
  CHECK(top[0] == doctest::Approx(100));
  CHECK(top[1] == doctest::Approx(100));
  CHECK(onScreen({ 1, -4, 4 })[0] > 100);
}

TEST_CASE("LookAt refuses what is no view")
{
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Vector3 eye{ 0, 0, 5 }, origin{ 0, 0, 0 }, up{ 0, 1, 0 };
  CHECK_THROWS_AS(LookAt(eye, eye, up, 30, 8, 8), std::invalid_argument);
  CHECK_THROWS_AS(LookAt({ nan, 0, 0 }, origin, up, 30, 8, 8), std::invalid_argument);
  CHECK_THROWS_AS(LookAt(eye, origin, { 0, 0, 2 }, 30, 8, 8), std::invalid_argument);
  CHECK_THROWS_AS(LookAt(eye, origin, up, nan, 8, 8), std::invalid_argument);
  CHECK_THROWS_AS(LookAt(eye, origin, up, 180, 8, 8), std::invalid_argument);
  CHECK_THROWS_AS(LookAt(eye, origin, up, 30, 8, 0), std::invalid_argument);
}

TEST_CASE("Round surfels cover their surface")
{
  const Plane plane;
  const RoundSurfels surfels = plane.Surfels();
  const Picture picture = RenderPicture(FrontContext(), { surfels.Cloud() }, ThreadExecutor(2));
  for (const int x : { 20, 33, 40, 60 })
  {
    CHECK(picture.At(x, 30, 3) == doctest::Approx(1).epsilon(0.05));
    CHECK(picture.At(x, 30, 0) == doctest::Approx(1).epsilon(0.05));
    CHECK(picture.DepthAt(x, 30) == doctest::Approx(5).epsilon(1e-4));
  }
}

TEST_CASE("A frame that does not fit the view is refused")
{
  const Plane plane;
  const RoundSurfels surfels = plane.Surfels();
  Splatter splatter;
  Picture large(160, 120), picture(80, 60);
  CHECK_THROWS_WITH(
    splatter.Render(FrontContext(), { surfels.Cloud() }, SerialExecutor(), large.Get()),
    "the frame has 160 x 120 pixels, and the view 80 x 60; make them equal");
  Frame withoutDepth = picture.Get();
  withoutDepth.Depth = nullptr;
  CHECK_THROWS_AS(
    splatter.Render(FrontContext(), { surfels.Cloud() }, SerialExecutor(), withoutDepth),
    std::invalid_argument);
}

TEST_CASE("Round surfels are seen from outside, and not without a normal")
{
  Plane plane;
  plane.Normals[2] = 0.0f;
  const RoundSurfels surfels = plane.Surfels();
  SplatContext context = FrontContext();
  Picture picture(80, 60);
  Splatter splatter;
  splatter.Render(context, { surfels.Cloud() }, SerialExecutor(), picture.Get());
  CHECK(splatter.Statistics().InvalidSurfels == 1);
  CHECK(splatter.Statistics().Splats > 1000);

  context.Camera = LookAt({ 0, 0, -5 }, { 0, 0, 0 }, { 0, 1, 0 }, 30, 80, 60);
  CHECK(RenderPicture(context, { surfels.Cloud() }).At(40, 30, 3) == 0);
}
