// SPDX-License-Identifier: BSD-3-Clause
// Colours of surfels: the splatted surface has those of the points at the points, without more
// noise than these have.
#include "SheetTesting.h"

#include "vtkSurfelNormalization.h"

#include "vtkUnsignedCharArray.h"

using namespace SurfelTesting;

namespace
{
/// The splatted colour at a point, the mean of the surfels' colours by their kernels.
double SplattedRed(const Surfels& surfels, vtkDataArray* colors, const Vec& x)
{
  double sum = 0.0, weights = 0.0;
  for (vtkIdType i = 0; i < surfels.Count(); ++i)
  {
    const Vec d = Minus(x, surfels.Position(i));
    if (Dot(d, d) < 16.0 * Spacing * Spacing)
    {
      const double weight = surfels.Kernel(i, x);
      weights += weight;
      sum += weight * colors->GetComponent(i, 0);
    }
  }
  return sum / weights;
}

/// What the splatted red lacks at the points, inside: 200 and 60 by turns, mixed where blurred.
std::vector<double> LacksAtPoints(vtkPolyData* points, vtkPolyData* made)
{
  const Surfels surfels(made);
  std::vector<double> lacks;
  for (vtkIdType i = 0; i < points->GetNumberOfPoints(); i += 7)
  {
    Vec p;
    points->GetPoint(i, p.data());
    if (p[0] > 0.1 && p[0] < 0.9 && p[1] > 0.1 && p[1] < 0.9)
    {
      const double own = points->GetPointData()->GetScalars()->GetComponent(i, 0);
      const double red = SplattedRed(surfels, made->GetPointData()->GetScalars(), p);
      lacks.push_back(own > 130.0 ? own - red : red - own);
    }
  }
  return lacks;
}

/// Root mean square.
double ErrorAtPoints(vtkPolyData* points, vtkPolyData* made)
{
  const Spread lacks(LacksAtPoints(points, made));
  return std::hypot(lacks.Mean, lacks.Deviation);
}

double BlurAtPoints(vtkPolyData* points, vtkPolyData* made)
{
  return Spread(LacksAtPoints(points, made)).Mean;
}

double MeanRed(vtkPolyData* data)
{
  double sum = 0.0;
  for (vtkIdType i = 0; i < data->GetNumberOfPoints(); ++i)
  {
    sum += data->GetPointData()->GetScalars()->GetComponent(i, 0);
  }
  return sum / static_cast<double>(data->GetNumberOfPoints());
}
}

TEST_CASE("Edges")
{
  const auto data = ToPolyData(MakeSheet(0.4));
  AddCheckers(data, 0.25); // of 200 and 60: there is room for overshoots
  constexpr int round = vtkSurfelEstimation::CIRCULAR; // not steered
  const auto plain = MakeSurfels(data, false, round), sharp = MakeSurfels(data, true, round);
  const double before = ErrorAtPoints(data, plain), after = ErrorAtPoints(data, sharp);
  CAPTURE(before);
  CAPTURE(after);
  CHECK(before > 4.0);
  // Van Cittert's first step squares what is lost: here some 0.5, apart from the rest of a checker
  // and from what kernels of one size lose where points are random.
  CHECK(after < 0.75 * before);
  CHECK(Near(MeanRed(sharp), MeanRed(data), 0.3));
  vtkDataArray* opacities = sharp->GetPointData()->GetScalars();
  for (vtkIdType i = 0; i < data->GetNumberOfPoints(); ++i)
  {
    REQUIRE(
      opacities->GetComponent(i, 3) == data->GetPointData()->GetScalars()->GetComponent(i, 3));
  }
}

/// Kernels of cells are long along edges: single points then have their colours no better, but
/// neither side of an edge takes the other one's in the mean.
TEST_CASE("SteeredEdges")
{
  const auto data = ToPolyData(MakeSheet(0.4));
  AddCheckers(data, 0.25);
  const auto plain = MakeSurfels(data, false), sharp = MakeSurfels(data, true);
  const double before = BlurAtPoints(data, plain), after = BlurAtPoints(data, sharp);
  CAPTURE(before);
  CAPTURE(after);
  CHECK(before > 0.5);
  CHECK(std::abs(after) < 0.5 * before);
}

