// SPDX-License-Identifier: BSD-3-Clause
// Depth images whose 1/z is in whole steps become smooth; others stay as they are.
#include "SurfelTesting.h"

#include "vtkPointCloudCleaning.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

using namespace SurfelTesting;

namespace
{
constexpr int Columns = 320, Rows = 240;
constexpr double Focal = 262.5; // px
constexpr double Step = 0.0029; // 1/m, about that of the first Kinect
const Vec Sensor{ 0.5, -1.0, 2.0 };

/// A tilted floor that recedes from 1.8 to 3.8 m, and in front of its right half a wall at 1.2 m.
double TrueDepth(int x, int y)
{
  return x >= 220 ? 1.2 : 1.0 / (0.26 + 0.26 * y / Rows + 0.03 * x / Columns);
}

/// What a camera sees at Sensor, along z. @param step of 1/z; 0: exact
std::vector<Vec> See(double step)
{
  std::vector<Vec> points;
  for (int y = 0; y < Rows; ++y)
  {
    for (int x = 0; x < Columns; ++x)
    {
      const double disparity = 1.0 / TrueDepth(x, y);
      const double z = 1.0 / (step > 0.0 ? std::round(disparity / step) * step : disparity);
      points.push_back(
        { Sensor[0] + (x - 160) * z / Focal, Sensor[1] + (y - 120) * z / Focal, Sensor[2] + z });
    }
  }
  return points;
}

/// RMS error of 1/z on the floor, away from its borders.
double FloorError(vtkPoints* points)
{
  double sum = 0.0;
  int count = 0;
  for (int y = 12; y < Rows - 12; ++y)
  {
    for (int x = 12; x < 200; ++x)
    {
      const double z = points->GetPoint(y * Columns + x)[2] - Sensor[2];
      sum += std::pow(1.0 / z - 1.0 / TrueDepth(x, y), 2);
      ++count;
    }
  }
  return std::sqrt(sum / count);
}
}

TEST_CASE("Stairs become a floor")
{
  const auto data = ToPolyData(See(Step));
  vtkNew<vtkPointCloudCleaning> cleaning;
  cleaning->SetInputData(data);
  cleaning->SetColumns(Columns);
  cleaning->SetViewpoint(Sensor.data());
  cleaning->Update();
  vtkPolyData* output = cleaning->GetOutput();
  REQUIRE(output->GetNumberOfPoints() == Columns * Rows);
  CHECK(cleaning->GetNumberOfMovedPoints() > 0);
  const double before = FloorError(data->GetPoints()), after = FloorError(output->GetPoints());
  CHECK(before == doctest::Approx(Step / std::sqrt(12.0)).epsilon(0.1)); // of rounding
  CHECK(after < before / 3.0);                                           // 0.27 measured

  double wall = 0.0, aside = 0.0;
  for (int i = 0; i < Columns * Rows; ++i)
  {
    Vec p, q;
    data->GetPoint(i, p.data());
    output->GetPoint(i, q.data());
    const double z = p[2] - Sensor[2], moved = q[2] - Sensor[2];
    CHECK(std::abs(1.0 / moved - 1.0 / z) < 1.51 * Step);
    // Along the ray.
    aside = std::max(aside, std::abs((q[0] - Sensor[0]) / moved - (p[0] - Sensor[0]) / z));
    wall = i % Columns >= 220 ? std::max(wall, std::abs(moved - z)) : wall;
  }
  CHECK(aside < 1e-5);
  CHECK(wall < 1e-6); // flat, and the floor behind its edge is another surface
}

/// A floor near the camera, on which a row is a step and a half from the next one, and noise of
/// half a step: neighbours may be four steps apart, but they are of one surface.
TEST_CASE("Steep floors are not torn apart")
{
  Random random(3);
  std::vector<Vec> points;
  const auto disparity = [](int y) { return 0.3 + 1.5 * Step * y; };
  for (int i = 0; i < Columns * Rows; ++i)
  {
    const double noise = 0.5 * (random() + random() + random() + random() - 2.0) * std::sqrt(3.0);
    const double z = 1.0 / (Step * std::round(disparity(i / Columns) / Step + noise));
    points.push_back({ Sensor[0] + (i % Columns - 160) * z / Focal,
      Sensor[1] + (i / Columns - 120) * z / Focal, Sensor[2] + z });
  }
  vtkNew<vtkPointCloudCleaning> cleaning;
  cleaning->SetInputData(ToPolyData(points));
  cleaning->SetColumns(Columns);
  cleaning->SetViewpoint(Sensor.data());
  cleaning->Update();
  vtkPoints* smooth = cleaning->GetOutput()->GetPoints();
  REQUIRE(smooth->GetNumberOfPoints() == Columns * Rows);
  const auto disparityOf = [&](int i) { return 1.0 / (smooth->GetPoint(i)[2] - Sensor[2]); };
  double widest = 0.0, squared = 0.0;
  for (int i = 0; i < Columns * (Rows - 1); ++i)
  {
    const double gap = (disparityOf(i + Columns) - disparityOf(i)) / Step;
    widest = std::max(widest, std::abs(gap - 1.5));
    squared += std::pow((disparityOf(i) - disparity(i / Columns)) / Step, 2) / (Columns * Rows);
  }
  std::printf("steep floor: gaps off by %.2f steps at most, rms of 1/z %.2f steps\n", widest,
    std::sqrt(squared));
  CHECK(widest < 3.0);              // 4.5 with single neighbours
  CHECK(std::sqrt(squared) < 0.25); // 0.50
}

TEST_CASE("Other depths stay")
{
  const auto data = ToPolyData(See(0.0));
  vtkNew<vtkPointCloudCleaning> cleaning;
  cleaning->SetInputData(data);
  cleaning->SetColumns(Columns);
  cleaning->SetViewpoint(Sensor.data());
  cleaning->Update();
  CHECK(cleaning->GetNumberOfMovedPoints() == 0);
  CHECK(cleaning->GetOutput()->GetPoints() == data->GetPoints());
}

TEST_CASE("Columns that are none")
{
  vtkNew<vtkPointCloudCleaning> cleaning;
  const Messages said(cleaning);
  cleaning->SetInputData(ToPolyData(See(Step)));
  cleaning->SetColumns(7);
  cleaning->Update();
  REQUIRE(!said.Errors.empty());
  CHECK(said.Errors[0].find("Columns is 7") != std::string::npos);
}
