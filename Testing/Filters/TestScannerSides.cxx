// SPDX-License-Identifier: BSD-3-Clause
// Clouds of several scans, each point of which knows its scanner: halls, sheets that were seen from
// both sides, grazing views, edges, scans of unknown places; in parts and in several processes.
#include "SurfelTesting.h"
#include "ThreadController.h"

#include "vtkPartitionedSurfelEstimation.h"
#include "vtkPointsToSurfels.h"
#include "vtkSurfelEstimation.h"

#include "vtkFloatArray.h"

#include <cmath>

using namespace SurfelTesting;

namespace
{
constexpr double Pitch = 0.05;

/// Points, the normals of the sides that were seen, and from where.
struct Scans
{
  Sampled Surface;
  std::vector<Vec> Places;

  void Add(const Sampled& surface, const Vec& place)
  {
    this->Surface.Append(surface);
    this->Places.resize(this->Surface.Points.size(), place);
  }
  void Add(const Vec& point, const Vec& normal, const Vec& place)
  {
    this->Surface.Add(point, normal);
    this->Places.push_back(place);
  }
  size_t Count() const { return this->Places.size(); }
};

const Vec Unknown{ NAN, NAN, NAN };

vtkSmartPointer<vtkPolyData> ToData(const Scans& scans, size_t begin, size_t end)
{
  const auto& points = scans.Surface.Points;
  auto data = ToPolyData({ points.begin() + static_cast<std::ptrdiff_t>(begin),
                           points.begin() + static_cast<std::ptrdiff_t>(end) },
    VTK_DOUBLE);
  vtkNew<vtkFloatArray> ways;
  ways->SetName("ToScanner");
  ways->SetNumberOfComponents(3);
  for (size_t i = begin; i < end; ++i)
  {
    // Zero where nothing is known, by the data contract.
    const bool isKnown = std::isfinite(scans.Places[i][0]);
    const Vec way = isKnown ? Minus(scans.Places[i], points[i]) : Vec{ 0, 0, 0 };
    ways->InsertNextTuple(way.data());
  }
  data->GetPointData()->SetVectors(ways);
  return data;
}

vtkSmartPointer<vtkPolyData> ToData(const Scans& scans)
{
  return ToData(scans, 0, scans.Count());
}

vtkSmartPointer<vtkPolyData> Estimate(vtkPolyData* data, int mode = vtkSurfelEstimation::SCANNERS,
  vtkMultiProcessController* c = nullptr)
{
  vtkNew<vtkSurfelEstimation> estimation;
  const Messages quiet(estimation);
  estimation->SetController(c);
  estimation->SetInputData(data);
  estimation->SetOrientationMode(mode);
  estimation->Update();
  return estimation->GetOutput();
}

/// Shares of some surfels that face the right or the wrong side, and that are two-sided.
struct Sides
{
  double Right = 0.0, Wrong = 0.0, Both = 0.0;
};

/// @param first of the scans' points, which is the first of the surfels
Sides SidesOf(vtkPolyData* data, const Scans& scans, size_t begin, size_t end, size_t first = 0)
{
  const Surfels surfels(data);
  Sides sides;
  const double one = 1.0 / static_cast<double>(end - begin);
  for (size_t i = begin; i < end; ++i)
  {
    const auto at = static_cast<vtkIdType>(i - first);
    const bool faces = Dot(surfels.AreaVector(at), scans.Surface.Normals[i]) > 0.0;
    (surfels.IsTwoSided(at) ? sides.Both : faces ? sides.Right : sides.Wrong) += one;
  }
  return sides;
}

Sides SidesOf(vtkPolyData* data, const Scans& scans)
{
  REQUIRE(data->GetNumberOfPoints() == static_cast<vtkIdType>(scans.Count()));
  return SidesOf(data, scans, 0, scans.Count());
}

/// A hall that is open at both ends, under a sloping roof. Points are of the nearer scanner.
Scans MakeHall()
{
  const Vec x{ 1, 0, 0 }, y{ 0, 1, 0 }, z{ 0, 0, 1 }, down{ 0, 0, -1 };
  const Vec slope{ 0, 0.8, 0.6 };
  Sampled hall = MakeRectangle({ 0, 0, 0 }, x, 8, y, 4, Pitch, 1, Random(1));
  hall.Append(MakeRectangle({ 0, 0, 2 }, down, 2, x, 8, Pitch, 1, Random(2)));
  hall.Append(MakeRectangle({ 0, 4, 0 }, z, 5, x, 8, Pitch, 1, Random(3)));
  hall.Append(MakeRectangle({ 0, 0, 2 }, slope, 5, x, 8, Pitch, 1, Random(4)));
  const Vec inside{ 4, 2, 1.5 }, places[2] = { { 2, 2, 1.5 }, { 6, 2, 1.5 } };
  Scans scans;
  for (size_t i = 0; i < hall.Points.size(); ++i)
  {
    const Vec& p = hall.Points[i];
    const Vec n = hall.Normals[i], turned{ -n[0], -n[1], -n[2] };
    scans.Add(p, Dot(Minus(inside, p), n) > 0.0 ? n : turned, places[p[0] < 4 ? 0 : 1]);
  }
  return scans;
}

Sampled Shifted(Sampled surface, double height, Random random)
{
  for (size_t i = 0; i < surface.Points.size(); ++i)
  {
    for (int c = 0; c < 3; ++c)
    {
      surface.Points[i][c] += random.Uniform(-height, height) * surface.Normals[i][c];
    }
  }
  return surface;
}

Sampled Turned(Sampled surface)
{
  for (Vec& n : surface.Normals)
  {
    n = { -n[0], -n[1], -n[2] };
  }
  return surface;
}
}

