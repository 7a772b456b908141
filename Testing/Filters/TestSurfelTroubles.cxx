// SPDX-License-Identifier: BSD-3-Clause
// Clouds that are broken, tiny, or degenerate: counted, said once, never NaN.
#include "SurfelTesting.h"

#include "vtkPointsToSurfels.h"
#include "vtkSurfelEstimation.h"
#include "vtkSurfelNormalization.h"
#include "vtkUnsignedCharArray.h"

#include <chrono>
#include <limits>

using namespace SurfelTesting;

namespace
{
constexpr double Infinity = std::numeric_limits<double>::infinity();
const double NaN = std::nan("");

/// Runs both filters and checks what must hold for any input.
class Run
{
public:
  explicit Run(const std::vector<Vec>& points)
    : Said(this->Estimation)
    , SaidLater(this->Normalization)
  {
    this->Estimation->SetInputData(ToPolyData(points, VTK_DOUBLE));
    this->Normalization->SetInputConnection(this->Estimation->GetOutputPort());
    this->Normalization->Update();
    const Surfels surfels = this->Result();
    CHECK(surfels.HasArrays());
    CHECK(surfels.IsFinite());
    CHECK(this->Said.Errors.empty());
    CHECK(this->SaidLater.Errors.empty());
    CHECK(this->Said.Warnings.size() <= 1);
    double least = 1.0;
    for (vtkIdType i = 0; i < surfels.Count(); ++i)
    {
      least = std::min(least, surfels.Area(i));
    }
    CHECK(least > 0.0);
  }
  Surfels Result() { return Surfels(this->Normalization->GetOutput()); }

