// SPDX-License-Identifier: BSD-3-Clause
// Stray points beside wires and far off are removed; sparse patches and folds and far foliage stay.
#include "CleaningTesting.h"

#include "vtkPointCloudCleaning.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <tuple>
#include <vector>

using namespace SurfelTesting;

namespace
{
/// Places in the array of the points that are removed as stray.
std::vector<double> StrayIds(const std::vector<Vec>& points)
{
  vtkNew<vtkPointCloudCleaning> cleaning;
  const Messages quiet(cleaning);
  const auto data = ToPolyData(points);
  AddIds(data);
  cleaning->GenerateStrayPointsOn();
  cleaning->SetInputData(data);
  cleaning->Update();
  vtkDataArray* stray = cleaning->GetOutput(1)->GetPointData()->GetArray("Id");
  REQUIRE(stray);
  std::vector<double> ids;
  for (vtkIdType i = 0; i < stray->GetNumberOfTuples(); ++i)
  {
    ids.push_back(stray->GetComponent(i, 0));
  }
  return ids;
}
}

/// Sixteen points of a wire reach eight spacings far: a stray point that is as far beside it is
/// found by the nearest few alone.
TEST_CASE("Stray points beside wires")
{
  constexpr double spacing = 0.01;
  constexpr int wires = 20, perWire = 200;
  Random random(11);
  std::vector<Vec> points;
  for (int k = 0; k < wires * perWire; ++k)
  {
    const double along = k % perWire + 0.4 * random(), beside = 60.0 * (k / perWire);
    points.push_back({ spacing * along, spacing * (beside + random()), spacing * random() });
  }
  const size_t good = points.size();
  for (int k = 0; k < wires * 4; ++k)
  {
    const double angle = 2.0 * Pi * random(), distance = 6.0 + 5.0 * random();
    const double along = 25.0 + 50.0 * (k % 4), beside = 60.0 * (k / 4);
    points.push_back({ spacing * along, spacing * (beside + distance * std::cos(angle)),
      spacing * distance * std::sin(angle) });
  }
  const std::vector<double> stray = StrayIds(points);
  for (const double id : stray)
  {
    CHECK(id >= static_cast<double>(good));
  }
  CHECK(static_cast<double>(stray.size()) > 0.97 * static_cast<double>(points.size() - good));
}

/// A floor, and many stray points in the void over it. Those that are a little over the floor have
/// nothing but points of it about them: such a set is flat, but they tell nothing of a surface.
TEST_CASE("Stray points in a void")
{
  std::vector<Vec> points =
    MakeRectangle({ 0, 0, 0 }, { 1, 0, 0 }, 2, { 0, 1, 0 }, 2, 0.008, 0.4, Random(3)).Points;
  const size_t good = points.size();
  Random random(12);
  for (size_t i = 0; i < good / 16; ++i)
  {
    const double x = 2.0 * random(), y = 2.0 * random(), z = random();
    points.push_back({ x, y, 0.05 + 1.5 * z });
  }
  vtkNew<vtkPointCloudCleaning> cleaning;
  const Messages quiet(cleaning);
  cleaning->SetInputData(ToPolyData(points));
  cleaning->Update();
  CAPTURE(good);
  CHECK(cleaning->GetNumberOfStrayPoints() == static_cast<vtkIdType>(points.size() - good));
}

/// Wires that stand on a much sparser floor: the nearest few neighbours of points of the floor
/// beside a wire are on the wire.
TEST_CASE("Dense wires on a sparse floor")
{
  constexpr int side = 6, perWire = 100;
  std::vector<Vec> points =
    MakeRectangle({ 0, 0, 0 }, { 1, 0, 0 }, 3, { 0, 1, 0 }, 3, 0.02, 0.4, Random(4)).Points;
  const size_t onFloor = points.size();
  for (int k = 0; k < side * side * perWire; ++k)
  {
    const int wire = k / perWire;
    points.push_back(
      { 0.25 + 0.5 * (wire % side), 0.25 + 0.5 * (wire / side), 0.002 * (1 + k % perWire) });
  }
  vtkNew<vtkPointCloudCleaning> cleaning;
  const Messages quiet(cleaning);
  cleaning->SetInputData(ToPolyData(points));
  cleaning->Update();
  CAPTURE(onFloor);
  CHECK(cleaning->GetNumberOfStrayPoints() == 0);
}

