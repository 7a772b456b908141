// SPDX-License-Identifier: BSD-3-Clause
/**
 * Colours of nodes of captures (SetupNodeColors.h) against pinholes that draw all Gaussians: leaves
 * with two sides, and blurred stripes.
 */
#include "TestScene.h"
#include "Testing/Shared/Check.h"

#include <cmath>
#include <cstdio>

using namespace SurfelSplatting;

namespace
{
constexpr int Size = 96;

/// A square sheet at a depth of 3, turned about y by an angle.
struct Sheet
{
  double Angle = 0.0;     ///< rad
  double Thickness = 0.0; ///< between two layers of different colours; 0: one layer
  double Stripe = 0.0;    ///< width; 0: none
  bool HasMoments = true; ///< of the colours
};

TestHierarchy MakeSheet(const Sheet& sheet)
{
  Random random(3);
  TestCloud cloud;
  cloud.Kind = CloudKind::Capture;
  constexpr int count = 12000;
  constexpr double half = 0.6, sigma = 0.016;
  const Vector3 u{ std::cos(sheet.Angle), 0, std::sin(sheet.Angle) };
  const Vector3 n{ -u[2], 0, u[0] };
  for (int i = 0; i < count; ++i)
  {
    const double x = random.Uniform(-half, half), y = random.Uniform(-half, half);
    const double z = sheet.Thickness * (i % 2 == 0 ? -0.5 : 0.5);
    TestGaussian g;
    g.Position = { x * u[0] + z * n[0], y, 3.0 + x * u[2] + z * n[2] };
    constexpr double thin = 1e-3;
    const auto entry = [&](int a, int b) {
      return sigma * sigma * (u[a] * u[b] + (a == 1 && b == 1 ? 1.0 : 0.0) + thin * n[a] * n[b]);
    };
    g.Covariance = { entry(0, 0), entry(1, 1), entry(2, 2), entry(0, 1), entry(1, 2), entry(0, 2) };
    g.Density = 0.7f;
    const bool isRed = sheet.Stripe > 0.0
      ? std::fmod(x + 8.0 * sheet.Stripe, 2.0 * sheet.Stripe) < sheet.Stripe
      : i % 2 == 0;
    g.Color =
      isRed ? std::array<float, 4>{ { 1, 0, 0, 1 } } : std::array<float, 4>{ { 0, 0, 1, 1 } };
    cloud.Add(g);
  }
  TestHierarchy hierarchy(cloud);
  for (NodeColor& color : hierarchy.Colors)
  {
    color.MomentUnit = sheet.HasMoments ? color.MomentUnit : 0.0f;
  }
  return hierarchy;
}

/// A picture through the lens: of nodes, or of all Gaussians through pinholes.
Picture Draw(const TestHierarchy& hierarchy, double radius, bool all)
{
  SplatContext context;
  context.Camera = PinholeView(Size, Size, 250.0);
  context.Optics = { radius, 1.5 };
  if (all)
  {
    context.Cut.Rule = CutRule::Leaves;
    context.Sampling.Pinholes = true;
    context.Sampling.Count = 64;
  }
  return RenderPicture(context, { hierarchy.Get() });
}

/// Root mean square of the differences in red and blue, and the mean red, in the middle.
struct Differences
{
  double RootMeanSquare = 0.0, Red = 0.0;

  Differences(const TestHierarchy& hierarchy, double radius)
  {
    const Picture picture = Draw(hierarchy, radius, false), truth = Draw(hierarchy, radius, true);
    constexpr int begin = Size / 2 - 16, end = Size / 2 + 16, pixels = 32 * 32;
    for (int y = begin; y < end; ++y)
    {
      for (int x = begin; x < end; ++x)
      {
        this->Red += (picture.At(x, y, 0) - truth.At(x, y, 0)) / pixels;
        for (const int c : { 0, 2 })
        {
          const double d = picture.At(x, y, c) - truth.At(x, y, c);
          this->RootMeanSquare += d * d / (2 * pixels);
        }
      }
    }
    this->RootMeanSquare = std::sqrt(this->RootMeanSquare);
  }
};

TEST_CASE("Sides of a leaf")
{
  for (const double angle : { 0.0, 0.6, 2.7, Pi })
  {
    const Sheet leaf{ angle, 0.02, 0.0, true }, mean{ angle, 0.02, 0.0, false };
    const double red = Differences(MakeSheet(leaf), 0.08).Red;
    const double without = Differences(MakeSheet(mean), 0.08).Red;
    std::printf("turned by %.2f: red off by %.3f; means alone %.3f\n", angle, red, without);
    CHECK(std::abs(without) > 0.1);
    CHECK(std::abs(red) < 0.4 * std::abs(without));
  }
}

TEST_CASE("One layer has no sides")
{
  for (const double angle : { 0.0, 0.8 })
  {
    const double red = Differences(MakeSheet({ angle, 0.0, 0.0, true }), 0.08).Red;
    std::printf("turned by %.2f: red off by %.3f\n", angle, red);
    CHECK(std::abs(red) < 0.03);
  }
}

TEST_CASE("Blurred stripes")
{
  for (const double radius : { 0.06, 0.12 })
  {
    const auto difference = [&](bool moments) {
      return Differences(MakeSheet({ 0.0, 0.0, 0.1, moments }), radius).RootMeanSquare;
    };
    const double own = difference(true), without = difference(false);
    std::printf("lens %.2f: off by %.4f; means alone %.4f\n", radius, own, without);
    CHECK(own < 0.9 * without);
  }
}
}
