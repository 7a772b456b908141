// SPDX-License-Identifier: BSD-3-Clause
// All filters in one against the single filters, which search for neighbours on their own.
#include "ProgressWatch.h"
#include "SurfelTesting.h"

#include "vtkPartitionedSurfelEstimation.h"
#include "vtkPointCloudCleaning.h"
#include "vtkPointsToSurfels.h"
#include "vtkSurfelEstimation.h"
#include "vtkSurfelHierarchy.h"
#include "vtkSurfelNormalization.h"

#include "vtkDataSetAttributes.h"
#include "vtkIdTypeArray.h"
#include "vtkUnsignedCharArray.h"

#include <algorithm>
#include <cmath>
#include <cstring>

using namespace SurfelTesting;

namespace
{
vtkSmartPointer<vtkPolyData> MakeScene()
{
  return ToPolyData(MakeBallAndWall(12000, -1.1, 0.04).Points);
}

vtkSmartPointer<vtkPolyData> BySingleFilters(vtkPolyData* data, vtkPointsToSurfels* settings)
{
  vtkNew<vtkSurfelEstimation> estimation;
  vtkNew<vtkSurfelNormalization> normalization;
  vtkNew<vtkSurfelHierarchy> hierarchy;
  estimation->CopySettings(settings->GetEstimation());
  normalization->CopySettings(settings->GetNormalization());
  estimation->SetInputData(data);
  normalization->SetInputConnection(estimation->GetOutputPort());
  hierarchy->SetInputConnection(normalization->GetOutputPort());
  if (settings->GetBuildHierarchy())
  {
    hierarchy->Update();
    return hierarchy->GetOutput();
  }
  normalization->Update();
  return normalization->GetOutput();
}

vtkSmartPointer<vtkPolyData> ByOneFilter(vtkPolyData* data, vtkPointsToSurfels* filter)
{
  filter->SetInputData(data);
  filter->Update();
  vtkNew<vtkPolyData> result;
  result->ShallowCopy(filter->GetOutput());
  return result;
}

bool SameArray(vtkDataArray* a, vtkDataArray* b)
{
  return a && b && a->GetDataSize() == b->GetDataSize() && a->GetDataSize() > 0 &&
    std::memcmp(a->GetVoidPointer(0), b->GetVoidPointer(0),
      static_cast<size_t>(a->GetDataSize()) * a->GetDataTypeSize()) == 0;
}

bool SamePlaces(vtkPolyData* a, vtkPolyData* b)
{
  return SameArray(a->GetPoints()->GetData(), b->GetPoints()->GetData()) &&
    SameArray(a->GetPointData()->GetArray("SurfelCovariance"),
      b->GetPointData()->GetArray("SurfelCovariance"));
}

bool SameWeights(vtkPolyData* a, vtkPolyData* b)
{
  return SameArray(a->GetPointData()->GetArray("SurfelAreaVector"),
    b->GetPointData()->GetArray("SurfelAreaVector"));
}

TEST_CASE("Stray points are removed first")
{
  const auto clean = MakeScene();
  vtkNew<vtkPolyData> dusty;
  dusty->DeepCopy(clean);
  const vtkIdType count = clean->GetNumberOfPoints();
  for (int i = 0; i < 20; ++i) // scattered in a box of 6 x 6 x 6
  {
    dusty->GetPoints()->InsertNextPoint(2.0 + 6.0 * std::fmod(0.618 * i, 1.0),
      6.0 * std::fmod(0.755 * i, 1.0), 6.0 * std::fmod(0.570 * i, 1.0));
  }
  vtkNew<vtkPointsToSurfels> filter;
  filter->BuildHierarchyOff();
  const auto wanted = ByOneFilter(clean, filter);
  CHECK(filter->GetCleaning()->GetNumberOfStrayPoints() == 0);
  const auto cleaned = ByOneFilter(dusty, filter);
  CHECK(filter->GetCleaning()->GetNumberOfStrayPoints() == 20);
  CHECK(SamePlaces(cleaned, wanted));
  CHECK(SameWeights(cleaned, wanted));
  filter->CleanPointsOff();
  CHECK(ByOneFilter(dusty, filter)->GetNumberOfPoints() == count + 20);
}

/// Blanked points, as those of a grid of which a part was hidden.
TEST_CASE("Hidden points")
{
  const auto data = MakeScene();
  vtkNew<vtkUnsignedCharArray> ghosts;
  ghosts->SetName(vtkDataSetAttributes::GhostArrayName());
  std::vector<Vec> seen;
  for (vtkIdType i = 0; i < data->GetNumberOfPoints(); ++i)
  {
    double p[3];
    data->GetPoint(i, p);
    const bool isHidden = p[2] > 0.3;
    ghosts->InsertNextValue(isHidden ? vtkDataSetAttributes::HIDDENPOINT : 0);
    if (!isHidden)
    {
      seen.push_back({ p[0], p[1], p[2] });
    }
  }
  data->GetPointData()->AddArray(ghosts);
  vtkNew<vtkPointsToSurfels> filter;
  filter->BuildHierarchyOff();
  CHECK(SamePlaces(ByOneFilter(data, filter), ByOneFilter(ToPolyData(seen), filter)));
  filter->CleanPointsOff();
  CHECK(SamePlaces(ByOneFilter(data, filter), ByOneFilter(ToPolyData(seen), filter)));
  vtkNew<vtkPartitionedSurfelEstimation> parts;
  parts->SetInputData(data);
  parts->Update();
  CHECK(parts->GetOutput()->GetNumberOfPoints() == static_cast<vtkIdType>(seen.size()));
  CHECK(std::isfinite(data->GetPoints()->GetBounds()[5])); // the input is as it was
}

TEST_CASE("Surfels of the single filters")
{
  const auto data = MakeScene();
  vtkNew<vtkPointsToSurfels> filter;
  filter->BuildHierarchyOff();
  const auto one = ByOneFilter(data, filter);
  const auto single = BySingleFilters(data, filter);
  CHECK(SamePlaces(one, single));
  CHECK(!SameWeights(one, single)); // the neighbours are shared
  const Surfels a(one), b(single);
  vtkIdType differing = 0;
  for (vtkIdType i = 0; i < a.Count(); ++i)
  {
    differing += std::abs(a.Area(i) / b.Area(i) - 1.0) > 0.01 ? 1 : 0;
  }
  CHECK(differing <= 0.01 * a.Count());
  CHECK_NEAR(a.TotalArea() / b.TotalArea(), 1.0, 1e-4);
  CHECK_NEAR(filter->GetNormalization()->GetTotalAreaAfter() / a.TotalArea(), 1.0, 1e-5);
}

/// Where random points leave voids, kernels lie off their points, which have all neighbours on one
/// side: the weights are those of neighbours about the kernels.
TEST_CASE("Voids")
{
  Random random(1);
  std::vector<Vec> points;
  while (points.size() < 20000)
  {
    const Vec p{ 2.0 * random() - 1.0, 2.0 * random() - 1.0, 2.0 * random() - 1.0 };
    const double length = Length(p);
    if (length > 0.1 && length < 1.0)
    {
      points.push_back({ p[0] / length, p[1] / length, p[2] / length });
    }
  }
  vtkNew<vtkPointsToSurfels> filter;
  filter->BuildHierarchyOff();
  const auto one = ByOneFilter(ToPolyData(points), filter);
  const auto single = BySingleFilters(ToPolyData(points), filter);
  const Surfels a(one), b(single);
  vtkIdType differing = 0;
  for (vtkIdType i = 0; i < a.Count(); ++i)
  {
    differing += std::abs(a.Area(i) / b.Area(i) - 1.0) > 0.2 ? 1 : 0;
  }
  CHECK(differing <= 20); // 10; with neighbours about the points 37
}

/// The hierarchy reads the surfels in another order than the arrays of their points.
TEST_CASE("Arrays of points in a hierarchy")
{
  const auto data = MakeScene();
  const auto numbers = vtkSmartPointer<vtkIdTypeArray>::New();
  numbers->SetName("Number");
  numbers->SetNumberOfTuples(data->GetNumberOfPoints());
  for (vtkIdType i = 0; i < data->GetNumberOfPoints(); ++i)
  {
    numbers->SetValue(i, i);
  }
  data->GetPointData()->AddArray(numbers);
  vtkNew<vtkPointsToSurfels> filter;
  const auto tree = ByOneFilter(data, filter);
  filter->BuildHierarchyOff();
  const auto surfels = ByOneFilter(data, filter);
  CHECK(tree->GetNumberOfPoints() == data->GetNumberOfPoints());
  for (const char* name :
    { "SurfelCovariance", "SurfelAreaVector", "SurfelTwoSided", "SurfelOverlap" })
  {
    vtkDataArray *leaves = tree->GetPointData()->GetArray(name),
                 *wanted = surfels->GetPointData()->GetArray(name);
    vtkIdType differing = 0;
    for (vtkIdType i = 0; i < leaves->GetNumberOfTuples(); ++i)
    {
      const auto number =
        static_cast<vtkIdType>(tree->GetPointData()->GetArray("Number")->GetTuple1(i));
      for (int c = 0; c < leaves->GetNumberOfComponents(); ++c)
      {
        differing += leaves->GetComponent(i, c) != wanted->GetComponent(number, c) ? 1 : 0;
      }
    }
    CHECK(differing == 0);
  }
}

/// Where neighbours cannot be shared, nothing differs.
TEST_CASE("Neighbours of its own")
{
  const auto data = MakeScene();
  vtkNew<vtkPointsToSurfels> many;
  many->GetNormalization()->SetNumberOfNeighbors(30);
  vtkNew<vtkPointsToSurfels> radius;
  radius->GetEstimation()->SetNeighborhoodModeToRadius();
  radius->GetEstimation()->SetRadius(0.1);
  for (vtkPointsToSurfels* filter : { many.Get(), radius.Get() })
  {
    const auto one = ByOneFilter(data, filter);
    const auto single = BySingleFilters(data, filter);
    CHECK(SamePlaces(one, single));
    CHECK(SameWeights(one, single));
    CHECK(SameArray(one->GetFieldData()->GetArray(SurfelSplatting::Arrays::Nodes),
      single->GetFieldData()->GetArray(SurfelSplatting::Arrays::Nodes)));
  }
}

TEST_CASE("Threads")
{
  const auto data = MakeScene();
  const auto results = WithThreads({ 1, 2, 8 }, [&] {
    vtkNew<vtkPointsToSurfels> filter;
    return ByOneFilter(data, filter);
  });
  for (int t = 1; t < 3; ++t)
  {
    CHECK(SamePlaces(results[0], results[t]));
    CHECK(SameWeights(results[0], results[t]));
  }
}

/// An execution for each change of a setting, and for nothing else.
TEST_CASE("Executions")
{
  vtkNew<vtkPointsToSurfels> filter;
  vtkNew<vtkCallbackCommand> command;
  int executions = 0;
  command->SetClientData(&executions);
  command->SetCallback(
    [](vtkObject*, unsigned long, void* count, void*) { ++*static_cast<int*>(count); });
  filter->AddObserver(vtkCommand::StartEvent, command);
  filter->SetInputData(MakeScene());
  filter->Update();
  filter->Update();
  CHECK(executions == 1);
  filter->GetEstimation()->SetNumberOfNeighbors(12);
  filter->Update();
  CHECK(executions == 2);
  filter->GetNormalization()->SetNumberOfIterations(2);
  filter->Update();
  filter->Update();
  CHECK(executions == 3);
}

namespace
{
constexpr int Columns = 160, Rows = 120;
const double SensorPlace[3] = { 0.5, -1.0, 2.0 };

/// A tilted wall in steps of 1/z, and what vtkPointCloudReader says of its sensor.
vtkSmartPointer<vtkPolyData> MakeDepthImage()
{
  constexpr double step = 0.0029, focal = 140.0;
  std::vector<Vec> points;
  for (int i = 0; i < Columns * Rows; ++i)
  {
    const int x = i % Columns, y = i / Columns;
    const double z = 1.0 / (step * std::round((0.3 + 0.2 * y / Rows + 0.03 * x / Columns) / step));
    points.push_back({ SensorPlace[0] + (x - Columns / 2) * z / focal,
      SensorPlace[1] + (y - Rows / 2) * z / focal, SensorPlace[2] + z });
  }
  auto data = ToPolyData(points, VTK_DOUBLE);
  double bounds[6];
  data->GetBounds(bounds);
  AddField("ScanViewpoint", { SensorPlace, SensorPlace + 3 }, data);
  AddField("ScanBounds", { bounds, bounds + 6 }, data);
  AddField("ScanDimensions", { Columns, Rows }, data);
  return data;
}

bool SameSurfels(vtkPolyData* a, vtkPolyData* b)
{
  return SamePlaces(a, b) && SameWeights(a, b);
}
}

/// The result of settings that say what the field arrays say, unless the points were moved.
TEST_CASE("Sensor")
{
  const auto image = MakeDepthImage();
  vtkNew<vtkPointsToSurfels> filter, bySettings, without;
  const Messages quiet(filter), quietToo(bySettings), quietThree(without);
  const auto found = ByOneFilter(image, filter);
  CHECK(filter->GetEstimation()->GetNumberOfNeighbors() == 16); // settings are what they were
  CHECK(filter->GetEstimation()->GetOrientationMode() == vtkSurfelEstimation::CONSISTENT);
  CHECK(filter->GetCleaning()->GetColumns() == 0);
  bySettings->UseSensorOff();
  bySettings->GetCleaning()->SetColumns(Columns);
  bySettings->GetCleaning()->SetViewpoint(SensorPlace);
  bySettings->GetEstimation()->SetOrientationModeToViewpoint();
  bySettings->GetEstimation()->SetViewpoint(SensorPlace);
  bySettings->GetEstimation()->SetNumberOfNeighbors(30);
  CHECK(SameSurfels(found, ByOneFilter(image, bySettings)));
  CHECK(filter->GetCleaning()->GetNumberOfMovedPoints() > Columns * Rows / 2);

  filter->SetNumberOfNeighbors(12);
  bySettings->GetEstimation()->SetNumberOfNeighbors(12);
  CHECK(SameSurfels(ByOneFilter(image, filter), ByOneFilter(image, bySettings)));

  filter->SetNumberOfNeighbors(0);
  without->UseSensorOff();
  const auto raw = ByOneFilter(image, without);
  CHECK(!SameSurfels(raw, found));
  vtkNew<vtkPolyData> moved;
  moved->DeepCopy(image);
  moved->GetPoints()->SetPoint(0, 0.0, 0.0, 9.0);
  CHECK(SameSurfels(ByOneFilter(moved, filter), ByOneFilter(moved, without)));

  double place[3];
  CHECK(vtkPointsToSurfels::FindViewpoint(image, place));
  CHECK(std::equal(place, place + 3, SensorPlace));
  CHECK(vtkPointsToSurfels::FindColumns(image) == Columns);
  CHECK(!vtkPointsToSurfels::FindViewpoint(moved, place));
  CHECK(vtkPointsToSurfels::FindColumns(moved) == 0);
}

TEST_CASE("Sensor and a local origin")
{
  const auto image = MakeDepthImage();
  vtkNew<vtkPolyData> local;
  local->DeepCopy(image);
  AddField("SurfelOrigin", { 1000.0, 2000.0, 3000.0 }, local);
  double place[3];
  CHECK(vtkPointsToSurfels::FindViewpoint(local, place));
  CHECK(place[1] == SensorPlace[1] + 2000.0);
  vtkNew<vtkPointsToSurfels> filter;
  const Messages quiet(filter);
  const auto wanted = ByOneFilter(image, filter), found = ByOneFilter(local, filter);
  CHECK(SamePlaces(found, wanted));
  CHECK(filter->GetCleaning()->GetNumberOfMovedPoints() > Columns * Rows / 2);
}

TEST_CASE("Sensor of a cloud in parts")
{
  const auto image = MakeDepthImage();
  vtkNew<vtkPartitionedSurfelEstimation> parts, bySettings;
  const Messages quiet(parts), quietToo(bySettings);
  for (vtkPartitionedSurfelEstimation* filter : { parts.Get(), bySettings.Get() })
  {
    filter->SetInputData(image);
    filter->SetPointsPerPart(1000);
  }
  bySettings->UseSensorOff();
  bySettings->GetCleaning()->SetColumns(Columns);
  bySettings->GetCleaning()->SetViewpoint(SensorPlace);
  bySettings->GetEstimation()->SetOrientationModeToViewpoint();
  bySettings->GetEstimation()->SetViewpoint(SensorPlace);
  bySettings->GetEstimation()->SetNumberOfNeighbors(30);
  parts->Update();
  bySettings->Update();
  CHECK(parts->GetNumberOfParts() > 1);
  CHECK(SameSurfels(parts->GetOutput(), bySettings->GetOutput()));
}

TEST_CASE("Counts and messages")
{
  const auto data = MakeScene();
  data->GetPoints()->SetPoint(5, std::nan(""), 0, 0);
  data->GetPoints()->SetPoint(9, data->GetPoint(3));
  vtkNew<vtkPointsToSurfels> filter;
  const Messages messages(filter);
  ByOneFilter(data, filter);
  CHECK(filter->GetCleaning()->GetNumberOfNonFinitePoints() == 1);
  CHECK(filter->GetCleaning()->GetNumberOfDuplicatePoints() == 1);
  CHECK(filter->GetHierarchy()->GetNumberOfLeaves() == data->GetNumberOfPoints() - 2);
  CHECK(messages.Warnings.size() == 1);
  CHECK(messages.Errors.empty());

  filter->CleanPointsOff();
  filter->Update();
  CHECK(filter->GetEstimation()->GetNumberOfNonFinitePoints() == 1);
  CHECK(filter->GetEstimation()->GetNumberOfDuplicatePoints() == 1);
  CHECK(filter->GetHierarchy()->GetNumberOfLeaves() == data->GetNumberOfPoints() - 2);
  CHECK(messages.Warnings.size() == 2);

  filter->GetEstimation()->SetNeighborhoodModeToRadius(); // of radius 0
  filter->Update();
  REQUIRE(!messages.Errors.empty());
  CHECK(messages.Errors[0].find("Radius") != std::string::npos);
  CHECK(filter->GetOutput()->GetNumberOfPoints() == 0);
}

TEST_CASE("No points")
{
  vtkNew<vtkPointsToSurfels> filter;
  CHECK(ByOneFilter(ToPolyData({}), filter)->GetNumberOfPoints() == 0);
  CHECK(ByOneFilter(ToPolyData({ { 1, 2, 3 } }), filter)->GetNumberOfPoints() == 1);
}

/// What a filter behind a hierarchy has moved becomes new surfels.
TEST_CASE("Points of a hierarchy")
{
  vtkNew<vtkPointsToSurfels> first, second;
  vtkNew<vtkPolyData> turned;
  turned->DeepCopy(ByOneFilter(MakeScene(), first));
  for (vtkIdType i = 0; i < turned->GetNumberOfPoints(); ++i)
  {
    double p[3];
    turned->GetPoint(i, p);
    turned->GetPoints()->SetPoint(i, p[1], -p[0], p[2]);
  }
  vtkSmartPointer<vtkPolyData> surfels = ByOneFilter(turned, second);
  CHECK(surfels->GetNumberOfPoints() == turned->GetNumberOfPoints());
  CHECK(surfels->GetFieldData()->HasArray("SurfelNodes"));
  second->BuildHierarchyOff();
  surfels = ByOneFilter(turned, second);
  CHECK(surfels->GetNumberOfPoints() == turned->GetNumberOfPoints());
  for (const char* name : { "SurfelLeaves", "SurfelNodes" })
  {
    CHECK(!surfels->GetFieldData()->HasArray(name));
  }
}

/// An abort in each of the three filters leaves nothing; the next execution is complete.
TEST_CASE("Abort")
{
  vtkNew<vtkPointsToSurfels> filter;
  ProgressWatch watch(filter);
  const vtkIdType count = ByOneFilter(MakeScene(), filter)->GetNumberOfPoints();
  CHECK(count > 10000);
  CHECK(!watch.Backwards);
  CHECK(watch.Last == 1.0);
  for (const double at : { 0.1, 0.5, 0.9 })
  {
    watch.Restart(at);
    CHECK(ByOneFilter(MakeScene(), filter)->GetNumberOfPoints() == 0);
    watch.Restart();
    CHECK(ByOneFilter(MakeScene(), filter)->GetNumberOfPoints() == count);
  }
}
}
