// SPDX-License-Identifier: BSD-3-Clause
/**
 * What is skipped: pictures that no skip changes, from anywhere, before props, through mirrors and
 * with pixels that are not square.
 */
#include "RoomScene.h"
#include "TestScene.h"
#include "Testing/Shared/Check.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <vector>

using namespace SurfelSplatting;

/// No skip changes a pixel by more than 1/255 against all of them switched off; with the leaves and
/// with the choice of detail.
TEST_CASE("Skips")
{
  Random random(1);
  const TestHierarchy hierarchy(Room(20000, random));
  CutStatistics skipped;
  std::uint64_t hidden = 0;
  double worst = 0.0;
  for (int i = 0; i < 200; ++i)
  {
    SplatContext context = RandomContext(random, i);
    context.Cut.Rule = i % 2 ? CutRule::Moments : CutRule::Leaves;
    Splatter splatter;
    Picture with(96, 96), without(96, 96);
    splatter.Render(context, { hierarchy.Get() }, SerialExecutor(), with.Get());
    skipped.OutsideLeaves += splatter.Statistics().Cut.OutsideLeaves;
    skipped.BackLeaves += splatter.Statistics().Cut.BackLeaves;
    hidden += splatter.Statistics().HiddenPairs + splatter.Statistics().HiddenSurfels;
    context.Cut.SkipOutside = context.Cut.SkipBackFaces = context.SkipHidden = false;
    splatter.Render(context, { hierarchy.Get() }, SerialExecutor(), without.Get());
    CHECK(splatter.Statistics().Cut.OutsideLeaves == 0);
    CHECK(splatter.Statistics().Cut.BackLeaves == 0);
    CHECK(splatter.Statistics().HiddenPairs == 0);
    CHECK(splatter.Statistics().HiddenSurfels == 0);
    const double difference = LargestDifference(with, without);
    CHECK(difference <= 1.0 / 255.0);
    worst = std::max(worst, difference);
  }
  std::printf("skips: pixels off by %.5f at most\n", worst);
  std::printf("skipped: %.0f outside, %.0f facing away, %.0f hidden\n", 1.0 * skipped.OutsideLeaves,
    1.0 * skipped.BackLeaves, 1.0 * hidden);
  CHECK(skipped.OutsideLeaves > 100000);
  CHECK(skipped.BackLeaves > 100000);
  CHECK(hidden > 1000);
}

/// The pixel filter is as wide along both axes, whatever the world is.
TEST_CASE("What is outside of pixels that are not square")
{
  constexpr double d = 0.002; // a 50th of a pixel's height
  TestCloud cloud;
  for (int i = 0; i < 80000; ++i)
  {
    cloud.Add(SquareSurfel({ (i % 40 - 19.5) * d, (i / 40 - 999.5) * d, 2.0 }, d));
  }
  const TestHierarchy hierarchy(cloud);
  SplatContext context;
  context.Camera = PinholeView(24, 6, 400.0);
  context.Camera.Fy = 20.0;
  Splatter splatter;
  Picture with(24, 6), without(24, 6);
  splatter.Render(context, { hierarchy.Get() }, SerialExecutor(), with.Get());
  CHECK(splatter.Statistics().Cut.OutsideLeaves > 40000);
  context.Cut.SkipOutside = false;
  splatter.Render(context, { hierarchy.Get() }, SerialExecutor(), without.Get());
  CHECK(LargestDifference(with, without) <= 1e-5);
}

/// Skips hide nothing of what is blurred before an opaque prop of others.
TEST_CASE("Skips before props")
{
  Random random(3);
  const TestHierarchy hierarchy(Room(20000, random));
  std::vector<float> limit(96 * 96);
  for (int i = 0; i < 100; ++i)
  {
    SplatContext context = RandomContext(random, i);
    context.Optics.Radius *= 3.0; // much of it on coarse grids
    const double distance = context.Optics.FocalDistance * random.Uniform(0.3, 1.5);
    for (std::size_t p = 0; p < limit.size(); ++p)
    {
      limit[p] = p % 96 < 70 ? static_cast<float>(distance) : INFINITY;
    }
    const Picture with =
      RenderPicture(context, { hierarchy.Get() }, SerialExecutor(), limit.data());
    context.SkipHidden = false;
    CHECK(LargestDifference(
            with, RenderPicture(context, { hierarchy.Get() }, SerialExecutor(), limit.data())) <=
      1.0 / 255.0);
  }
}

/// Through a mirror, and stretched: cones say nothing then, and nothing is lost.
TEST_CASE("Transforms")
{
  Random random(7);
  TestCloud cloud = Room(8000, random);
  cloud.LocalToWorld.L = { { { -1.0, 0.2, 0.0 }, { 0.0, 0.3, 0.1 }, { 0.0, 0.0, 2.0 } } };
  const TestHierarchy hierarchy(cloud);
  for (int i = 0; i < 30; ++i)
  {
    SplatContext context = RandomContext(random, i);
    const Picture with = RenderPicture(context, { hierarchy.Get() });
    context.Cut.SkipOutside = context.Cut.SkipBackFaces = context.SkipHidden = false;
    CHECK(LargestDifference(with, RenderPicture(context, { hierarchy.Get() })) <= 1.0 / 255.0);
  }
}