  vtkNew<vtkSurfelEstimation> Estimation;
  vtkNew<vtkSurfelNormalization> Normalization;
  Messages Said;
  Messages SaidLater;
};

TEST_CASE("Empty")
{
  Run none{ {} };
  CHECK(none.Result().Count() == 0);
  CHECK(none.Said.Warnings.empty());
  Run allBad{ { { NaN, 0, 0 }, { 0, Infinity, 0 }, { 1e300, 0, 0 } } };
  CHECK(allBad.Result().Count() == 0);
  CHECK(allBad.Estimation->GetNumberOfNonFinitePoints() == 3);

  vtkNew<vtkPolyData> withoutPoints;
  vtkNew<vtkSurfelEstimation> estimation;
  estimation->SetInputData(withoutPoints);
  estimation->Update();
  CHECK(Surfels(estimation->GetOutput()).HasArrays());
}

TEST_CASE("Few")
{
  const std::vector<Vec> points = { { 0, 0, 0 }, { 1, 0, 0 }, { 0.5, 0.9, 0 }, { 0.4, 0.3, 0.8 },
    { 0.2, 0.1, 0.1 }, { 0.7, 0.2, 0.2 } };
  for (size_t count = 1; count <= points.size(); ++count)
  {
    Run few(std::vector<Vec>(points.begin(), points.begin() + count));
    CHECK(few.Result().Count() == static_cast<vtkIdType>(count));
    CHECK(few.Estimation->GetNumberOfTwoSidedSurfels() == static_cast<vtkIdType>(count));
    const double area = few.Result().TotalArea() / count;
    CHECK(area > 0.01);
    CHECK(area < 10.0);
    CHECK((few.Estimation->GetNumberOfDegeneratePoints() > 0) == (count <= 3));
  }
  Run three({ points[0], points[1], points[2] });
  CHECK(std::abs(three.Result().Normal(0)[2]) >= 0.999); // the plane of the triangle
}

TEST_CASE("Bad points")
{
  const Sampled sphere = MakeSphere(1.0, 5000, Random(1));
  std::vector<Vec> points = sphere.Points;
  points[10] = { NaN, 0, 0 };
  points[20] = { 0, Infinity, 0 };
  points[30] = { 0, 0, -Infinity };
  points[40] = points[41];
  points[50] = points[41];
  Run run(points);
  CHECK(run.Estimation->GetNumberOfNonFinitePoints() == 3);
  CHECK(run.Estimation->GetNumberOfDuplicatePoints() == 2);
  CHECK(run.Result().Count() == 4995);
  CHECK(run.Said.Warnings.size() == 1);
  const std::string said = run.Said.Warnings.empty() ? "" : run.Said.Warnings[0];
  CHECK(said.find("3 points") != std::string::npos);
  CHECK(said.find("2 dup") != std::string::npos);
  CHECK(run.Estimation->GetNumberOfTwoSidedSurfels() == 0);
}

/// Arrays without a value for each point are left out: once, by the first filter.
TEST_CASE("Arrays of another length")
{
  const Sampled sphere = MakeSphere(1.0, 500, Random(2));
  for (const vtkIdType count : { vtkIdType{ 10 }, vtkIdType{ 600 } })
  {
    for (const bool cleans : { false, true })
    {
      const vtkSmartPointer<vtkPolyData> points = ToPolyData(sphere.Points);
      points->GetPoints()->SetPoint(7, points->GetPoint(8)); // so that points are copied
      AddNormals(points, sphere.Normals);
      vtkDataArray* normals = points->GetPointData()->GetNormals();
      normals->SetName("Given");
      normals->Resize(600);
      normals->SetNumberOfTuples(count);
      vtkNew<vtkPointsToSurfels> filter;
      filter->SetCleanPoints(cleans);
      filter->SetInputData(points);
      Messages messages(filter);
      filter->Update();
      vtkPointData* data = filter->GetOutput()->GetPointData();
      CHECK(filter->GetOutput()->GetNumberOfPoints() == 499);
      CHECK(!data->HasArray("Given"));
      CHECK(messages.Errors.empty());
      REQUIRE(messages.Warnings.size() == 1);
      const std::string said = messages.Warnings[0];
      const std::size_t place = said.find("Given (" + std::to_string(count) + ")");
      CHECK(place != std::string::npos);
      CHECK(said.find("Given", place + 1) == std::string::npos);
    }
  }
}

/// Bytes that have the name of an array of surfels, which takes their place, are no colours.
TEST_CASE("Bytes under the name of surfels")
{
  const Sampled sphere = MakeSphere(1.0, 500, Random(3));
  for (const char* name :
    { "SurfelAreaVector", "SurfelTwoSided", "SurfelOverlap", "SurfelCovariance" })
  {
    for (const bool cleans : { false, true })
    {
      const vtkSmartPointer<vtkPolyData> points = ToPolyData(sphere.Points);
      vtkNew<vtkUnsignedCharArray> bytes;
      bytes->SetName(name);
      bytes->SetNumberOfComponents(3);
      bytes->SetNumberOfTuples(points->GetNumberOfPoints());
      bytes->Fill(9);
      points->GetPointData()->AddArray(bytes);
      vtkNew<vtkPointsToSurfels> filter;
      filter->SetCleanPoints(cleans);
      filter->SetInputData(points);
      filter->Update();
      const Surfels surfels(filter->GetOutput());
      CHECK(surfels.HasArrays());
      CHECK(surfels.TotalArea() > 12.0);
    }
  }
}

/// Outliers: alone, and in a group.
TEST_CASE("Isolated")
{
  const Sampled sphere = MakeSphere(1.0, 20000, Random(2));
  std::vector<Vec> points = sphere.Points;
  points.push_back({ 5, 5, 5 });
  points.push_back({ 1.5, 0, 0 });
  points.push_back({ -80, 0, 0 });
  points.push_back({ -80, 1, 0 });
  points.push_back({ -80, 0, 1 });
  Run run(points);
  CHECK(run.Estimation->GetNumberOfIsolatedPoints() == 5);
  const double median = run.Estimation->GetMedianSpacing();
  for (vtkIdType i = 20000; i < 20005; ++i)
  {
    CHECK(run.Result().Area(i) <= 5.0 * median * median);
    CHECK(run.Result().IsTwoSided(i));
  }
  CHECK(run.Estimation->GetNumberOfTwoSidedSurfels() == 5);
}

/// Seven spacings off a surface, all neighbours are about as far: without a bound such points
/// become discs of several spacings. A denser surface beside a sparse one isolates none.
TEST_CASE("Isolated beside a surface")
{
  const double spacing = std::sqrt(4.0 * Pi / 20000);
  std::vector<Vec> points = MakeSphere(1.0, 20000, Random(2)).Points;
  for (const Vec& direction : { Vec{ 1, 0, 0 }, Vec{ 0, 0.6, 0.8 }, Vec{ 0, 0, -1 } })
  {
    const double far = 1.0 + 7.0 * spacing;
    points.push_back({ far * direction[0], far * direction[1], far * direction[2] });
  }
  Run run(points);
  CHECK(run.Estimation->GetNumberOfIsolatedPoints() == 3);
  for (vtkIdType i = 20000; i < 20003; ++i)
  {
    CHECK(run.Result().Area(i) <= 2.0 * spacing * spacing);
  }
  const Sampled dense =
    MakeRectangle({ 0, 0, 0 }, { 1, 0, 0 }, 1, { 0, 1, 0 }, 1, 0.01, 0.4, Random(3));
  const Sampled sparse =
    MakeRectangle({ 1, 0, 0 }, { 1, 0, 0 }, 1, { 0, 1, 0 }, 1, 0.05, 0.4, Random(4));
  std::vector<Vec> wall = dense.Points;
  wall.insert(wall.end(), sparse.Points.begin(), sparse.Points.end());
  Run beside(wall);
  CHECK(beside.Estimation->GetNumberOfIsolatedPoints() == 0);
}

/// Far returns of a scanner that turns become fog if they are as large as the space about them. A
/// wall that is as sparse stays whole.
TEST_CASE("Sparse without a plane")
{
  std::vector<Vec> points = MakeSphere(1.0, 20000, Random(2)).Points;
  Random random(5);
  for (int i = 0; i < 600; ++i)
  {
    points.push_back({ 10 + 6 * random(), 6 * random(), 6 * random() });
  }
  Run run(points);
  CHECK(run.Estimation->GetNumberOfIsolatedPoints() > 400);
  const double largest = 6.0 * run.Estimation->GetMedianSpacing();
  vtkIdType bounded = 0;
  for (vtkIdType i = 20000; i < 20600; ++i)
  {
    bounded += run.Result().Area(i) <= 5.0 * largest * largest ? 1 : 0;
  }
  CHECK(bounded > 400);
  points.resize(20000);
  const Sampled wall =
    MakeRectangle({ 10, 0, 0 }, { 0, 1, 0 }, 10, { 0, 0, 1 }, 10, 0.5, 0.4, Random(3));
  points.insert(points.end(), wall.Points.begin(), wall.Points.end());
  Run flat(points);
  CHECK(flat.Estimation->GetNumberOfIsolatedPoints() == 0);
}

/// Far walls that meet are as large at their fold as elsewhere; so are those that are sparser than
/// IsolationFactor squared.
TEST_CASE("Sparse folds")
{
  for (const double spacing : { 0.5, 1.5 })
  {
    std::vector<Vec> points = MakeSphere(1.0, 20000, Random(2)).Points;
    const double side = 20.0 * spacing;
    const Sampled wall =
      MakeRectangle({ 10, 0, 0 }, { 0, 1, 0 }, side, { 0, 0, 1 }, side, spacing, 0.4, Random(3));
    const Sampled floor =
      MakeRectangle({ 10, 0, 0 }, { 0, 1, 0 }, side, { 1, 0, 0 }, side, spacing, 0.4, Random(4));
    points.insert(points.end(), wall.Points.begin(), wall.Points.end());
    points.insert(points.end(), floor.Points.begin(), floor.Points.end());
    Run run(points);
    CAPTURE(spacing);
    CHECK(run.Estimation->GetNumberOfIsolatedPoints() == 0);
  }
}

/// A few far returns beside each other, in a plane: they are as large as the space between them,
/// not as that to the nearest surface.
TEST_CASE("Few far returns")
{
  const double spacing = std::sqrt(4.0 * Pi / 20000);
  for (const int columns : { 3, 4, 5 })
  {
    std::vector<Vec> points = MakeSphere(1.0, 20000, Random(2)).Points;
    for (int k = 0; k < 3 * columns; ++k)
    {
      points.push_back({ 2.5, 3.0 * spacing * (k / 3), 3.0 * spacing * (k % 3) });
    }
    Run run(points);
    for (vtkIdType i = 20000; i < run.Result().Count(); ++i)
    {
      CHECK(run.Result().Area(i) <= 40.0 * spacing * spacing);
    }
  }
}

TEST_CASE("Collinear")
{
  std::vector<Vec> points;
  for (int i = 0; i < 1000; ++i)
  {
    points.push_back({ 0.01 * i, 0.02 * i, -0.01 * i });
  }
  Run run(points);
  CHECK(run.Estimation->GetNumberOfDegeneratePoints() == 1000);
  const double pitch = 0.01 * std::sqrt(6.0);
  CHECK_NEAR(run.Estimation->GetMedianSpacing() / pitch, 1.0, 0.3);
  const Surfels surfels(run.Estimation->GetOutput());
  double largest = 0.0, steepest = 0.0;
  for (vtkIdType i = 0; i < surfels.Count(); ++i)
  {
    largest = std::max(largest, surfels.Area(i));
    const Vec n = surfels.Normal(i);
    steepest = std::max(steepest, std::abs(n[0] + 2.0 * n[1] - n[2]));
  }
  CHECK(largest <= 4.0 * pitch * pitch);
  CHECK(steepest <= 1e-3);
}

TEST_CASE("Coincident")
{
  const auto start = std::chrono::steady_clock::now();
  Run same(std::vector<Vec>(1000000, Vec{ 3, 4, 5 }));
  CHECK(same.Result().Count() == 1);
  CHECK(same.Estimation->GetNumberOfDuplicatePoints() == 999999);

  // A few places, each with a hundred thousand points; by radius, which finds all of them.
  std::vector<Vec> points;
  for (int i = 0; i < 1000000; ++i)
  {
    points.push_back({ double(i % 10), 0.5 * (i % 7 % 3), 0.0 });
  }
  vtkNew<vtkSurfelEstimation> estimation;
  Messages messages(estimation);
  estimation->SetInputData(ToPolyData(points));
  estimation->SetNeighborhoodModeToRadius();
  estimation->SetRadius(100.0);
  estimation->Update();
  CHECK(Surfels(estimation->GetOutput()).IsFinite());
  CHECK(estimation->GetOutput()->GetNumberOfPoints() <= 30);
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
  CHECK(elapsed.count() <= 20.0);
}

/// Extremes of scale in one cloud, and of the whole cloud.
TEST_CASE("Scales")
{
  for (const double scale : { 1e-6, 1.0, 1e6 })
  {
    std::vector<Vec> points = MakeSphere(scale, 5000, Random(3)).Points;
    Run run(points);
    CHECK_NEAR(run.Result().TotalArea() / (4.0 * Pi * scale * scale), 1.0, 0.02);
    CHECK(run.Estimation->GetNumberOfTwoSidedSurfels() == 0);
    points.push_back({ 1e16, 0, 0 });
    Run extreme(points);
    CHECK(extreme.Result().Count() >= 1);
  }
}

/// A depth camera's picture: a slanted wall 3 m away whose depth is quantised to 2 cm steps, and
/// holes. Seen from the camera, the surfels leave no hole.
TEST_CASE("Depth image")
{
  constexpr int width = 160, height = 120;
  constexpr double focal = 131.0, step = 0.02;
  const auto depth = [](double x, double y) {
    const double z = 3.0 / (1.0 - 0.4 * x - 0.2 * y);
    return step * std::round(z / step);
  };
  std::vector<Vec> points;
  for (int j = 0; j < height; ++j)
  {
    for (int i = 0; i < width; ++i)
    {
      const double x = (i - width / 2) / focal, y = (j - height / 2) / focal;
      const double z = (i * 7 + j * 13) % 41 == 0 ? NaN : depth(x, y);
      points.push_back({ x * z, y * z, z });
    }
  }
  vtkNew<vtkSurfelEstimation> estimation;
  vtkNew<vtkSurfelNormalization> normalization;
  Messages messages(estimation);
  estimation->SetInputData(ToPolyData(points));
  estimation->SetOrientationModeToViewpoint();
  normalization->SetInputConnection(estimation->GetOutputPort());
  normalization->Update();
  const Surfels surfels(normalization->GetOutput());
  CHECK(surfels.IsFinite());
  // Coverage along random rays: each kernel where the ray meets its plane.
  Random random(4);
  std::vector<double> coverage;
  for (int r = 0; r < 400; ++r)
  {
    const Vec ray{ (random() - 0.5) * (width - 8) / focal, (random() - 0.5) * (height - 8) / focal,
      1.0 };
    double sum = 0.0;
    for (vtkIdType i = 0; i < surfels.Count(); ++i)
    {
      const Vec p = surfels.Position(i);
      const Vec n = surfels.Normal(i);
      if (std::hypot(p[0] / p[2] - ray[0], p[1] / p[2] - ray[1]) < 10.0 / focal)
      {
        const double t = Dot(p, n) / Dot(ray, n);
        sum += t > 0.0 ? surfels.Kernel(i, { t * ray[0], t * ray[1], t }) : 0.0;
      }
    }
    coverage.push_back(sum);
  }
  CHECK(Spread(coverage).Minimum >= 0.3);
  CHECK(Spread(coverage).Mean >= 0.9);
}
}
