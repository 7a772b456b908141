// SPDX-License-Identifier: BSD-3-Clause
/**
 * Surfels that have an outside, from their backs: not drawn, unless SurfelCloud::ShowsBacks.
 */
#include "TestScene.h"
#include "Testing/Shared/Check.h"

using namespace SurfelSplatting;

namespace
{
/// A ball around the camera, of surfels at random, that faces outward, or has two sides.
TestCloud BallAround(bool twoSided)
{
  Random random(7);
  TestCloud cloud;
  for (int i = 0; i < 20000; ++i)
  {
    const Vector3 n = random.Direction();
    TestSurfel s = SquareSurfel({ 3.0 * n[0], 3.0 * n[1], 3.0 * n[2] }, 0.08);
    s.Normal = n;
    s.TwoSided = twoSided;
    cloud.Add(s);
  }
  return cloud;
}

SplatContext BlurredContext()
{
  SplatContext context = TestContext();
  context.Camera = PinholeView(64, 64, 60.0);
  context.Optics.Radius = 0.05;
  context.Optics.FocalDistance = 1.0;
  return context;
}

/// The picture with backs, without which it is empty.
Picture DrawBacks(SurfelCloud cloud)
{
  const SplatContext context = BlurredContext();
  CHECK(SumOfAlpha(RenderPicture(context, { cloud })) == 0.0);
  cloud.ShowsBacks = true;
  Picture shown = RenderPicture(context, { cloud });
  CHECK(SumOfAlpha(shown) > 0.9 * 64 * 64);
  return shown;
}

TEST_CASE("Backs look as if they had two sides")
{
  const TestCloud ball = BallAround(false);
  const Picture shown = DrawBacks(ball.Get());
  CHECK(LargestDifference(shown, RenderPicture(BlurredContext(), BallAround(true))) == 0.0);
}

/// Cones of normals leave nothing out.
TEST_CASE("Backs of a hierarchy")
{
  const TestHierarchy hierarchy(BallAround(false));
  DrawBacks(hierarchy.Get());
}

/// A card behind a wall covers nothing of it; seen from the wall's back it is in front.
TEST_CASE("What a sheet covers is before it from its back")
{
  TestSurfel card;
  card.Overlap = 255;
  TestCloud covered, alone;
  covered.Add(card);
  card.Overlap = 0;
  alone.Add(card);
  SplatContext context = BlurredContext();
  context.Optics.FocalDistance = 0.5;
  for (const double z : { 1.0, -1.0 })
  {
    SurfelCloud clouds[] = { covered.Get(), alone.Get() };
    for (SurfelCloud& cloud : clouds)
    {
      cloud.ShowsBacks = true;
      cloud.LocalToWorld.L[1] = { 0, z, 0 }; // turns it about x, at z = 1
      cloud.LocalToWorld.L[2] = { 0, 0, z };
      cloud.LocalToWorld.T = { 0, 0, 1.0 - z };
    }
    CHECK((LargestDifference(RenderPicture(context, { clouds[0] }),
             RenderPicture(context, { clouds[1] })) == 0.0) == (z < 0.0));
  }
}
}