/// Nine points that are near each other, but sparse, and far from the rest: with seven points of
/// the rest their sets look flat. A sparse patch of as many points as a set has, and more, stays.
TEST_CASE("A few points far off")
{
  const Sampled wall =
    MakeRectangle({ 0, 0, 0 }, { 1, 0, 0 }, 2, { 0, 1, 0 }, 2, 0.01, 0.4, Random(3));
  for (const bool patch : { false, true })
  {
    std::vector<Vec> points = wall.Points;
    Random random(6);
    for (int i = 0; i < (patch ? 36 : 9); ++i)
    {
      const double x = random(), y = random(), z = random();
      points.push_back(patch ? Vec{ 0.7 + 0.1 * (i % 6), 0.7 + 0.1 * (i / 6), 1.0 }
                             : Vec{ 0.9 + 0.3 * x, 0.9 + 0.3 * y, 1.0 + 0.3 * z });
    }
    vtkNew<vtkPointCloudCleaning> cleaning;
    const auto data = ToPolyData(points);
    cleaning->SetInputData(data);
    cleaning->Update();
    CAPTURE(patch);
    CHECK(cleaning->GetNumberOfStrayPoints() == (patch ? 0 : 9));
  }
}

/// A scan whose spacing grows with the distance: near ground with most of the points, and far
/// ground with foliage on it, whose points fill space.
TEST_CASE("Far foliage")
{
  Random random(7);
  std::vector<Vec> points =
    MakeRectangle({ 0, 0, 0 }, { 1, 0, 0 }, 2, { 0, 1, 0 }, 4, 0.01, 0.4, Random(3)).Points;
  const double spacing = 0.1;
  const Sampled ground =
    MakeRectangle({ 5, 0, 0 }, { 1, 0, 0 }, 6, { 0, 1, 0 }, 6, spacing, 0.4, Random(4));
  points.insert(points.end(), ground.Points.begin(), ground.Points.end());
  // As many points per area as the ground has, spread over 12 spacings.
  for (size_t i = 0; i < ground.Points.size(); ++i)
  {
    const double x = random(), y = random(), z = random();
    points.push_back({ 5 + 6 * x, 6 * y, 12 * spacing * z });
  }
  vtkNew<vtkPointCloudCleaning> cleaning;
  const auto data = ToPolyData(points);
  cleaning->SetInputData(data);
  cleaning->Update();
  // Chance leaves some at the border of the foliage alone.
  CHECK(cleaning->GetNumberOfStrayPoints() <= 0.02 * ground.Points.size());
}

/// A box whose one end was scanned from near, and the other from far, beside much dense ground:
/// where its faces meet, points of the far end are in no plane, and much sparser than what is usual
/// about them. Stray points over it are as sparse, and go.
TEST_CASE("Folds of a sparse end")
{
  std::vector<Vec> points =
    MakeRectangle({ 0, 0, 0 }, { 1, 0, 0 }, 4, { 0, 1, 0 }, 5, 0.01, 0.4, Random(3)).Points;
  constexpr double width = 0.4, height = 0.3, dense = 0.01, sparse = 0.07, begin = 5.0;
  const Vec x = { 1, 0, 0 }, y = { 0, 1, 0 }, z = { 0, 0, 1 };
  for (const auto& [at, spacing] : { std::pair(begin - 1.0, dense), std::pair(begin, sparse) })
  {
    for (const auto& [from, u, side] : { std::tuple(Vec{ at, 0, 0 }, y, width),
           std::tuple(Vec{ at, 0, 0 }, z, height), std::tuple(Vec{ at, width, 0 }, z, height) })
    {
      const Sampled face = MakeRectangle(from, x, 1, u, side, spacing, 0.4, Random(4));
      points.insert(points.end(), face.Points.begin(), face.Points.end());
    }
  }
  const size_t good = points.size();
  Random random(8);
  for (int i = 0; i < 300; ++i)
  {
    const double a = random(), b = random(), c = random();
    points.push_back({ 4 + 2 * a, -1 + 2 * b, 0.8 + c });
  }
  const std::vector<double> stray = StrayIds(points);
  const auto ofBox = std::count_if(
    stray.begin(), stray.end(), [good](double id) { return id < static_cast<double>(good); });
  CAPTURE(ofBox);
  CHECK(ofBox <= 12); // those beside the dense end are three times as far from others as these
  CHECK(static_cast<std::ptrdiff_t>(stray.size()) - ofBox > 285);
}