/// The shape alone says that it is seen from outside, or nothing. Wall and roof meet at 53 degrees;
/// within a spacing of the ridge a plane may be that of the other one.
TEST_CASE("Hall")
{
  const Scans hall = MakeHall();
  const auto data = ToData(hall);
  CHECK(SidesOf(Estimate(data, vtkSurfelEstimation::CONSISTENT), hall).Right < 0.1);
  const Sides sides = SidesOf(Estimate(data), hall);
  CHECK(sides.Wrong < 0.0015);
  CHECK(sides.Right > 0.995);
}

/// Of a thin screen each scanner has seen one side, whether both coincide or are half a spacing
/// apart, and though they mix in all neighbourhoods.
TEST_CASE("Sheet seen from both sides")
{
  const Vec x{ 1, 0, 0 }, y{ 0, 1, 0 };
  for (const double gap : { 0.0, 0.5 * Pitch, 2.0 * Pitch })
  {
    Scans scans;
    scans.Add(MakeRectangle({ 0, 0, 0 }, x, 3, y, 2, Pitch, 1, Random(5)), { 1, 1, 3 });
    scans.Add(Turned(MakeRectangle({ 0, 0, -gap }, x, 3, y, 2, Pitch, 1, Random(6))), { 2, 0, -2 });
    const Sides sides = SidesOf(Estimate(ToData(scans)), scans);
    CHECK(sides.Wrong < 0.001);
    CHECK(sides.Right > 0.99);
  }
}

/// Far from the scanner the noise of the normals is larger than the angle of the view.
TEST_CASE("Grazing view of a noisy floor")
{
  Scans scans;
  const Sampled floor =
    MakeRectangle({ 0, 0, 0 }, { 1, 0, 0 }, 24, { 0, 1, 0 }, 3, Pitch, 1, Random(7));
  scans.Add(Shifted(floor, 0.3 * Pitch, Random(8)), { -0.5, 1.5, 0.4 });
  const auto surfels = Estimate(ToData(scans));
  vtkIdType alone = 0;
  for (size_t i = 0; i < scans.Count(); ++i)
  {
    const Surfels all(surfels);
    const auto at = static_cast<vtkIdType>(i);
    const Vec way = Minus(scans.Places[i], scans.Surface.Points[i]);
    alone += Dot(all.AreaVector(at), way) < 0.0 ? 1 : 0;
  }
  CHECK(alone > static_cast<vtkIdType>(scans.Count() / 50)); // what each for itself has wrong
  const Sides sides = SidesOf(surfels, scans);
  CHECK(sides.Wrong == 0.0);
  CHECK(sides.Right > 0.999);
}

/// Each scanner sees one face, one of them by a narrow angle. Planes at the edge lean over both
/// faces: some turn their backs to their scanner.
TEST_CASE("Edges between two scans")
{
  Scans scans;
  scans.Add(MakeRectangle({ 0, 0, 0 }, { 0, -1, 0 }, 2, { 0, 0, -1 }, 2, Pitch, 1, Random(9)),
    { 1, 8, -1 });
  scans.Add(MakeRectangle({ 0, 0, 0 }, { -1, 0, 0 }, 2, { 0, -1, 0 }, 2, Pitch, 1, Random(10)),
    { -1, 0, 4 });
  const Sides sides = SidesOf(Estimate(ToData(scans)), scans);
  CHECK(sides.Wrong == 0.0);
  CHECK(sides.Right > 0.995);
}

/// What goes on from known scans has their side; what stands alone has two, closed or not.
TEST_CASE("Scans of unknown places")
{
  const Vec x{ 1, 0, 0 }, y{ 0, 1, 0 };
  Scans scans;
  scans.Add(MakeRectangle({ 0, 0, 0 }, x, 2, y, 2, Pitch, 1, Random(11)), { 1, 1, 2 });
  const size_t first = scans.Count();
  scans.Add(MakeRectangle({ 2, 0, 0 }, x, 2, y, 2, Pitch, 1, Random(12)), Unknown);
  const size_t second = scans.Count();
  Sampled ball = MakeSphere(0.5, 1500, Random(13));
  ball.Shift({ 1, 1, 5 });
  scans.Add(ball, Unknown);
  const auto surfels = Estimate(ToData(scans));
  CHECK(SidesOf(surfels, scans, 0, second).Wrong == 0.0);
  CHECK(SidesOf(surfels, scans, first, second).Right > 0.99);
  CHECK(SidesOf(surfels, scans, second, scans.Count()).Both == doctest::Approx(1.0));
  const auto data = ToData(scans);
  data->GetPointData()->GetArray("ToScanner")->SetTuple3(0, 0.0, NAN, 1.0);
  data->GetPointData()->GetArray("ToScanner")->SetTuple3(1, INFINITY, 0.0, 0.0);
  CHECK(SidesOf(Estimate(data), scans, 0, first).Right > 0.99);
}

