// SPDX-License-Identifier: BSD-3-Clause
// Several processes estimate and weight one cloud's surfels: they are those of one process, at
// seams as well, however the points are spread; what is dropped, what is given, and processes that
// have nothing, cannot or are stopped.
#include "SurfelTesting.h"
#include "ThreadController.h"

#include "vtkPointsToSurfels.h"
#include "vtkSurfelEstimation.h"
#include "vtkSurfelNormalization.h"

#include "vtkFieldData.h"
#include "vtkFloatArray.h"
#include "vtkIntArray.h"

#include <algorithm>
#include <iterator>
#include <limits>

using namespace SurfelTesting;

namespace
{
/// A ball that is closed, a wall that is not, and a few points that are dropped.
std::vector<Vec> MakePoints()
{
  std::vector<Vec> points = MakeBallAndWall(12000, -1.5, 0.06).Points;
  points[5] = points[11000]; // the later one is dropped
  points[77][1] = std::numeric_limits<double>::quiet_NaN();
  return points;
}

vtkSmartPointer<vtkPolyData> WithNumbers(const std::vector<Vec>& points, int first)
{
  auto data = ToPolyData(points, VTK_DOUBLE);
  vtkNew<vtkIntArray> numbers;
  numbers->SetName("number");
  for (std::size_t i = 0; i < points.size(); ++i)
  {
    numbers->InsertNextValue(first + static_cast<int>(i));
  }
  data->GetPointData()->AddArray(numbers);
  AddCheckers(data, 0.3);
  return data;
}

using Change = std::function<void(vtkSurfelEstimation*)>;

vtkSmartPointer<vtkPolyData> Estimate(
  vtkPolyData* data, vtkMultiProcessController* controller, const Change& change = Change())
{
  vtkNew<vtkSurfelEstimation> estimation;
  vtkNew<vtkSurfelNormalization> normalization;
  const Messages quiet(estimation), quietToo(normalization);
  estimation->SetController(controller);
  normalization->SetController(controller);
  estimation->SetInputData(data);
  if (change)
  {
    change(estimation);
  }
  normalization->SetInputConnection(estimation->GetOutputPort());
  normalization->Update();
  return normalization->GetOutput();
}

/// Distributes the points to processes: the process of point i.
using Owner = std::function<int(const Vec&, int)>;

/// Each process's surfels must be those of one process, tuple by tuple.
void Compare(
  const std::vector<Vec>& points, int ranks, const Owner& owner, const Change& change = Change())
{
  // As one process has them: one rank's after the other's.
  std::vector<std::vector<Vec>> parts(static_cast<std::size_t>(ranks));
  std::vector<Vec> whole;
  for (int rank = 0; rank < ranks; ++rank)
  {
    for (std::size_t i = 0; i < points.size(); ++i)
    {
      if (owner(points[i], static_cast<int>(i)) == rank)
      {
        parts[rank].push_back(points[i]);
      }
    }
    whole.insert(whole.end(), parts[rank].begin(), parts[rank].end());
  }
  const auto expected = Estimate(WithNumbers(whole, 0), nullptr, change);
  std::vector<vtkSmartPointer<vtkPolyData>> found(parts.size());
  std::vector<int> firsts(1, 0);
  for (const auto& part : parts)
  {
    firsts.push_back(firsts.back() + static_cast<int>(part.size()));
  }
  ThreadController::Run(ranks, [&](vtkMultiProcessController* controller) {
    const int rank = controller->GetLocalProcessId();
    found[rank] = Estimate(WithNumbers(parts[rank], firsts[rank]), controller, change);
  });

  const Surfels one(expected);
  vtkIdType at = 0;
  double position = 0.0, area = 0.0, covariance = 0.0, overlap = 0.0;
  int sides = 0;
  for (const auto& part : found)
  {
    const Surfels some(part);
    for (vtkIdType i = 0; i < part->GetNumberOfPoints() && at < one.Count(); ++i, ++at)
    {
      CHECK(part->GetPointData()->GetArray("number")->GetTuple1(i) ==
        expected->GetPointData()->GetArray("number")->GetTuple1(at));
      for (int c = 0; c < 4; ++c)
      {
        REQUIRE(part->GetPointData()->GetScalars()->GetComponent(i, c) ==
          expected->GetPointData()->GetScalars()->GetComponent(at, c));
      }
      const double size = one.Area(at);
      position =
        std::max(position, Length(Minus(some.Position(i), one.Position(at))) / std::sqrt(size));
      Vec a = some.AreaVector(i);
      if (one.IsTwoSided(at) && Dot(a, one.AreaVector(at)) < 0.0)
      {
        a = { -a[0], -a[1], -a[2] };
      }
      area = std::max(area, Length(Minus(a, one.AreaVector(at))) / size);
      for (int c = 0; c < 6; ++c)
      {
        covariance =
          std::max(covariance, std::abs(some.Covariance(i)[c] - one.Covariance(at)[c]) / size);
      }
      sides += some.IsTwoSided(i) != one.IsTwoSided(at) ? 1 : 0;
      overlap = std::max(overlap, std::abs(some.Overlap(i) - one.Overlap(at)));
    }
  }
  CHECK(at == one.Count());
  CHECK(position <= 1e-4);
  CHECK(area <= 1e-3);
  CHECK(overlap <= 1.001 / 255.0);
  CHECK(covariance <= 1e-4);
  CHECK(sides == 0);
}

TEST_CASE("Same surfels")
{
  const std::vector<Vec> points = MakePoints();
  const Owner halves = [](const Vec& p, int) { return p[0] < 0.1 ? 0 : 1; };
  const Owner mixed = [](const Vec&, int i) { return i % 3; };
  const Owner last = [](const Vec&, int) { return 3; };
  Compare(points, 2, halves);
  Compare(points, 3, mixed);
  Compare(points, 4, last); // the others have nothing
  Compare(points, 2, halves, [](vtkSurfelEstimation* estimation) {
    estimation->SetOrientationModeToViewpoint();
    estimation->SetViewpoint(0, 0, 9);
  });
  Compare(points, 2, mixed, [](vtkSurfelEstimation* estimation) {
    estimation->SetUseViewpoint(1);
    estimation->SetViewpoint(0, 0, 9);
    estimation->SetKernelModeToElliptical();
  });
}

/// Sheets that overlap, in several processes.
TEST_CASE("Overlapping sheets")
{
  const Vec u{ 1, 0, 0 }, v{ 0, 1, 0 };
  Sampled sheets = MakeRectangle({ 0, 0, 0 }, u, 1, v, 1, 0.02, 1.0, Random(9));
  sheets.Append(MakeRectangle({ 0, 0, -0.024 }, u, 1, v, 1, 0.02, 1.0, Random(10)));
  const Change change = [](vtkSurfelEstimation* estimation) {
    estimation->SetOrientationModeToTwoSided();
  };
  const auto one = Estimate(ToPolyData(sheets.Points), nullptr, change);
  CHECK(one->GetPointData()->GetArray("SurfelOverlap")->GetRange()[1] > 100.0);
  Compare(
    sheets.Points, 2, [](const Vec& p, int) { return p[0] < 0.5 ? 0 : 1; }, change);
}

/// All filters in one, in several processes: the surfels of the single filters.
TEST_CASE("Points to surfels")
{
  const std::vector<Vec> points = MakePoints();
  const std::size_t half = points.size() / 2;
  const std::vector<Vec> parts[2] = { { points.begin(), points.begin() + half },
    { points.begin() + half, points.end() } };
  vtkIdType differing[2] = { 0, 0 }, counts[2] = { 0, 0 };
  ThreadController::Run(2, [&](vtkMultiProcessController* controller) {
    const int rank = controller->GetLocalProcessId();
    const auto data = WithNumbers(parts[rank], 0);
    const auto expected = Estimate(data, controller);
    vtkNew<vtkPointsToSurfels> filter;
    const Messages quiet(filter);
    filter->SetController(controller);
    filter->BuildHierarchyOff();
    filter->SetInputData(data);
    filter->Update();
    const Surfels some(filter->GetOutput()), single(expected);
    counts[rank] = some.Count() == single.Count() ? some.Count() : 0;
    for (vtkIdType i = 0; i < counts[rank]; ++i)
    {
      differing[rank] += some.Position(i) != single.Position(i) ||
          some.AreaVector(i) != single.AreaVector(i) || some.Covariance(i) != single.Covariance(i)
        ? 1
        : 0;
    }
  });
  for (const int rank : { 0, 1 })
  {
    CHECK(counts[rank] > 1000);
    CHECK(differing[rank] == 0);
  }
}

namespace
{
/// Number of surfels that do not face a place, or are two-sided.
vtkIdType CountAway(vtkPolyData* data, const Vec& place)
{
  const Surfels surfels(data);
  vtkIdType away = 0;
  for (vtkIdType i = 0; i < surfels.Count(); ++i)
  {
    const bool faces = Dot(surfels.AreaVector(i), Minus(place, surfels.Position(i))) > 0.0;
    away += faces && !surfels.IsTwoSided(i) ? 0 : 1;
  }
  return away;
}
}

/// Only one process has read the file and knows the sensor; the pieces together are the scan.
TEST_CASE("Sensor")
{
  const std::vector<Vec> points = MakeBallAndWall(6000, -1.5, 0.06).Points;
  const Vec place = { 5.0, -6.0, 7.0 };
  double bounds[6];
  ToPolyData(points, VTK_DOUBLE)->GetBounds(bounds);
  for (const bool isMoved : { false, true })
  {
    vtkIdType away[2] = { 0, 0 }, counts[2] = { 0, 0 };
    ThreadController::Run(2, [&](vtkMultiProcessController* controller) {
      const int rank = controller->GetLocalProcessId();
      std::vector<Vec> part;
      std::copy_if(points.begin(), points.end(), std::back_inserter(part),
        [rank](const Vec& p) { return (p[0] < 0.1) == (rank == 0); });
      const auto data = WithNumbers(part, 0);
      if (rank == 1)
      {
        AddField("ScanViewpoint", { place[0], place[1], place[2] }, data);
        AddField("ScanBounds",
          { bounds[0], bounds[1] + (isMoved ? 1.0 : 0.0), bounds[2], bounds[3], bounds[4],
            bounds[5] },
          data);
      }
      vtkNew<vtkPointsToSurfels> filter;
      const Messages quiet(filter);
      filter->SetController(controller);
      filter->BuildHierarchyOff();
      filter->SetInputData(data);
      filter->Update();
      counts[rank] = filter->GetOutput()->GetNumberOfPoints();
      away[rank] = CountAway(filter->GetOutput(), place);
    });
    for (const int rank : { 0, 1 })
    {
      CHECK(counts[rank] > 500);
      CHECK((away[rank] > 0) == isMoved);
    }
  }
}

/// Far from the origin, where floats lose detail, and fewer points than processes.
TEST_CASE("Odd clouds")
{
  std::vector<Vec> points = MakePoints();
  for (Vec& p : points)
  {
    p = { p[0] + 500000.0, p[1] + 5200000.0, p[2] + 300.0 };
  }
  Compare(points, 2, [](const Vec&, int i) { return i % 2; });
  Compare({}, 2, [](const Vec&, int) { return 0; });
  // Two sheets far apart, whose regions have origins of their own, and a viewpoint between them.
  std::vector<Vec> sheets;
  for (const double x : { -40.0, 40.0 })
  {
    const Sampled sheet =
      MakeRectangle({ x, -0.5, -0.5 }, { 0, 1, 0 }, 1.0, { 0, 0, 1 }, 1.0, 0.03, 1.0, Random(4));
    sheets.insert(sheets.end(), sheet.Points.begin(), sheet.Points.end());
  }
  Compare(
    sheets, 2, [](const Vec& p, int) { return p[0] < 0 ? 0 : 1; },
    [](vtkSurfelEstimation* estimation) {
      estimation->SetUseViewpoint(1);
      estimation->SetViewpoint(0, 0, 0);
    });
  // Two points have no normals to compare, and of fifty at one place one is left.
  std::vector<vtkIdType> two(4), one(4);
  ThreadController::Run(4, [&](vtkMultiProcessController* controller) {
    const int rank = controller->GetLocalProcessId();
    std::vector<Vec> ownPoints;
    if (rank % 2 == 0)
    {
      ownPoints.push_back({ 1.0 * rank, 0, 0 });
    }
    two[rank] = Estimate(ToPolyData(ownPoints), controller)->GetNumberOfPoints();
    const std::vector<Vec> alike(12, Vec{ 1, 2, 3 });
    one[rank] = Estimate(ToPolyData(alike), controller)->GetNumberOfPoints();
  });
  CHECK(two == std::vector<vtkIdType>({ 1, 0, 1, 0 }));
  CHECK(one == std::vector<vtkIdType>({ 1, 0, 0, 0 }));
}

/// One process that cannot or is stopped ends it for all; none waits.
TEST_CASE("Troubles")
{
  const std::vector<Vec> points = MakePoints();
  std::vector<vtkIdType> sizes(3, -1);
  std::vector<std::size_t> errors(3, 0);
  const auto run = [&](const std::function<void(vtkSurfelEstimation*, int)>& change) {
    ThreadController::Run(3, [&](vtkMultiProcessController* controller) {
      const int rank = controller->GetLocalProcessId();
      vtkNew<vtkSurfelEstimation> estimation;
      Messages messages(estimation);
      estimation->SetController(controller);
      estimation->SetInputData(ToPolyData(points));
      change(estimation, rank);
      estimation->Update();
      sizes[rank] = estimation->GetOutput()->GetNumberOfPoints();
      errors[rank] = messages.Errors.size();
    });
  };
  run([](vtkSurfelEstimation* estimation, int rank) {
    if (rank == 1)
    {
      estimation->SetNeighborhoodModeToRadius(); // without a radius
    }
  });
  for (int rank = 0; rank < 3; ++rank)
  {
    CHECK(sizes[rank] == 0);
    CHECK(errors[rank] > 0);
  }
  for (const int stopped : { 0, 2 })
  {
    for (const double at : { 0.3, 0.7, 0.95 })
    {
      run([&](vtkSurfelEstimation* estimation, int rank) {
        if (rank == stopped)
        {
          vtkNew<vtkCallbackCommand> stop;
          static thread_local double limit;
          limit = at;
          stop->SetCallback([](vtkObject* object, unsigned long, void*, void* progress) {
            if (*static_cast<double*>(progress) > limit)
            {
              static_cast<vtkAlgorithm*>(object)->SetAbortExecute(1);
            }
          });
          estimation->AddObserver(vtkCommand::ProgressEvent, stop);
        }
      });
      for (int rank = 0; rank < 3; ++rank)
      {
        CHECK(sizes[rank] == 0);
        CHECK(errors[rank] == 0);
      }
    }
  }
}

/// Normals that some processes' points have and others' have not.
TEST_CASE("Given normals")
{
  const Sampled sphere = MakeSphere(1.0, 9000, Random(3));
  std::vector<vtkIdType> inward(2, 0), twoSided(2, 0);
  ThreadController::Run(2, [&](vtkMultiProcessController* controller) {
    const int rank = controller->GetLocalProcessId();
    std::vector<Vec> points, normals;
    for (std::size_t i = 0; i < sphere.Points.size(); ++i)
    {
      if ((sphere.Points[i][2] < 0.2) == (rank == 0))
      {
        points.push_back(sphere.Points[i]);
        const Vec& n = sphere.Normals[i];
        normals.push_back({ -n[0], -n[1], -n[2] });
      }
    }
    auto data = ToPolyData(points);
    if (rank == 1)
    {
      AddNormals(data, normals);
    }
    const auto surfels = Estimate(data, controller);
    const Surfels read(surfels);
    for (vtkIdType i = 0; i < read.Count(); ++i)
    {
      inward[rank] += Dot(read.Normal(i), read.Position(i)) < 0.0 ? 1 : 0;
      twoSided[rank] += read.IsTwoSided(i) ? 1 : 0;
    }
    CHECK(read.Count() == static_cast<vtkIdType>(points.size()));
    CHECK(inward[rank] == read.Count()); // all follow those that are given
    CHECK(twoSided[rank] == 0);
  });
}
}
