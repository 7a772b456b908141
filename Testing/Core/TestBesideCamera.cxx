// SPDX-License-Identifier: BSD-3-Clause
/**
 * Surfels and Gaussians beside the camera, whose supports nearly reach the plane of the lens: their
 * footprints do not bring into the picture what is not seen.
 */
#include "TestScene.h"
#include "Testing/Shared/Check.h"

#include <algorithm>

using namespace SurfelSplatting;

namespace
{
/// A wall beside the camera, from behind it to 4 units in front, is seen at the left only, although
/// supports next to the plane of the lens nearly reach it.
TEST_CASE("Wall beside the camera")
{
  Random random(4);
  TestCloud surfels, gaussians;
  gaussians.Kind = CloudKind::Capture;
  for (int i = 0; i < 200000; ++i)
  {
    TestSurfel s =
      SquareSurfel({ -0.6, random.Uniform(-1.0, 1.0), random.Uniform(-0.2, 4.0) }, 0.01);
    s.Normal = { 1, 0, 0 };
    surfels.Add(s);
    TestGaussian g;
    g.Position = { s.Position[0], s.Position[1], s.Position[2] };
    g.Covariance = { 1e-6, 2.5e-5, 2.5e-5, 0, 0, 0 };
    g.Density = 0.8f;
    gaussians.Add(g);
  }
  SplatContext context = TestContext();
  context.Camera = PinholeView(96, 96, 100.0);
  for (const TestCloud& cloud : { surfels, gaussians })
  {
    const Picture picture = RenderPicture(context, cloud);
    double left = 1.0, right = 0.0;
    for (int y = 40; y < 56; ++y) // at z = 3: x = 48 - 60 / 3 px
    {
      left = std::min<double>(left, picture.At(10, y, 3));
    }
    for (int y = 0; y < 96; ++y)
    {
      for (int x = 40; x < 96; ++x) // it ends at z = 4, x = 33
      {
        right = std::max<double>(right, picture.At(x, y, 3));
      }
    }
    CHECK(left > 0.9);
    CHECK(right == 0.0);
  }
}

/// A floor's surfel below the picture, which nearly reaches the plane of the lens, with a blur that
/// would bring its image up to 15 px below the picture: no pinhole in the lens sees it.
TEST_CASE("Large surfel below the picture")
{
  TestSurfel s;
  s.Position = { -0.5, 3.88, 2.85 };
  s.Normal = { 0, -1, 0 };
  s.SigmaU = s.SigmaV = 0.97;
  s.Area = 10.0;
  TestCloud cloud;
  cloud.Add(s);
  SplatContext context = TestContext();
  context.Camera = PinholeView(80, 60, 112.0);
  context.Optics.FocalDistance = 15.48;
  for (const double radius : { 0.0, 0.5, 1.0, 1.1 })
  {
    context.Optics.Radius = radius;
    const Picture picture = RenderPicture(context, cloud);
    double most = 0.0;
    for (int y = 0; y < 60; ++y)
    {
      for (int x = 0; x < 80; ++x)
      {
        most = std::max<double>(most, picture.At(x, y, 3));
      }
    }
    CHECK(most == 0.0);
  }
  context.Optics.Radius = 1.1;
  context.Camera = PinholeView(80, 260, 112.0); // the same, farther down
  context.Camera.Cy = 30.0;
  const Picture below = RenderPicture(context, cloud);
  CHECK(below.At(20, 180, 3) > 0.9);
}
}
