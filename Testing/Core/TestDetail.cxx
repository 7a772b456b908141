// SPDX-License-Identifier: BSD-3-Clause
/**
 * The choice of detail: cuts that are cuts, coverage that stays at every level, work that follows
 * what is seen. TestSkips.cxx has what is skipped.
 */
#include "Core/Splats/SplatMaker.h"
#include "RoomScene.h"
#include "TestScene.h"
#include "Testing/Shared/Check.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>

using namespace SurfelSplatting;

namespace
{
/// A gain of 2 allows nodes twice as large, where the blur decides: the error 2.
TEST_CASE("Cells of the lens")
{
  Random random(3);
  const TestHierarchy hierarchy(Room(5000, random));
  for (int i = 0; i < 20; ++i)
  {
    const SplatContext context = RandomContext(random, i);
    std::vector<CutRange> cuts[2];
    for (int cells = 0; cells < 2; ++cells)
    {
      CutSettings settings;
      settings.Cells = cells ? 64 : 1;
      settings.BlurGain = cells ? 2.0 : 1.0;
      settings.Error = cells ? 0.5 : 1.0;
      CutWork work;
      // No pixel filter worth speaking of.
      SelectCut(hierarchy.Get(), { context.Camera, context.Optics, 4.0, 1e-12 }, settings,
        SerialExecutor(), work, cuts[cells]);
    }
    // The cut of all cells holds what any of them sees.
    const std::vector<CutRange> all = cuts[1];
    SeeFromCell(all, context.Camera, context.Optics, { { 0, 0, 0 } }, cuts[1]);
    REQUIRE(cuts[0].size() == cuts[1].size());
    for (std::size_t k = 0; k < cuts[0].size(); ++k)
    {
      CHECK(cuts[0][k].Begin == cuts[1][k].Begin);
      CHECK(cuts[0][k].Count == cuts[1][k].Count);
      CHECK(cuts[0][k].Level == cuts[1][k].Level);
    }
  }
}

/// Every leaf is drawn once: by itself, by a node above it, or not at all since it was skipped.
TEST_CASE("Cut")
{
  Random random(2);
  const TestHierarchy hierarchy(Room(5000, random));
  const HierarchyLayout& layout = hierarchy.Order.Layout;
  for (int i = 0; i < 60; ++i)
  {
    const SplatContext context = RandomContext(random, i);
    CutSettings settings;
    settings.Rule = i % 2 ? CutRule::Moments : CutRule::Paper;
    settings.Error = i % 7 * 0.5;
    CutWork work;
    std::vector<CutRange> runs;
    const CutStatistics statistics = SelectCut(hierarchy.Get(),
      { context.Camera, context.Optics, 4.0, 1.0 }, settings, ThreadExecutor(3), work, runs);
    std::vector<int> drawn(layout.NumberOfLeaves(), 0);
    for (const CutRange& run : runs)
    {
      const int level = static_cast<int>(run.Level);
      for (std::size_t n = run.Begin; n < run.Begin + run.Count; ++n)
      {
        const int tree = n >= layout.Begin(level, 1) ? 1 : 0;
        const std::size_t j = n - layout.Begin(level, tree);
        const std::size_t end =
          std::min<std::size_t>((j + 1) << level, layout.NumberOfLeaves(tree));
        for (std::size_t leaf = j << level; leaf < end; ++leaf)
        {
          ++drawn[layout.Begin(0, tree) + leaf];
        }
      }
    }
    CHECK(*std::max_element(drawn.begin(), drawn.end()) <= 1);
    const std::uint64_t missing =
      static_cast<std::uint64_t>(std::count(drawn.begin(), drawn.end(), 0));
    CHECK(missing == statistics.OutsideLeaves + statistics.BackLeaves);
    CHECK((settings.Error > 0.0 ||
      statistics.Nodes + missing == layout.NumberOfLeaves())); // error 0: leaves
  }
}

/// A plain surface keeps its coverage whichever level is drawn, and so does the error that is
/// needed for it.
TEST_CASE("Normalization of levels")
{
  TestCloud cloud;
  for (int j = 0; j < 256; ++j)
  {
    for (int i = 0; i < 256; ++i)
    {
      const double d = 0.01;
      cloud.Add(SquareSurfel({ (i - 127.5) * d, (j - 127.5) * d, 3.0 }, d, 0.8)); // not saturated
    }
  }
  const TestHierarchy hierarchy(cloud);
  for (const CutRule rule : { CutRule::Moments, CutRule::Paper })
  {
    for (double radius : { 0.0, 0.02, 0.05, 0.1, 0.2, 0.4 })
    {
      SplatContext context;
      context.Camera = PinholeView(96, 96, 250.0);
      context.Optics = { radius, 1.5 };
      context.Cut.Rule = rule;
      context.Cut.Error = 1.0;
      Splatter splatter;
      Picture picture(96, 96);
      splatter.Render(context, { hierarchy.Get() }, SerialExecutor(), picture.Get());
      double low = 2.0, high = 0.0, sum = 0.0;
      for (int y = 24; y < 72; ++y)
      {
        for (int x = 24; x < 72; ++x)
        {
          const double a = picture.At(x, y, 3);
          low = std::min(low, a);
          high = std::max(high, a);
          sum += a / (48.0 * 48.0);
        }
      }
      const double leaves = 65536.0 / static_cast<double>(splatter.Statistics().Cut.Nodes);
      std::printf("radius %.2f: %.1f surfels a node, coverage %.4f to %.4f, mean %.4f\n", radius,
        leaves, low, high, sum);
      // The ripple of the weights is compensated for, more or less: by up to 1.064. (Of Gaussians
      // cut off at 2.5, sampling at pixels loses 0.01 here; other kernels show all of it.)
      CHECK_NEAR(sum, 0.8, rule == CutRule::Moments ? 0.055 : 0.12);
      CHECK((rule == CutRule::Paper || (low > 0.9 * sum && high < 1.1 * sum)));
      CHECK((radius < 0.1 || leaves > 4.0));
    }
  }
}

/// One long leaf of 64 does not decide how finely the others are drawn.
TEST_CASE("One long leaf")
{
  constexpr double d = 0.01, z = 20.0, f = 500.0;
  for (const double length : { 1.0, 4.0 })
  {
    TestCloud cloud;
    for (int i = 0; i < 64; ++i)
    {
      TestSurfel s = SquareSurfel({ (i % 8 - 3.5) * d, (i / 8 - 3.5) * d, z }, d);
      s.SigmaU *= i == 27 ? length : 1.0;
      cloud.Add(s);
    }
    const TestHierarchy hierarchy(cloud);
    SplatContext context;
    context.Camera = PinholeView(96, 96, f);
    // A node of 2 x 2 leaves has the deviation 0.71 d along both axes, 0.84 d by the norm.
    constexpr double deviation = 0.84 * d, ofPixel = 0.84; // CutDetail's share
    context.Cut.Error = 1.2 * deviation * f / (ofPixel * z);
    Splatter splatter;
    Picture picture(96, 96);
    splatter.Render(context, { hierarchy.Get() }, SerialExecutor(), picture.Get());
    CHECK(splatter.Statistics().Cut.Nodes == 16);
  }
}

/// The largest change of a pixel while the allowed error grows by a factor of 2 in steps.
double LargestStep(const SurfelCloud& cloud, int steps)
{
  SplatContext context;
  context.Camera = PinholeView(96, 96, 150.0);
  context.Optics = { 0.03, 1.2 };
  std::vector<float> last;
  std::set<std::uint64_t> counts;
  double largest = 0.0;
  for (int i = 0; i <= steps; ++i)
  {
    context.Cut.Error = 0.7 * std::pow(2.0, static_cast<double>(i) / steps);
    Splatter splatter;
    Picture picture(96, 96);
    splatter.Render(context, { cloud }, SerialExecutor(), picture.Get());
    counts.insert(splatter.Statistics().Cut.Nodes);
    for (std::size_t c = 0; c < last.size(); ++c)
    {
      largest = std::max<double>(largest, std::abs(picture.Color[c] - last[c]));
    }
    last = picture.Color;
  }
  CHECK(counts.size() > 20); // different cuts
  return largest;
}

/// A picture changes continuously with the error that is allowed, as with focus and camera: nodes
/// merge before they give way to their parents. Finer steps then change less.
TEST_CASE("Merging")
{
  TestCloud cloud;
  for (int j = 0; j < 160; ++j)
  {
    for (int i = 0; i < 160; ++i)
    {
      const double d = 0.01;
      TestSurfel s = SquareSurfel({ (i - 79.5) * d, (j - 79.5) * d, 2.0 }, d, 1.0);
      const float light = static_cast<float>(0.5 + 0.5 * std::sin(0.9 * i) * std::sin(0.7 * j));
      s.Color = { { light, 1.0f - light, 0.5f, 1.0f } };
      cloud.Add(s);
    }
  }
  const TestHierarchy hierarchy(cloud);
  const double coarse = LargestStep(hierarchy.Get(), 50), fine = LargestStep(hierarchy.Get(), 1600);
  std::printf(
    "merging: pixels change by %.2f and %.2f levels at most\n", 255.0 * coarse, 255.0 * fine);
  // A jump of 1.1 levels is left however fine the steps are: through the lens, fragments count less
  // where their layer has more than 1 already, so that their order matters. (When they counted less
  // from 1.1 on, it was 0.84 levels, and pictures were farther from their pinholes.)
  CHECK(fine < coarse / 3.0);
  CHECK(fine < 1.25 / 255.0);
}

/// Two children that have merged are their parent: same footprint, depth and colour, and its weight
/// together; and just before they begin to merge, they are themselves.
TEST_CASE("Merged pairs")
{
  Random random(5);
  const TestHierarchy hierarchy(Room(3000, random));
  const SurfelCloud cloud = hierarchy.Get();
  const HierarchyLayout& layout = cloud.Clusters->Layout();
  const SplatContext context = RandomContext(random, 3);
  const auto make = [&](const CutRange& run) {
    SplatList list;
    list.Clear();
    list.Resize(run.Count);
    SplatMaker maker;
    maker.Set(context, cloud);
    SplatOutput output = list.OutputAt(0);
    maker.Make(run, output);
    return std::vector<Splat>(&list.Splats[0], &list.Splats[0] + output.Count);
  };
  int compared = 0;
  for (const std::uint32_t level : { 0u, 1u, 3u })
  {
    for (std::size_t j = 0; j + 1 < layout.Count(static_cast<int>(level), 0); j += 2)
    {
      const std::size_t first = layout.Begin(static_cast<int>(level), 0) + j;
      const std::size_t above = layout.Begin(static_cast<int>(level) + 1, 0) + j / 2;
      const std::vector<Splat> parent = make({ above, 1, level + 1 });
      const std::vector<Splat> pair = make({ first, 2, level, 1.0f, above });
      const std::vector<Splat> alone = make({ first, 2, level });
      const std::vector<Splat> begun = make({ first, 2, level, 1e-12f, above });
      CHECK(begun.size() == alone.size());
      for (std::size_t i = 0; i < std::min(begun.size(), alone.size()); ++i)
      {
        CHECK_NEAR(begun[i].Weight, alone[i].Weight, 1e-5 * alone[i].Weight);
        CHECK_NEAR(begun[i].X, alone[i].X, 1e-3);
        CHECK_NEAR(begun[i].A, alone[i].A, 1e-5 * alone[i].A);
        CHECK_NEAR(begun[i].Red, alone[i].Red, 1e-5);
      }
      CHECK(pair.size() == 2 * parent.size());
      if (pair.size() != 2 || parent.size() != 1)
      {
        continue;
      }
      const Splat &p = parent[0], &a = pair[0], &b = pair[1];
      // Areas and area vectors are packed (HierarchyNode.h).
      CHECK_NEAR(a.Weight + b.Weight, p.Weight, 2e-3 * p.Weight);
      for (const Splat& s : { a, b })
      {
        CHECK_NEAR(s.X, p.X, 1e-4 * (1.0 + std::abs(p.X)));
        CHECK_NEAR(s.Y, p.Y, 1e-4 * (1.0 + std::abs(p.Y)));
        CHECK_NEAR(s.A, p.A, 1e-5 * p.A);
        CHECK_NEAR(s.B, p.B, 1e-5 * p.B);
        CHECK_NEAR(s.Near, p.Near, 1e-5 * std::abs(p.Near));
        CHECK_NEAR(s.Far, p.Far, 1e-5 * std::abs(p.Far));
        CHECK_NEAR(s.Red, p.Red, 1e-5);
        CHECK_NEAR(s.Opacity, p.Opacity, 1e-5);
        CHECK((s.Gradient == NoGradient) == (p.Gradient == NoGradient));
      }
      ++compared;
    }
  }
  CHECK(compared > 200);
}

/// Far more error than anybody wants, as under a time budget: coarse, but without holes.
TEST_CASE("Coarse has no holes")
{
  Random random(4);
  TestCloud cloud;
  for (int i = 0; i < 60000; ++i)
  {
    TestSurfel s;
    const double d = 2.0 / 245.0; // a jittered lattice
    s.Position = { d * (i % 245 + random.Uniform(-0.2, 0.2)) - 1.0,
      d * (i / 245 + random.Uniform(-0.2, 0.2)) - 1.0, 2.0 };
    s.Area = 4.0 / 60000.0;
    s.SigmaU = s.SigmaV = 0.6 * std::sqrt(s.Area);
    cloud.Add(s);
  }
  const TestHierarchy hierarchy(cloud);
  for (double error : { 2.0, 6.0, 20.0 })
  {
    SplatContext context;
    context.Camera = PinholeView(128, 128, 200.0);
    context.Cut.Error = error;
    const Picture picture = RenderPicture(context, { hierarchy.Get() });
    double low = 1.0;
    for (int y = 16; y < 112; ++y)
    {
      for (int x = 16; x < 112; ++x)
      {
        low = std::min<double>(low, picture.At(x, y, 3));
      }
    }
    std::printf("error %g: coverage from %.3f\n", error, low);
    CHECK(low > 0.6);
  }
}

/// A tube about the y axis.
TestCloud Tube(double radius, bool twoSided)
{
  TestCloud cloud;
  constexpr int around = 48, along = 1000;
  for (int i = 0; i < around * along; ++i)
  {
    const double angle = 2.0 * Pi * (i % around) / around;
    TestSurfel s;
    s.Normal = { std::sin(angle), 0.0, -std::cos(angle) };
    s.Position = { radius * s.Normal[0], 4.0 * (i / around + 0.5) / along - 2.0,
      3.0 + radius * s.Normal[2] };
    s.Area = 2.0 * Pi * radius / around * 4.0 / along;
    s.SigmaU = s.SigmaV = 0.5 * std::sqrt(s.Area);
    s.TwoSided = twoSided;
    cloud.Add(s);
  }
  return cloud;
}

/// What a picture of a cloud covers, px, if it is so transparent that nothing hides anything.
double CoveredArea(SplatContext context, SurfelCloud cloud, CutRule rule)
{
  cloud.Opacity = 0.001;
  context.Cut.Rule = rule;
  const Picture picture = RenderPicture(context, { cloud });
  double sum = 0.0;
  for (int i = 0; i < picture.Width * picture.Height; ++i)
  {
    sum += picture.Color[4 * i + 3];
  }
  return sum / cloud.Opacity;
}

/// Nodes of a tube cover what their leaves do, though leaves that turn away are among them, and
/// both what leaves do in focus, of each side alone. (With the sums of the area vectors alone, they
/// lose 27 % where the lens blurs most.)
TEST_CASE("Nodes of tubes")
{
  struct Case
  {
    bool TwoSided;
    double LensRadius;
  };
  for (const Case& c : { Case{ false, 0.3 }, Case{ false, 0.6 }, Case{ true, 0.6 } })
  {
    const TestCloud tube = Tube(0.04, c.TwoSided);
    const TestHierarchy hierarchy(tube);
    SplatContext context;
    context.Camera = PinholeView(128, 128, 250.0);
    context.Optics = { c.LensRadius, 8.0 };
    SplatContext focus = context;
    focus.Optics.Radius = 0.0;
    const TestHierarchy front(Tube(0.04, false));
    const double truth =
      (c.TwoSided ? 2.0 : 1.0) * CoveredArea(focus, front.Get(), CutRule::Leaves);
    const double nodes = CoveredArea(context, hierarchy.Get(), CutRule::Moments) / truth;
    const double leaves = CoveredArea(context, hierarchy.Get(), CutRule::Leaves) / truth;
    std::printf("tube, %s, lens %.1f: nodes cover %.4f, leaves %.4f\n",
      c.TwoSided ? "two-sided" : "one-sided", c.LensRadius, nodes, leaves);
    CHECK_NEAR(leaves, 1.0, 0.01);
    // Front and back that become one layer of nodes cover one another (LargestCover).
    CHECK_NEAR(nodes, 1.0, c.TwoSided ? 0.03 : 0.01);
  }
}

/// From afar a dense cloud costs what a sparse one costs: the work follows the pixels.
TEST_CASE("Work follows pixels")
{
  std::uint64_t splats[3];
  int k = 0;
  for (int count : { 3000, 30000, 300000 })
  {
    Random random(6);
    TestCloud cloud;
    for (int i = 0; i < count; ++i)
    {
      TestSurfel s;
      s.Normal = random.Direction();
      s.Position = { s.Normal[0], s.Normal[1], s.Normal[2] + 10.0 };
      s.Area = 12.57 / count;
      s.SigmaU = s.SigmaV = 0.55 * std::sqrt(s.Area);
      cloud.Add(s);
    }
    const TestHierarchy hierarchy(cloud);
    SplatContext context;
    context.Camera = PinholeView(64, 64, 200.0); // 1300 px of ball
    Splatter splatter;
    Picture picture(64, 64);
    splatter.Render(context, { hierarchy.Get() }, SerialExecutor(), picture.Get());
    splats[k++] = splatter.Statistics().Splats;
    CHECK(splatter.Statistics().Cut.VisitedNodes < static_cast<std::uint64_t>(count) / 20 + 200);
  }
  std::printf("splats: %d, %d, %d\n", static_cast<int>(splats[0]), static_cast<int>(splats[1]),
    static_cast<int>(splats[2]));
  CHECK(splats[2] < 4 * splats[1] / 2);
  CHECK(splats[2] < 8000);
}

/// The same frame, bit for bit, at any number of threads, whichever tile comes first to a node.
TEST_CASE("Threads")
{
  Random random(9);
  const TestHierarchy hierarchy(Room(20000, random));
  for (int i = 0; i < 10; ++i)
  {
    const SplatContext context = RandomContext(random, i);
    const Picture expected = RenderPicture(context, { hierarchy.Get() });
    for (unsigned int threads : { 2u, 8u })
    {
      const Picture picture = RenderPicture(context, { hierarchy.Get() }, ThreadExecutor(threads));
      CHECK(picture.Color == expected.Color);
      CHECK(picture.Depth == expected.Depth);
    }
  }
}

/// Leaves of a hierarchy give the picture of the cloud itself.
TEST_CASE("Leaves")
{
  Random random(8);
  const TestCloud cloud = Room(5000, random);
  const TestHierarchy hierarchy(cloud);
  for (int i = 0; i < 20; ++i)
  {
    SplatContext context = RandomContext(random, i);
    context.Cut.Rule = CutRule::Leaves;
    context.CoarseGrids = false;
    // Float positions, and another order where depths are equal: a pixel here or there merges
    // otherwise.
    CHECK(MeanSquareDifference(
            RenderPicture(context, cloud), RenderPicture(context, { hierarchy.Get() })) < 1e-6);
  }
}
}