/// What has no edges stays: one colour bit by bit, a ramp up to rounding and to random cells.
TEST_CASE("Smooth")
{
  const std::vector<Vec> points = MakeSheet(0.4);
  const auto data = ToPolyData(points);
  AddCheckers(data, 10.0);
  const auto one = MakeSurfels(data, true);
  auto* colors = vtkUnsignedCharArray::SafeDownCast(one->GetPointData()->GetScalars());
  REQUIRE(colors);
  for (vtkIdType i = 0; i < one->GetNumberOfPoints(); ++i)
  {
    REQUIRE(colors->GetComponent(i, 0) == data->GetPointData()->GetScalars()->GetComponent(0, 0));
  }
  auto* ramp = vtkUnsignedCharArray::SafeDownCast(data->GetPointData()->GetScalars());
  for (size_t i = 0; i < points.size(); ++i)
  {
    ramp->SetComponent(static_cast<vtkIdType>(i), 0, 50.0 + 100.0 * points[i][0]);
  }
  const auto changed = MakeSurfels(data, true);
  std::vector<double> changes;
  for (size_t i = 0; i < points.size(); ++i)
  {
    changes.push_back(changed->GetPointData()->GetScalars()->GetComponent(i, 0) -
      ramp->GetComponent(static_cast<vtkIdType>(i), 0));
  }
  CHECK(std::abs(Spread(changes).Mean) < 0.1);
  CHECK(Spread(changes).Deviation < 0.7);
}

/// Colours that have nothing to do with their neighbours' are noise, which is not sharpened.
TEST_CASE("Noise")
{
  const auto data = ToPolyData(MakeSheet(0.4));
  AddCheckers(data, 10.0);
  Random random(8);
  vtkDataArray* colors = data->GetPointData()->GetScalars();
  std::vector<double> reds, changes;
  for (vtkIdType i = 0; i < data->GetNumberOfPoints(); ++i)
  {
    colors->SetComponent(i, 0, 60.0 + 100.0 * random());
    reds.push_back(colors->GetComponent(i, 0));
  }
  const auto result = MakeSurfels(data, true);
  for (vtkIdType i = 0; i < data->GetNumberOfPoints(); ++i)
  {
    changes.push_back(result->GetPointData()->GetScalars()->GetComponent(i, 0) - reds[i]);
  }
  // All of the sharpening would be about half of the noise.
  CHECK(Spread(changes).Deviation < 0.1 * Spread(reds).Deviation);
}

/// A colour lies with the sheet that it is on: the other side of a leaf does not count.
TEST_CASE("Leaf")
{
  Sampled leaf =
    MakeRectangle({ 0, 0, 0 }, { 1, 0, 0 }, 1, { 0, 1, 0 }, 1, Spacing, 0.4, Random(1));
  const size_t front = leaf.Points.size();
  leaf.Append(MakeRectangle(
    { 0, 0, -0.8 * Spacing }, { 0, 1, 0 }, 1, { 1, 0, 0 }, 1, Spacing, 0.4, Random(2)));
  const auto data = ToPolyData(leaf.Points);
  AddNormals(data, leaf.Normals);
  AddCheckers(data, 10.0);
  vtkDataArray* colors = data->GetPointData()->GetScalars();
  for (vtkIdType i = static_cast<vtkIdType>(front); i < data->GetNumberOfPoints(); ++i)
  {
    colors->SetComponent(i, 0, 20.0);
  }
  const auto result = MakeSurfels(data, true);
  for (vtkIdType i = 0; i < data->GetNumberOfPoints(); ++i)
  {
    REQUIRE(result->GetPointData()->GetScalars()->GetComponent(i, 0) == colors->GetComponent(i, 0));
  }
}

/// Surfels have such colours already, and other arrays are the user's.
TEST_CASE("Again")
{
  const auto data = ToPolyData(MakeSheet(0.4));
  AddCheckers(data, 0.1);
  vtkNew<vtkUnsignedCharArray> other;
  other->DeepCopy(data->GetPointData()->GetScalars());
  other->SetName("Other");
  data->GetPointData()->AddArray(other);
  const auto once = MakeSurfels(data, true);
  const auto twice = MakeSurfels(once, true);
  int changed = 0;
  for (vtkIdType i = 0; i < data->GetNumberOfPoints(); ++i)
  {
    vtkPointData *first = once->GetPointData(), *second = twice->GetPointData();
    changed += first->GetScalars()->GetComponent(i, 0) != other->GetComponent(i, 0) ? 1 : 0;
    REQUIRE(first->GetScalars()->GetComponent(i, 0) == second->GetScalars()->GetComponent(i, 0));
    REQUIRE(first->GetArray("Other")->GetComponent(i, 0) == other->GetComponent(i, 0));
  }
  CHECK(changed > 100);
}
