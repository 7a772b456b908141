// SPDX-License-Identifier: BSD-3-Clause
/**
 * What sheets cover of one another (SheetOverlap.h), and the colours of nodes that hold both.
 */
#include "Core/Hierarchy/SheetOverlap.h"
#include "Core/Surfels/NodePacking.h"
#include "TestScene.h"
#include "Testing/Shared/Check.h"

#include <cmath>

using namespace SurfelSplatting;

namespace
{
constexpr int Side = 64; // points along the side of a unit square
constexpr double Spacing = 1.0 / Side;

/// A sheet of Side^2 random points at a height, that faces up or down, as light as it is high.
struct Sheet
{
  double Height, Up;
  bool TwoSided;
};

void Add(const Sheet& sheet, Random& random, TestCloud& cloud)
{
  for (int i = 0; i < Side * Side; ++i)
  {
    TestSurfel s;
    s.Position = { random.Uniform(0, 1), random.Uniform(0, 1), sheet.Height };
    s.Normal = { 0, 0, sheet.Up };
    s.Area = Spacing * Spacing;
    s.SigmaU = s.SigmaV = 0.5 * Spacing;
    const float shade = sheet.Height > 0.0 ? 1.0f : 0.0f;
    s.Color = { { shade, shade, shade, 1.0f } };
    s.TwoSided = sheet.TwoSided;
    cloud.Add(s);
  }
}

TestHierarchy MakeSheets(const std::vector<Sheet>& sheets)
{
  Random random(2);
  TestCloud cloud;
  for (const Sheet& sheet : sheets)
  {
    Add(sheet, random, cloud);
  }
  return TestHierarchy(cloud);
}

/// Mean overlap of a level's nodes in the sheet at a height, not of those that hold another as
/// well.
double MeanOverlap(const TestHierarchy& h, int level, double height)
{
  const SurfelCloud tree = h.Get();
  const std::size_t first = h.Order.Layout.Begin(level, HierarchyLayout::OneSided);
  double sum = 0.0, count = 0.0;
  for (std::size_t j = 0; j < h.Order.Layout.Count(level, HierarchyLayout::OneSided); ++j)
  {
    const bool counts = std::abs(tree.Position(first + j)[2] - height) < 0.01 * Spacing;
    sum += counts ? tree.OverlapOf(first + j) : 0.0;
    count += counts ? 1.0 : 0.0;
  }
  return sum / count;
}

/// The front one of two sheets is not covered, and hardly anything of the other is left, from nodes
/// of a seventh of the gap on.
TEST_CASE("Two sheets")
{
  const struct
  {
    double Gap; // in spacings of leaves
    int Level;
  } cases[] = { { 2.0, 2 }, { 4.0, 2 }, { 8.0, 3 }, { 16.0, 5 } };
  for (const auto& c : cases)
  {
    for (const double up : { 1.0, -1.0 })
    {
      const double height = c.Gap * Spacing;
      const TestHierarchy h = MakeSheets({ { 0.0, up, false }, { height, up, false } });
      CHECK(MeanOverlap(h, c.Level, up > 0.0 ? height : 0.0) == 0.0);
      CHECK(MeanOverlap(h, c.Level, up > 0.0 ? 0.0 : height) > 0.8);
    }
  }
}

/// Where there is less blur than the gap is wide, both sheets are seen from the side.
TEST_CASE("Sheets far apart")
{
  const double height = 16.0 * Spacing;
  const TestHierarchy h = MakeSheets({ { 0.0, 1.0, false }, { height, 1.0, false } });
  CHECK(MeanOverlap(h, 1, 0.0) == 0.0);
}

/// Overlaps of the surfels' own count as well, as means over their areas.
TEST_CASE("Own overlaps")
{
  Random random(3);
  TestCloud cloud;
  Add({ 0.0, 1.0, false }, random, cloud);
  for (std::size_t i = 0; i < cloud.Overlaps.size(); ++i)
  {
    cloud.Overlaps[i] = static_cast<unsigned char>(i % 2 == 0 ? 255 : 51);
  }
  const TestHierarchy h(cloud);
  const int top = h.Order.Layout.NumberOfLevels() - 1;
  CHECK(std::abs(MeanOverlap(h, top, 0.0) - 0.6) < 0.001);
}

/// Sheets that face away from one another, have two sides or lie closer than NearestSheet.
TEST_CASE("Uncovered sheets")
{
  const double near = 1.0 * Spacing, apart = 3.0 * Spacing;
  for (const TestHierarchy& h : { MakeSheets({ { 0.0, 1.0, false }, { apart, -1.0, false } }),
         MakeSheets({ { 0.0, 1.0, true }, { apart, 1.0, true } }),
         MakeSheets({ { 0.0, 1.0, false }, { near, 1.0, false } }),
         MakeSheets({ { 0.0, 1.0, false } }) })
  {
    CHECK(FindUncovered(h.Get(), h.Order.Layout, SerialExecutor()).empty());
  }
}

/// No part of a ball covers another.
TEST_CASE("Ball")
{
  Random random(4);
  TestCloud cloud;
  for (int i = 0; i < 5000; ++i)
  {
    TestSurfel s;
    const double z = random.Uniform(-1, 1), turn = random.Uniform(0, 2.0 * Pi);
    const double r = std::sqrt(1.0 - z * z);
    s.Position = s.Normal = { r * std::cos(turn), r * std::sin(turn), z };
    s.Area = 4.0 * Pi / 5000;
    cloud.Add(s);
  }
  const TestHierarchy h(cloud);
  CHECK(FindUncovered(h.Get(), h.Order.Layout, SerialExecutor()).empty());
}

/// Leaves that are not finite cover nothing, and are not covered.
TEST_CASE("Not finite")
{
  TestHierarchy h = MakeSheets({ { 0.0, 1.0, false }, { 3.0 * Spacing, 1.0, false } });
  const std::size_t bad[] = { 0, 1, 777, h.Order.Layout.NumberOfLeaves() - 1 };
  const float values[] = { std::nanf(""), INFINITY, -INFINITY, 3e38f };
  for (int k = 0; k < 4; ++k)
  {
    h.Positions[3 * bad[k] + static_cast<std::size_t>(k % 3)] = values[k];
  }
  const std::vector<float> uncovered = FindUncovered(h.Get(), h.Order.Layout, SerialExecutor());
  CHECK(uncovered.size() == h.Order.Layout.NumberOfLeaves());
  for (const float u : uncovered)
  {
    CHECK((u >= 0.0f && u <= 1.0f));
  }
}

/// Nodes of both sheets have the colour of the one in front.
TEST_CASE("Colours of nodes")
{
  const TestHierarchy h = MakeSheets({ { 0.0, 1.0, false }, { 3.0 * Spacing, 1.0, false } });
  for (int level = 7; level < h.Order.Layout.NumberOfLevels(); ++level)
  {
    const std::size_t first = h.Order.Layout.Begin(level, HierarchyLayout::OneSided);
    const std::size_t count = h.Order.Layout.Count(level, HierarchyLayout::OneSided);
    double sum = 0.0;
    for (std::size_t j = first; j < first + count; ++j)
    {
      sum += h.Get().Color(j)[0];
    }
    CHECK(sum / static_cast<double>(count) > 0.85); // the mean of both is 1/2
  }
}
}
