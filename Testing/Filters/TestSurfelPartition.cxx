// SPDX-License-Identifier: BSD-3-Clause
// A cloud in parts gives the surfels of the whole cloud: seams, dropped points, normals, abort.
#include "ProgressWatch.h"
#include "SurfelTesting.h"

#include "vtkPartitionedSurfelEstimation.h"
#include "vtkPointCloudCleaning.h"
#include "vtkPointsToSurfels.h"
#include "vtkSurfelEstimation.h"
#include "vtkSurfelNormalization.h"

#include "vtkFloatArray.h"
#include "vtkIntArray.h"

#include <algorithm>
#include <cstring>
#include <functional>
#include <iterator>
#include <limits>
#include <sstream>

using namespace SurfelTesting;

namespace
{
/// A dense ball and a wall of a tenth of its density that it stands on.
Sampled MakeScene()
{
  return MakeBallAndWall(40000, -1.1, 0.06);
}

struct Compared
{
  double Largest = 0.0; ///< difference over the value of the whole cloud
  double RootMeanSquare = 0.0;
};

/// Tuple by tuple; signs of two-sided area vectors mean nothing.
Compared Compare(vtkDataArray* a, vtkDataArray* b)
{
  Compared result;
  CHECK(a->GetNumberOfTuples() == b->GetNumberOfTuples());
  const int n = a->GetNumberOfComponents();
  for (vtkIdType i = 0; i < a->GetNumberOfTuples(); ++i)
  {
    double minus = 0.0, plus = 0.0, size = 0.0;
    for (int c = 0; c < n; ++c)
    {
      const double x = a->GetComponent(i, c), y = b->GetComponent(i, c);
      minus += (x - y) * (x - y);
      plus += (x + y) * (x + y);
      size += y * y;
    }
    const double difference = std::sqrt(std::min(minus, plus) / size);
    result.Largest = std::max(result.Largest, difference);
    result.RootMeanSquare += difference * difference;
  }
  result.RootMeanSquare =
    std::sqrt(result.RootMeanSquare / static_cast<double>(a->GetNumberOfTuples()));
  return result;
}

vtkSmartPointer<vtkPolyData> Whole(vtkPolyData* data, int orientation)
{
  vtkNew<vtkSurfelEstimation> estimation;
  vtkNew<vtkSurfelNormalization> normalization;
  Messages quiet(estimation);
  estimation->SetInputData(data);
  estimation->SetOrientationMode(orientation);
  normalization->SetInputConnection(estimation->GetOutputPort());
  normalization->Update();
  return normalization->GetOutput();
}

TEST_CASE("Seams")
{
  const auto data = ToPolyData(MakeScene().Points);
  AddCheckers(data, 0.2);
  const auto whole = Whole(data, vtkSurfelEstimation::TWO_SIDED);
  vtkNew<vtkPartitionedSurfelEstimation> partitioned;
  partitioned->CleanPointsOff();
  partitioned->SetInputData(data);
  partitioned->SetPointsPerPart(5000);
  partitioned->Update();
  vtkPolyData* parts = partitioned->GetOutput();
  CHECK(partitioned->GetNumberOfParts() >= 9);
  CHECK((static_cast<double>(partitioned->GetNumberOfDoubtfulSurfels())) <=
    (0.01 * data->GetNumberOfPoints()));
  CHECK(parts->GetNumberOfPoints() == whole->GetNumberOfPoints());
  const auto array = [](vtkPolyData* d, const char* name) {
    return d->GetPointData()->GetArray(name);
  };
  const Compared points = Compare(parts->GetPoints()->GetData(), whole->GetPoints()->GetData());
  const Compared covariances =
    Compare(array(parts, "SurfelCovariance"), array(whole, "SurfelCovariance"));
  const Compared areas =
    Compare(array(parts, "SurfelAreaVector"), array(whole, "SurfelAreaVector"));
  std::cout << "parts: positions differ by " << points.Largest << ", covariances by "
            << covariances.Largest << ", areas by " << areas.Largest << ", " << areas.RootMeanSquare
            << " root mean square\n";
  CHECK(points.Largest <= 1e-6);
  CHECK(covariances.Largest <= 1e-4);
  // Other random samples; the same where the whole cloud is sampled otherwise.
  CHECK(areas.RootMeanSquare <= 0.1);
  CHECK(array(parts, "SurfelTwoSided")->GetRange()[0] == 1.0);
  const auto isSame = [&](
                        vtkDataArray* a, vtkDataArray* b) { return Compare(a, b).Largest == 0.0; };
  CHECK(isSame(array(parts, "Checkers"), array(whole, "Checkers")));
  CHECK(!isSame(array(parts, "Checkers"), array(data, "Checkers")));
}

/// One part: as all filters in one do it, sides included; apart from the weights, whose neighbours
/// these share, as the two filters do it.
TEST_CASE("Cleaning")
{
  const Sampled scene = MakeScene();
  const size_t strays = 300;
  std::vector<Vec> points = scene.Points;
  Random random(6);
  for (size_t i = 0; i < strays; ++i)
  {
    const double x = random(), y = random(), z = random();
    points.push_back({ 6 * x - 3, 6 * y - 3, 3 + 6 * z });
  }
  vtkNew<vtkPointsToSurfels> whole;
  vtkNew<vtkPartitionedSurfelEstimation> parts;
  const Messages quiet(whole), said(parts);
  whole->BuildHierarchyOff();
  whole->GetEstimation()->SetOrientationModeToTwoSided();
  whole->SetInputData(ToPolyData(points));
  whole->Update();
  parts->SetPointsPerPart(12000);
  parts->SetInputData(ToPolyData(points));
  parts->Update();
  CHECK(parts->GetNumberOfParts() > 2);
  CHECK(parts->GetCleaning()->GetNumberOfStrayPoints() >= 0.9 * strays);
  CHECK(parts->GetCleaning()->GetNumberOfStrayPoints() ==
    whole->GetCleaning()->GetNumberOfStrayPoints());
  REQUIRE(said.Warnings.size() == 1);
  CHECK(said.Warnings[0].find("stray points removed") != std::string::npos);
  const auto covariances = [](vtkPolyDataAlgorithm* filter) {
    return filter->GetOutput()->GetPointData()->GetArray("SurfelCovariance");
  };
  CHECK(Compare(covariances(parts), covariances(whole)).RootMeanSquare < 1e-3);
  const vtkMTimeType time = parts->GetOutput()->GetMTime();
  parts->Update();
  CHECK(parts->GetOutput()->GetMTime() == time); // cleaning does not make it run again
  parts->CleanPointsOff();
  parts->Update();
  CHECK(parts->GetOutput()->GetNumberOfPoints() == static_cast<vtkIdType>(points.size()));
}

TEST_CASE("Single part")
{
  const auto data = ToPolyData(MakeScene().Points);
  const auto single = Whole(data, vtkSurfelEstimation::CONSISTENT);
  vtkNew<vtkPointsToSurfels> all;
  all->SetInputData(data);
  all->CleanPointsOff(); // parts are not cleaned
  all->BuildHierarchyOff();
  all->Update();
  vtkPolyData* whole = all->GetOutput();
  CHECK(Compare(whole->GetPointData()->GetArray("SurfelAreaVector"),
          single->GetPointData()->GetArray("SurfelAreaVector"))
          .RootMeanSquare <= 0.03);
  vtkNew<vtkPartitionedSurfelEstimation> partitioned;
  partitioned->CleanPointsOff();
  partitioned->SetInputData(data);
  partitioned->Update();
  CHECK(partitioned->GetNumberOfParts() == 1);
  for (const char* name :
    { "SurfelCovariance", "SurfelAreaVector", "SurfelTwoSided", "SurfelOverlap" })
  {
    vtkDataArray* a = partitioned->GetOutput()->GetPointData()->GetArray(name);
    const bool isWeighted =
      std::strcmp(name, "SurfelAreaVector") == 0 || std::strcmp(name, "SurfelOverlap") == 0;
    vtkDataArray* b = (isWeighted ? whole : single.Get())->GetPointData()->GetArray(name);
    CHECK(a->GetNumberOfTuples() == b->GetNumberOfTuples());
    CHECK(std::memcmp(a->GetVoidPointer(0), b->GetVoidPointer(0),
            static_cast<size_t>(a->GetNumberOfValues()) * a->GetDataTypeSize()) == 0);
  }
}

/// Far from the origin, with points that are dropped, arrays and normals.
TEST_CASE("Dropped points")
{
  Sampled scene = MakeScene();
  scene.Shift({ 4.5e5, 5.4e6, 300.0 });
  const double nan = std::numeric_limits<double>::quiet_NaN();
  scene.Points[17] = { nan, 0, 0 };
  scene.Points[4000] = scene.Points[3999];
  scene.Points[20000] = scene.Points[5];
  const auto data = ToPolyData(scene.Points, VTK_DOUBLE);
  const vtkIdType count = data->GetNumberOfPoints();
  vtkNew<vtkFloatArray> normals;
  normals->SetNumberOfComponents(3);
  vtkNew<vtkIntArray> numbers;
  numbers->SetName("Number");
  for (vtkIdType i = 0; i < count; ++i)
  {
    normals->InsertNextTuple(scene.Normals[i].data());
    numbers->InsertNextValue(static_cast<int>(i));
  }
  data->GetPointData()->SetNormals(normals);
  data->GetPointData()->AddArray(numbers);
  vtkNew<vtkPartitionedSurfelEstimation> partitioned;
  partitioned->CleanPointsOff();
  Messages quiet(partitioned);
  partitioned->SetInputData(data);
  partitioned->SetPointsPerPart(7000);
  partitioned->Update();
  vtkPolyData* surfels = partitioned->GetOutput();
  CHECK(partitioned->GetNumberOfNonFinitePoints() == 1);
  CHECK(partitioned->GetNumberOfDuplicatePoints() == 2);
  CHECK(surfels->GetNumberOfPoints() == count - 3);
  CHECK(!surfels->GetPointData()->HasArray("PartitionedPointId"));
  vtkDataArray* kept = surfels->GetPointData()->GetArray("Number");
  vtkDataArray* areas = surfels->GetPointData()->GetArray("SurfelAreaVector");
  double origin[3];
  surfels->GetFieldData()->GetArray("SurfelOrigin")->GetTuple(0, origin);
  int turned = 0, moved = 0;
  for (vtkIdType i = 0; i < surfels->GetNumberOfPoints(); ++i)
  {
    const auto id = static_cast<vtkIdType>(kept->GetComponent(i, 0));
    double p[3], a[3];
    surfels->GetPoint(i, p);
    areas->GetTuple(i, a);
    const Vec at{ p[0] + origin[0], p[1] + origin[1], p[2] + origin[2] };
    moved += Length(Minus(at, scene.Points[id])) > 0.1 ? 1 : 0;
    turned += Dot({ a[0], a[1], a[2] }, scene.Normals[id]) < 0.0 ? 1 : 0;
  }
  CHECK(moved == 0);
  CHECK(turned == 0);
  CHECK(surfels->GetPointData()->GetArray("SurfelTwoSided")->GetRange()[1] == 0.0);
}

TEST_CASE("Threads")
{
  const auto data = ToPolyData(MakeScene().Points);
  const auto results = WithThreads({ 1, 8 }, [&] {
    vtkNew<vtkPartitionedSurfelEstimation> partitioned;
    partitioned->CleanPointsOff();
    partitioned->SetInputData(data);
    partitioned->SetPointsPerPart(9000);
    partitioned->Update();
    return vtkSmartPointer<vtkPolyData>(partitioned->GetOutput());
  });
  const auto areas = [&](
                       int t) { return results[t]->GetPointData()->GetArray("SurfelAreaVector"); };
  CHECK(areas(0)->GetNumberOfTuples() == areas(1)->GetNumberOfTuples());
  CHECK(std::memcmp(areas(0)->GetVoidPointer(0), areas(1)->GetVoidPointer(0),
          static_cast<size_t>(areas(0)->GetNumberOfValues()) * sizeof(float)) == 0);
}

TEST_CASE("Troubles")
{
  vtkNew<vtkPartitionedSurfelEstimation> partitioned;
  partitioned->CleanPointsOff();
  Messages messages(partitioned);
  partitioned->SetInputData(ToPolyData({}));
  partitioned->Update();
  CHECK(partitioned->GetOutput()->GetNumberOfPoints() == 0);

  // Points at a few places only cannot be parted further.
  std::vector<Vec> few;
  for (int i = 0; i < 3000; ++i)
  {
    few.push_back({ static_cast<double>(i % 3), 0.0, 0.0 });
  }
  partitioned->SetPointsPerPart(1000);
  partitioned->SetInputData(ToPolyData(few));
  partitioned->Update();
  CHECK(partitioned->GetOutput()->GetNumberOfPoints() == 3);

  // An error of a part is reported as this filter's own.
  partitioned->GetEstimation()->SetOrientationModeToAsGiven();
  partitioned->SetInputData(ToPolyData(MakeScene().Points));
  partitioned->Update();
  REQUIRE(!messages.Errors.empty());
  CHECK(messages.Errors[0].find("no normals to keep") != std::string::npos);
  CHECK(partitioned->GetOutput()->GetNumberOfPoints() == 0);
}

TEST_CASE("Abort")
{
  vtkNew<vtkPartitionedSurfelEstimation> partitioned;
  partitioned->CleanPointsOff();
  ProgressWatch watch(partitioned, 0.4);
  partitioned->SetInputData(ToPolyData(MakeScene().Points));
  partitioned->SetPointsPerPart(10000);
  partitioned->Update();
  CHECK(partitioned->GetOutput()->GetNumberOfPoints() == 0);

  // While points are cleaned; the next execution is complete.
  partitioned->CleanPointsOn();
  watch.Restart(0.01);
  partitioned->Update();
  CHECK(partitioned->GetOutput()->GetNumberOfPoints() == 0);
  CHECK(watch.Last < 0.15);
  watch.Restart();
  partitioned->Modified();
  partitioned->Update();
  CHECK(partitioned->GetOutput()->GetNumberOfPoints() > 10000);
}

/// With points that are cleaned first, and a sparse part behind dense ones, which needs a wider
/// halo than they do.
TEST_CASE("Progress")
{
  Sampled scene =
    MakeRectangle({ 0, 0, 0 }, { 1, 0, 0 }, 1.0, { 0, 1, 0 }, 1.0, 0.01, 0.2, Random(1));
  scene.Append(
    MakeRectangle({ 1, 0, 0 }, { 1, 0, 0 }, 80.0, { 0, 1, 0 }, 80.0, 1.0, 0.2, Random(2)));
  vtkNew<vtkPartitionedSurfelEstimation> partitioned;
  partitioned->SetInputData(ToPolyData(scene.Points));
  partitioned->SetPointsPerPart(3000);
  Messages quiet(partitioned);
  const ProgressWatch watch(partitioned);
  partitioned->Update();
  CHECK(partitioned->GetNumberOfParts() > 3);
  CHECK(watch.Events > 100);
  CHECK(!watch.Backwards);
  CHECK(watch.Last == 1.0);
}

/// Normals may be of any type.
TEST_CASE("NormalsInDouble")
{
  const Sampled scene = MakeScene();
  const auto data = ToPolyData(scene.Points);
  AddNormals(data, scene.Normals); // doubles
  vtkNew<vtkPartitionedSurfelEstimation> partitioned;
  partitioned->CleanPointsOff();
  partitioned->SetInputData(data);
  partitioned->SetPointsPerPart(7000);
  partitioned->Update();
  const Surfels surfels(partitioned->GetOutput());
  int turned = 0;
  for (vtkIdType i = 0; i < surfels.Count(); ++i)
  {
    turned += Dot(surfels.Normal(i), scene.Normals[i]) < 0.999 ? 1 : 0;
  }
  CHECK(surfels.Count() == static_cast<vtkIdType>(scene.Points.size()));
  CHECK(turned == 0);
}

/// Surfels of a part do not know the outside, if the signs of the normals do not tell it.
TEST_CASE("Wrong normals")
{
  const Sampled scene = MakeBallAndWall(8000, -1.1, 0.1);
  const auto count = static_cast<vtkIdType>(scene.Points.size());
  Random random(7);
  const auto byChance = [&](const Vec& n) { return random() < 0.5 ? Minus({}, n) : n; };
  const auto sideways = [](const Vec&) { return Vec{ 1, 0, 0 }; };
  const auto isTwoSided = [&](const std::function<Vec(const Vec&)>& wrong, int use, int mode) {
    std::vector<Vec> normals;
    std::transform(scene.Normals.begin(), scene.Normals.end(), std::back_inserter(normals), wrong);
    const auto data = ToPolyData(scene.Points);
    AddNormals(data, normals);
    vtkNew<vtkPartitionedSurfelEstimation> partitioned;
    const Messages messages(partitioned);
    partitioned->CleanPointsOff();
    partitioned->GetEstimation()->SetOrientationMode(mode);
    partitioned->SetInputData(data);
    partitioned->SetPointsPerPart(3000);
    partitioned->Update();
    CHECK(partitioned->GetNumberOfParts() > 3);
    CHECK(partitioned->GetEstimation()->GetNormalsUse() == use);
    const bool isSaid = use != vtkSurfelEstimation::NORMALS_KEPT;
    REQUIRE(messages.Warnings.size() == (isSaid ? 1 : 0));
    CHECK((!isSaid || messages.Warnings[0].find("the normals ") != std::string::npos));
    const Surfels surfels(partitioned->GetOutput());
    int across = 0;
    for (vtkIdType i = 0; i < count; ++i)
    {
      across += std::abs(Dot(surfels.Normal(i), scene.Normals[i])) > 0.9 ? 1 : 0;
    }
    CHECK(across >= (mode == vtkSurfelEstimation::AS_GIVEN ? 0.0 : 0.98) * count);
    return partitioned->GetOutput()->GetPointData()->GetArray("SurfelTwoSided")->GetRange()[0] ==
      1.0;
  };
  const int consistent = vtkSurfelEstimation::CONSISTENT;
  CHECK(isTwoSided(byChance, vtkSurfelEstimation::NORMALS_WITHOUT_SIDES, consistent));
  CHECK(isTwoSided(sideways, vtkSurfelEstimation::NORMALS_DROPPED, consistent));
  const int asGiven = vtkSurfelEstimation::AS_GIVEN;
  CHECK(!isTwoSided(byChance, vtkSurfelEstimation::NORMALS_KEPT, asGiven));
}

/// What PrintSelf says of a filter's settings, without the lines before them.
template <typename Filter>
std::string SettingsOf(Filter* filter, const std::string& first, const std::string& end)
{
  std::ostringstream text;
  filter->Print(text);
  const std::string all = text.str();
  const std::size_t begin = all.find(first);
  return all.substr(begin, all.find(end) - begin);
}

TEST_CASE("CopySettings")
{
  vtkNew<vtkSurfelEstimation> from, to;
  from->SetNeighborhoodModeToRadius();
  from->SetNumberOfNeighbors(20);
  from->SetRadius(0.5);
  from->SetMaximumNumberOfNeighbors(99);
  from->SetKernelModeToElliptical();
  from->SetKernelScale(0.6);
  from->SetCellBlur(0.3);
  from->SetMaximumAxisRatio(3.0);
  from->SetKeepNormals(0);
  from->SetNormalsArrayName("directions");
  from->SetOrientationModeToViewpoint();
  from->SetViewpoint(1.0, 2.0, 3.0);
  from->SetUseViewpoint(1);
  from->SetIsolationFactor(7.0);
  from->InterpolateColorsOff();
  const char* const first = "NeighborhoodMode";
  CHECK(SettingsOf(from.Get(), first, "Controller") != SettingsOf(to.Get(), first, "Controller"));
  to->CopySettings(from);
  CHECK(SettingsOf(from.Get(), first, "Controller") == SettingsOf(to.Get(), first, "Controller"));

  vtkNew<vtkSurfelNormalization> weights, copied;
  weights->SetSamplesPerPoint(8);
  weights->SetNumberOfIterations(3);
  weights->SetNumberOfNeighbors(30);
  weights->SetSupport(3.0);
  weights->SetSampleRadius(1.5);
  weights->SetNormalOffset(1.0);
  weights->SetMinimumFactor(0.5);
  weights->SetMaximumFactor(2.0);
  copied->CopySettings(weights);
  CHECK(SettingsOf(weights.Get(), "SamplesPerPoint", "Controller") ==
    SettingsOf(copied.Get(), "SamplesPerPoint", "Controller"));
}

/// A change of a part's settings is a change of the filter.
TEST_CASE("Settings")
{
  vtkNew<vtkPartitionedSurfelEstimation> partitioned;
  partitioned->CleanPointsOff();
  partitioned->SetInputData(ToPolyData(MakeSphere(1.0, 3000, Random(3)).Points));
  partitioned->Update();
  const vtkMTimeType before = partitioned->GetOutput()->GetMTime();
  partitioned->Update();
  CHECK(partitioned->GetOutput()->GetMTime() == before);
  partitioned->GetEstimation()->SetKernelModeToCircular();
  partitioned->Update();
  CHECK(partitioned->GetOutput()->GetMTime() > before);
  std::ostringstream text;
  partitioned->Print(text);
  CHECK(text.str().find("PointsPerPart: 10000000") != std::string::npos);
}
}