/// Each part has the sides of the whole, without given normals.
TEST_CASE("Parts")
{
  const Scans hall = MakeHall();
  vtkNew<vtkPartitionedSurfelEstimation> parts;
  const Messages quiet(parts);
  parts->SetInputData(ToData(hall));
  parts->CleanPointsOff();
  parts->SetPointsPerPart(5000);
  parts->Update();
  CHECK(parts->GetNumberOfParts() > 5);
  const Sides sides = SidesOf(parts->GetOutput(), hall);
  CHECK(sides.Wrong < 0.0015);
  CHECK(sides.Right > 0.995);
  parts->UseSensorOff();
  parts->Update();
  CHECK(SidesOf(parts->GetOutput(), hall).Both == doctest::Approx(1.0));
}

/// One of them has points whose scanner nobody knows, and no array.
TEST_CASE("Several processes")
{
  Scans scans = MakeHall();
  const size_t half = scans.Count();
  scans.Add(
    MakeRectangle({ 8, 0, 0 }, { 1, 0, 0 }, 2, { 0, 1, 0 }, 4, Pitch, 1, Random(14)), Unknown);
  const auto one = Estimate(ToData(scans));
  vtkSmartPointer<vtkPolyData> found[2];
  ThreadController::Run(2, [&](vtkMultiProcessController* controller) {
    const int rank = controller->GetLocalProcessId();
    const auto data = rank == 0 ? ToData(scans, 0, half) : ToData(scans, half, scans.Count());
    if (rank == 1)
    {
      data->GetPointData()->RemoveArray("ToScanner");
    }
    vtkNew<vtkPointsToSurfels> filter;
    const Messages quiet(filter);
    filter->SetController(controller);
    filter->CleanPointsOff();
    filter->BuildHierarchyOff();
    filter->SetInputData(data);
    filter->Update();
    found[rank] = filter->GetOutput();
  });
  const Surfels whole(one);
  vtkIdType at = 0, differing = 0;
  for (const auto& part : found)
  {
    const Surfels some(part);
    for (vtkIdType i = 0; i < some.Count(); ++i, ++at)
    {
      differing += some.IsTwoSided(i) != whole.IsTwoSided(at) ||
          (!some.IsTwoSided(i) && Dot(some.AreaVector(i), whole.AreaVector(at)) < 0.0)
        ? 1
        : 0;
    }
  }
  CHECK(at == whole.Count());
  CHECK(differing == 0);
  CHECK(SidesOf(found[1], scans, half, scans.Count(), half).Right > 0.99);
}

/// The array is used without a setting, unless UseSensor is off; settings stay what they are.
TEST_CASE("Points to surfels")
{
  const Scans hall = MakeHall();
  vtkNew<vtkPointsToSurfels> filter;
  const Messages quiet(filter);
  filter->SetInputData(ToData(hall));
  filter->CleanPointsOff();
  filter->BuildHierarchyOff();
  filter->Update();
  CHECK(SidesOf(filter->GetOutput(), hall).Right > 0.995);
  CHECK(filter->GetEstimation()->GetOrientationMode() == vtkSurfelEstimation::CONSISTENT);

  Scans closed; // no scanner is known: its shape tells
  closed.Add(MakeSphere(1.0, 3000, Random(15)), Unknown);
  filter->SetInputData(ToData(closed));
  filter->Update();
  CHECK(SidesOf(filter->GetOutput(), closed).Right == doctest::Approx(1.0));

  filter->SetInputData(ToData(hall));
  filter->UseSensorOff();
  filter->Update();
  CHECK(SidesOf(filter->GetOutput(), hall).Right < 0.1);
}

TEST_CASE("Troubles")
{
  const Scans hall = MakeHall();
  const auto data = ToPolyData(hall.Surface.Points);
  vtkNew<vtkSurfelEstimation> estimation;
  Messages messages(estimation);
  estimation->SetInputData(data);
  estimation->SetOrientationModeToScanners();
  estimation->Update();
  REQUIRE(!messages.Errors.empty());
  CHECK(messages.Errors[0].find("no point array \"ToScanner\"") != std::string::npos);
  const auto given = ToData(hall);
  AddNormals(given, Turned(hall.Surface).Normals);
  CHECK(SidesOf(Estimate(given), hall).Wrong == doctest::Approx(1.0)); // given normals stay
}
