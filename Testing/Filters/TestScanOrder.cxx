// SPDX-License-Identifier: BSD-3-Clause
// Places of scanners that the order of the points tells: scans in lines up, in rounds and in rows,
// with noise, rounded, with points that are missing, thinned at random, of several beams, one after
// another; and points that are in no such order.
#include "SurfelTesting.h"

#include "vtkPartitionedSurfelEstimation.h"
#include "vtkPointsToSurfels.h"

#include "vtkFloatArray.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

using namespace SurfelTesting;

namespace
{
constexpr double Infinity = std::numeric_limits<double>::infinity();
constexpr double Pi = 3.14159265358979;

/// Boxes in a room, whose walls are seen from inside.
struct Box
{
  Vec Low, High;
};
const Box Room{ { 0, 0, 0 }, { 7, 6, 3 } };
const std::vector<Box> Things{ { { 1, 1, 0 }, { 1.6, 1.5, 1.8 } }, { { 4, 0.5, 0 }, { 5, 1, 0.8 } },
  { { 5.5, 4, 0.5 }, { 6.4, 4.6, 0.6 } }, { { 2, 4.5, 0 }, { 2.2, 4.7, 2.2 } },
  { { 0.8, 3.2, 0 }, { 1.4, 3.6, 1 } } };

/// Distance along a ray to where it enters a box, or leaves the room.
double DistanceTo(const Box& box, const Vec& place, const Vec& ray, bool leaves)
{
  double enter = -Infinity, leave = Infinity;
  for (int c = 0; c < 3; ++c)
  {
    const double a = (box.Low[c] - place[c]) / ray[c], b = (box.High[c] - place[c]) / ray[c];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  return leaves ? leave : enter < leave && enter > 0.0 ? enter : Infinity;
}

Vec Measure(const Vec& place, const Vec& ray, double noise)
{
  double distance = DistanceTo(Room, place, ray, true);
  for (const Box& thing : Things)
  {
    distance = std::min(distance, DistanceTo(thing, place, ray, false));
  }
  distance += noise;
  return { place[0] + distance * ray[0], place[1] + distance * ray[1],
    place[2] + distance * ray[2] };
}

enum class Order
{
  Lines, // up, one beside another
  Rounds // one above another
};

struct Scanner
{
  Vec Place{ 3.3, 2.6, 1.5 };
  Order Lines = Order::Lines;
  double Noise = 0.003;
  double Step = Pi / 360.0;
};

std::vector<Vec> Scan(const Scanner& scanner)
{
  const int around = static_cast<int>(std::lround(2.0 * Pi / scanner.Step)), up = around / 3;
  const bool inLines = scanner.Lines == Order::Lines;
  Random random(3);
  std::vector<Vec> points;
  for (int i = 0; i < around * up; ++i)
  {
    const int column = inLines ? i / up : i % around, row = inLines ? i % up : i / around;
    const double a = scanner.Step * (column + 0.3), b = scanner.Step * (row - 0.5 * up + 0.2);
    const Vec ray{ std::cos(b) * std::cos(a), std::cos(b) * std::sin(a), std::sin(b) };
    points.push_back(Measure(scanner.Place, ray, scanner.Noise * random.Uniform(-1.7, 1.7)));
  }
  return points;
}

/// A depth camera, row by row; NaN where it sees nothing.
std::vector<Vec> DepthImage(const Vec& place)
{
  constexpr int columns = 320, rows = 240;
  std::vector<Vec> points;
  for (int i = 0; i < columns * rows; ++i)
  {
    const double x = (i % columns + 0.5) / columns - 0.5, y = (i / columns + 0.5) / columns - 0.375;
    const double scale = 1.0 / std::sqrt(1.0 + x * x + y * y);
    const Vec p = Measure(place, { scale, scale * x, -scale * y }, 0.0);
    points.push_back(i % 37 == 5 ? Vec{ NAN, NAN, NAN } : p);
  }
  return points;
}

void Shuffle(std::vector<Vec>& points)
{
  Random random(5);
  for (size_t i = points.size(); i > 1; --i)
  {
    std::swap(
      points[i - 1], points[static_cast<size_t>(random.Integer(0, static_cast<int>(i) - 1))]);
  }
}

/// The places that points know, NaN for those that know none; empty if none was found.
std::vector<Vec> PlacesOf(const std::vector<Vec>& points)
{
  const auto data = ToPolyData(points, VTK_DOUBLE);
  vtkNew<vtkFloatArray> ways;
  std::vector<Vec> places;
  if (vtkPointsToSurfels::FindScannersByOrder(data, ways))
  {
    CHECK(std::string(ways->GetName()) == "ToScanner");
    REQUIRE(ways->GetNumberOfTuples() == static_cast<vtkIdType>(points.size()));
    for (size_t i = 0; i < points.size(); ++i)
    {
      Vec way;
      ways->GetTuple(static_cast<vtkIdType>(i), way.data());
      const Vec& p = points[i];
      const bool isKnown = Length(way) > 0.0;
      places.push_back(
        isKnown ? Vec{ p[0] + way[0], p[1] + way[1], p[2] + way[2] } : Vec{ NAN, NAN, NAN });
    }
  }
  return places;
}

/// Part of some points that know a place, within a distance.
double PartAt(const std::vector<Vec>& places, const Vec& place, double within, size_t begin = 0,
  size_t end = std::numeric_limits<size_t>::max())
{
  size_t known = 0;
  end = std::min(end, places.size());
  for (size_t i = begin; i < end; ++i)
  {
    known += Length(Minus(places[i], place)) < within ? 1 : 0;
  }
  return end > begin ? static_cast<double>(known) / static_cast<double>(end - begin) : 0.0;
}

TEST_CASE("One scanner")
{
  for (const Order order : { Order::Lines, Order::Rounds })
  {
    Scanner scanner;
    scanner.Lines = order;
    std::vector<Vec> points = Scan(scanner);
    CHECK(PartAt(PlacesOf(points), scanner.Place, 0.003) == 1.0);
    for (Vec& p : points)
    {
      for (double& x : p)
      {
        x = 0.001 * std::round(1000.0 * x);
      }
    }
    CHECK(PartAt(PlacesOf(points), scanner.Place, 0.01) == 1.0);
  }
}

/// Those that are left, each with a probability.
std::vector<Vec> Thinned(const std::vector<Vec>& points, double probability)
{
  std::vector<Vec> left;
  Random random(7);
  std::copy_if(points.begin(), points.end(), std::back_inserter(left),
    [&](const Vec&) { return random.Uniform(0, 1) < probability; });
  return left;
}

TEST_CASE("Points that are missing")
{
  CHECK(PartAt(PlacesOf(Thinned(Scan({}), 0.95)), Scanner().Place, 0.003) == 1.0);
}

TEST_CASE("Thinned at random")
{
  for (const Order order : { Order::Lines, Order::Rounds })
  {
    Scanner scanner;
    scanner.Lines = order;
    scanner.Step = Pi / 720.0;
    const std::vector<Vec> points = Scan(scanner);
    CHECK(PartAt(PlacesOf(Thinned(points, 0.5)), scanner.Place, 0.003) == 1.0);
    CHECK(PartAt(PlacesOf(Thinned(points, 0.25)), scanner.Place, 0.005) == 1.0);
  }
}

/// Sixteen beams in turn, as they are fired: each with the next but seven.
std::vector<Vec> ScanInTurns(const Vec& place)
{
  constexpr int beams = 16, around = 1800;
  Random random(11);
  std::vector<Vec> points;
  for (int i = 0; i < beams * around; ++i)
  {
    const int beam = i % 2 == 0 ? i % beams / 2 : i % beams / 2 + beams / 2;
    const double a = 2.0 * Pi * i / (beams * around), b = (2 * beam - 15) * Pi / 180.0;
    const Vec ray{ std::cos(b) * std::cos(a), std::cos(b) * std::sin(a), std::sin(b) };
    points.push_back(Measure(place, ray, 0.01 * random.Uniform(-1.7, 1.7)));
  }
  return points;
}

TEST_CASE("Several beams")
{
  const Vec place{ 3.3, 2.6, 1.1 };
  const std::vector<Vec> points = ScanInTurns(place);
  CHECK(PartAt(PlacesOf(points), place, 0.005) == 1.0);
  CHECK(PartAt(PlacesOf(Thinned(points, 0.95)), place, 0.005) > 0.95);
}

TEST_CASE("A depth camera")
{
  const Vec place{ 0.5, 2.8, 1.6 };
  const std::vector<Vec> points = DepthImage(place);
  CHECK(PartAt(PlacesOf(points), place, 0.01) > 36.0 / 37.0 - 0.001);
}

TEST_CASE("Scans one after another")
{
  Scanner second;
  second.Place = { 5.2, 2.1, 1.3 };
  const std::vector<Vec> a = Scan({}), b = Scan(second);
  std::vector<Vec> all = a;
  all.insert(all.end(), b.begin(), b.end());
  for (Vec& p : all)
  {
    p[0] += 400000.0; // map coordinates
  }
  all[100] = { Infinity, 0.0, 0.0 }; // nothing came back
  all[200] = { -9999.0, 0.0, 0.0 };  // nor here
  const std::vector<Vec> places = PlacesOf(all);
  const Vec first{ 400003.3, 2.6, 1.5 }, other{ 400005.2, 2.1, 1.3 };
  CHECK(PartAt(places, first, 0.005, 0, a.size()) > 0.99);
  CHECK(PartAt(places, other, 0.005, a.size()) > 0.99);
}

/// Nothing is said of points in no order that come after a scan.
TEST_CASE("Points of elsewhere")
{
  const std::vector<Vec> scan = Scan({});
  std::vector<Vec> mixed = scan;
  Shuffle(mixed);
  CHECK(PlacesOf(mixed).empty());
  mixed.insert(mixed.begin(), scan.begin(), scan.end());
  const std::vector<Vec> places = PlacesOf(mixed);
  CHECK(PartAt(places, Scanner().Place, 0.003, 0, scan.size()) > 0.99);
  CHECK(PartAt(places, Scanner().Place, 1e6, scan.size()) < 0.01);
}

/// A grid of heights jumps along parallel lines, also where points are missing, and a lattice not
/// at all. Sorted by cells, a scan jumps from one to the next.
TEST_CASE("Other orders")
{
  std::vector<Vec> heights, lattice, sorted = Scan({});
  Random random(9);
  for (int i = 0; i < 400 * 300; ++i)
  {
    const bool isHouse = i % 400 / 20 % 2 == 0 && i / 400 / 15 % 2 == 0;
    heights.push_back({ 0.5 * (i % 400), 0.5 * (i / 400),
      (isHouse ? 9.0 : 0.0) + 0.02 * random.Uniform(-1.7, 1.7) });
    lattice.push_back({ 0.1 * (i % 50), 0.1 * (i / 50 % 50), 0.1 * (i / 2500) });
  }
  const auto cell = [](const Vec& p) {
    return std::array<double, 3>{ std::floor(20.0 * p[0]), std::floor(20.0 * p[1]),
      std::floor(20.0 * p[2]) };
  };
  std::stable_sort(
    sorted.begin(), sorted.end(), [&](const Vec& a, const Vec& b) { return cell(a) < cell(b); });
  CHECK(PlacesOf(heights).empty());
  CHECK(PlacesOf(Thinned(heights, 0.5)).empty());
  CHECK(PlacesOf(lattice).empty());
  CHECK(PlacesOf(sorted).empty());
  CHECK(PlacesOf({}).empty());
  CHECK(PlacesOf({ { 1, 2, 3 } }).empty());
  CHECK(PlacesOf(std::vector<Vec>(1000, { NAN, 0, 0 })).empty());
  CHECK(PlacesOf(std::vector<Vec>(1000, { 1, 1, 1 })).empty());
}

TEST_CASE("Threads")
{
  const std::vector<Vec> whole = Scan({});
  for (const std::vector<Vec>& points : { whole, Thinned(whole, 0.5) })
  {
    const auto places = WithThreads({ 1, 2, 8 }, [&] { return PlacesOf(points); });
    CHECK(!places[0].empty());
    CHECK(places[1] == places[0]);
    CHECK(places[2] == places[0]);
  }
}

/// Without being told, the walls of a room face its scanner, also in parts.
TEST_CASE("Sides")
{
  const Vec place = Scanner().Place;
  const auto data = ToPolyData(Scan({}), VTK_DOUBLE);
  vtkNew<vtkPointsToSurfels> whole;
  whole->BuildHierarchyOff();
  vtkNew<vtkPartitionedSurfelEstimation> parts;
  parts->SetPointsPerPart(20000);
  for (vtkPointsToSurfelsBase* filter :
    { static_cast<vtkPointsToSurfelsBase*>(whole), static_cast<vtkPointsToSurfelsBase*>(parts) })
  {
    const Messages quiet(filter);
    filter->SetInputData(data);
    filter->Update();
    const Surfels surfels(filter->GetOutput());
    const vtkIdType count = filter->GetOutput()->GetNumberOfPoints();
    vtkIdType facing = 0;
    for (vtkIdType i = 0; i < count; ++i)
    {
      double p[3];
      filter->GetOutput()->GetPoint(i, p);
      const bool faces = Dot(surfels.AreaVector(i), Minus(place, { p[0], p[1], p[2] })) > 0.0;
      facing += faces && !surfels.IsTwoSided(i) ? 1 : 0;
    }
    CHECK(static_cast<double>(facing) > 0.97 * static_cast<double>(count));
    CHECK(!data->GetPointData()->HasArray("ToScanner")); // the input stays as it is
  }
  // Without the sensor nothing looks for scanners, nor does the only part of a cloud.
  parts->SetPointsPerPart(data->GetNumberOfPoints());
  parts->UseSensorOff();
  whole->UseSensorOff();
  double shares[2];
  for (int k = 0; k < 2; ++k)
  {
    vtkPointsToSurfelsBase* filter = k == 0 ? static_cast<vtkPointsToSurfelsBase*>(whole)
                                            : static_cast<vtkPointsToSurfelsBase*>(parts);
    const Messages quiet(filter);
    filter->Update();
    const Surfels surfels(filter->GetOutput());
    double twoSided = 0.0;
    for (vtkIdType i = 0; i < surfels.Count(); ++i)
    {
      twoSided += surfels.IsTwoSided(i) ? 1.0 : 0.0;
    }
    shares[k] = twoSided / static_cast<double>(surfels.Count());
  }
  std::cout << "two-sided without the sensor: " << shares[0] << ", " << shares[1] << "\n";
  CHECK(shares[0] == shares[1]);
}
}
