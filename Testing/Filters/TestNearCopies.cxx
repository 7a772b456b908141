// SPDX-License-Identifier: BSD-3-Clause
// Points that are there once more, nearly at the same place, are duplicates; what chance brings
// near to each other is not.
#include "CleaningTesting.h"

#include "vtkPointCloudCleaning.h"

#include <cmath>

using namespace SurfelTesting;

namespace
{
constexpr double Radius = 1.0;
constexpr size_t Count = 20000; // points are 0.025 apart

std::vector<Vec> Sphere()
{
  return MakeSphere(Radius, static_cast<int>(Count), Random(3)).Points;
}

/// Appends every so many of the first points again, with fewer digits.
void AppendRounded(size_t every, double unit, std::vector<Vec>& points)
{
  for (size_t i = 0; i < Count; i += every)
  {
    Vec p = points[i];
    for (double& x : p)
    {
      x = unit * std::round(x / unit);
    }
    points.push_back(p);
  }
}

vtkSmartPointer<vtkPolyData> Cleaned(const vtkSmartPointer<vtkPolyData>& data)
{
  vtkNew<vtkPointCloudCleaning> cleaning;
  const Messages said(cleaning);
  cleaning->SetInputData(data);
  cleaning->Update();
  CHECK(cleaning->GetNumberOfStrayPoints() == 0);
  CHECK(cleaning->GetNumberOfMovedPoints() == 0);
  CHECK(cleaning->GetNumberOfDuplicatePoints() + cleaning->GetOutput()->GetNumberOfPoints() ==
    data->GetNumberOfPoints());
  return cleaning->GetOutput();
}
}

TEST_CASE("Copies with fewer digits")
{
  for (const size_t every : { 1, 2, 10 })
  {
    CAPTURE(every);
    std::vector<Vec> points = Sphere();
    AppendRounded(every, 1e-4, points);
    const auto cleaned = Cleaned(ToPolyData(points, VTK_DOUBLE));
    // By chance another point is nearer than ten times what a copy is off its own.
    const auto kept = static_cast<double>(cleaned->GetNumberOfPoints());
    CHECK(kept < 1.001 * Count);
    CHECK(kept > 0.99 * Count);
  }
}

TEST_CASE("Two copies of each point, the first of them stay")
{
  std::vector<Vec> points = Sphere();
  AppendRounded(1, 1e-4, points);
  AppendRounded(1, 3e-4, points);
  const auto data = ToPolyData(points, VTK_DOUBLE);
  AddIds(data);
  const auto cleaned = Cleaned(data);
  vtkDataArray* ids = cleaned->GetPointData()->GetArray("Id");
  int first = 0;
  for (vtkIdType i = 0; i < ids->GetNumberOfTuples(); ++i)
  {
    first += ids->GetComponent(i, 0) < static_cast<double>(Count) ? 1 : 0;
  }
  CHECK(first > 0.98 * Count);
  CHECK(cleaned->GetNumberOfPoints() < 1.02 * Count);
}

TEST_CASE("Five copies of each point")
{
  std::vector<Vec> points = Sphere();
  for (const double unit : { 1e-4, 1.2e-4, 1.4e-4, 1.6e-4, 1.8e-4 })
  {
    AppendRounded(1, unit, points);
  }
  const auto kept = Cleaned(ToPolyData(points, VTK_DOUBLE))->GetNumberOfPoints();
  CHECK(kept < 1.05 * Count);
  CHECK(kept > 0.98 * Count);
}

TEST_CASE("What is near by chance stays")
{
  CHECK(Cleaned(ToPolyData(Sphere(), VTK_DOUBLE))->GetNumberOfPoints() == Count);
  // Random points on lines, as of a scanner that turns, are next to each other ten times as often.
  Random random(5);
  std::vector<Vec> lines;
  for (size_t i = 0; i < Count; ++i)
  {
    lines.push_back({ 200.0 * random(), static_cast<double>(i % 100), 0.0 });
  }
  CHECK(Cleaned(ToPolyData(lines, VTK_DOUBLE))->GetNumberOfPoints() == Count);
}

TEST_CASE("Two sides of a thin sheet stay, if normals tell them")
{
  const Sampled front =
    MakeRectangle({ 0, 0, 0 }, { 1, 0, 0 }, 2, { 0, 1, 0 }, 2, 0.02, 0.5, Random(1));
  std::vector<Vec> back = front.Points;
  for (Vec& p : back)
  {
    p[2] -= 1e-4;
  }
  const auto side = [](const std::vector<Vec>& points, double z, bool hasNormals) {
    const auto data = ToPolyData(points, VTK_DOUBLE);
    if (hasNormals)
    {
      AddNormals(data, std::vector<Vec>(points.size(), Vec{ 0, 0, z }));
    }
    return data;
  };
  for (const bool hasNormals : { true, false })
  {
    vtkIdType kept[2];
    ThreadController::Run(2, [&](vtkMultiProcessController* controller) {
      const int rank = controller->GetLocalProcessId();
      vtkNew<vtkPointCloudCleaning> cleaning;
      const Messages quiet(cleaning);
      cleaning->SetController(controller);
      cleaning->SetInputData(
        rank == 0 ? side(front.Points, 1, hasNormals) : side(back, -1, hasNormals));
      cleaning->Update();
      kept[rank] = cleaning->GetOutput()->GetNumberOfPoints();
    });
    CHECK(kept[0] == static_cast<vtkIdType>(front.Points.size()));
    CHECK(kept[1] == (hasNormals ? kept[0] : 0));
  }
  Sampled both = front;
  both.Append({ back, std::vector<Vec>(back.size(), Vec{ 0, 0, -1 }) });
  const auto sheet = ToPolyData(both.Points, VTK_DOUBLE);
  AddNormals(sheet, both.Normals);
  CHECK(Cleaned(sheet)->GetNumberOfPoints() == sheet->GetNumberOfPoints());
}

TEST_CASE("Several processes drop the same copies")
{
  std::vector<Vec> points = Sphere();
  AppendRounded(2, 1e-4, points);
  CHECK(CompareWithProcesses(points) == 0);
}
