// SPDX-License-Identifier: BSD-3-Clause
// Lines of points: of a scanner, between which surfaces are closed, and on rods and wires, which
// are no sheets.
#include "SurfelTesting.h"

#include "vtkSurfelEstimation.h"

#include "vtkFloatArray.h"
#include "vtkPointData.h"
#include "vtkSmartPointer.h"

#include <algorithm>
#include <cmath>

using namespace SurfelTesting;

namespace
{
/// A wall with points `pitch` apart.
Sampled MakeWall(double pitch)
{
  return MakeRectangle({ 0, 0, 0 }, { 1, 0, 0 }, 1, { 0, 1, 0 }, 1, pitch, 0.4, Random(5));
}

/// Points with the vectors to their scanners.
vtkSmartPointer<vtkPolyData> SeenFrom(
  const std::vector<Vec>& scanners, const std::vector<Vec>& points)
{
  vtkNew<vtkFloatArray> ways;
  ways->SetName("ToScanner");
  ways->SetNumberOfComponents(3);
  for (size_t i = 0; i < points.size(); ++i)
  {
    const Vec &from = points[i], &to = scanners[i % scanners.size()];
    ways->InsertNextTuple3(to[0] - from[0], to[1] - from[1], to[2] - from[2]);
  }
  const vtkSmartPointer<vtkPolyData> cloud = ToPolyData(points);
  cloud->GetPointData()->AddArray(ways);
  return cloud;
}

/// The rods of a railing before a wall, each with one row of points: they look like scan lines, but
/// become no sheet, also where a scanner is known that sees them ten steps apart. A stray point
/// beside them is no larger than they are.
TEST_CASE("Rods")
{
  const double pitch = 0.01;
  std::vector<Vec> points = MakeWall(pitch).Points;
  const auto stray = static_cast<vtkIdType>(points.size());
  points.push_back({ 0.115, 0.4, 0.4 });
  const size_t first = points.size();
  Random random(6);
  for (int rod = 0; rod < 6; ++rod)
  {
    for (int k = 0; k < 30; ++k)
    {
      points.push_back({ 0.2 + 0.1 * rod + 0.1 * pitch * random(),
        0.25 + pitch * (k + 0.2 * random()), 0.4 + 0.1 * pitch * random() });
    }
  }
  for (const bool isSeen : { false, true })
  {
    CAPTURE(isSeen);
    vtkNew<vtkSurfelEstimation> estimation;
    estimation->SetInputData(isSeen ? SeenFrom({ { 0.5, 0.4, 3.0 } }, points) : ToPolyData(points));
    estimation->Update();
    const Surfels surfels(estimation->GetOutput());
    for (size_t i = first; i < points.size(); ++i)
    {
      const auto id = static_cast<vtkIdType>(i);
      CHECK(surfels.Area(id) <= 4.0 * pitch * pitch);
      CHECK(surfels.IsTwoSided(id));
    }
    CHECK(surfels.Area(stray) <= 9.0 * pitch * pitch);
  }
}

/// Wires with nothing but other wires around, 14 and more times as far as their points, become no
/// curtains.
TEST_CASE("Wires")
{
  const double pitch = 0.05;
  std::vector<Vec> points = MakeWall(0.004).Points;
  const size_t first = points.size();
  Random random(7);
  for (const auto& [x, y] : { std::pair(0.0, 3.0), std::pair(0.5, 3.5), std::pair(0.0, 4.1) })
  {
    for (int k = 0; k < 400; ++k)
    {
      const double along = pitch * (k + 0.4 * random()), sag = 0.004 * along * (20.0 - along);
      points.push_back({ x + 0.05 * pitch * random(), y - sag + 0.05 * pitch * random(), along });
    }
  }
  vtkNew<vtkSurfelEstimation> estimation;
  estimation->SetInputData(ToPolyData(points));
  estimation->Update();
  const Surfels surfels(estimation->GetOutput());
  std::vector<double> areas;
  for (size_t i = first; i < points.size(); ++i)
  {
    areas.push_back(surfels.Area(static_cast<vtkIdType>(i)) / (pitch * pitch));
  }
  CHECK(AtShare(areas, 0.97) <= 4.0);
}

/// The points of the wires of a fence, as thick as their pitch, which cross every six: sixteen
/// neighbours lie in no plane.
std::vector<Vec> MakeFence(double pitch)
{
  std::vector<Vec> points;
  Random random(8);
  for (int wire = 0; wire < 2 * 15; ++wire)
  {
    for (int k = 0; k < 90; ++k)
    {
      const double across = 6.0 * pitch * (wire / 2 + 0.5), along = pitch * (k + random());
      const double angle = 2.0 * Pi * random(), height = 0.5 * pitch * std::cos(angle);
      const double beside = across + 0.5 * pitch * std::sin(angle);
      points.push_back(wire % 2 == 0 ? Vec{ beside, along, 0.4 + height }
                                     : Vec{ along, beside, 0.4 - pitch + height });
    }
  }
  return points;
}

/// Area of a fence's surfels, before a wall.
double AreaOfFence(vtkSurfelEstimation* estimation)
{
  const double pitch = 0.01;
  std::vector<Vec> points = MakeWall(pitch).Points;
  const size_t first = points.size();
  const std::vector<Vec> fence = MakeFence(pitch);
  points.insert(points.end(), fence.begin(), fence.end());
  estimation->SetInputData(ToPolyData(points));
  estimation->Update();
  const Surfels surfels(estimation->GetOutput());
  double area = 0.0;
  for (size_t i = first; i < points.size(); ++i)
  {
    area += surfels.Area(static_cast<vtkIdType>(i));
  }
  return area;
}

/// Chain link stays open, also where it is known which sensor saw it. All around, its wires have
/// 0.85; kernels that reach the next wire 1.2.
TEST_CASE("Fence")
{
  vtkNew<vtkSurfelEstimation> estimation;
  for (const bool isSeen : { false, true })
  {
    CAPTURE(isSeen);
    estimation->SetOrientationMode(
      isSeen ? vtkSurfelEstimation::VIEWPOINT : vtkSurfelEstimation::CONSISTENT);
    estimation->SetViewpoint(0.0, 0.0, 10.0);
    const double area = AreaOfFence(estimation);
    CHECK(area < 0.85);
    CHECK(area > 0.3);
  }
}

/// A scanner that looks along a floor has lines on it 12 times as far apart as their points, at the
/// foot of a wall.
class FloorAtWall
{
public:
  static constexpr double Pitch = 0.01, Apart = 12.0 * Pitch;

  std::vector<Vec> Points;
  size_t First; // of the floor

  /// @param noise along the line of sight
  FloorAtWall(double wallPitch, double noise)
    : Points(MakeWall(wallPitch).Points)
    , First(Points.size())
  {
    Random random(6);
    for (int row = 0; row < 20; ++row)
    {
      for (int k = 0; k < 100; ++k)
      {
        const double away = noise * (random() - 0.5);
        this->Points.push_back(
          { Pitch * (k + 0.2 * random()), 0.05 * away, Apart * (row + 1) - 0.99 * away });
      }
    }
  }

  /// With the scanner each line is the next that it sees.
  vtkSmartPointer<vtkPolyData> Seen() const
  {
    return SeenFrom({ { 0.5, 0.18, 3.4 } }, this->Points);
  }
};

/// The area of the points behind `begin` over that of this floor.
double AreaOfFloor(const FloorAtWall& floor, double begin, bool isSeen = false)
{
  vtkNew<vtkSurfelEstimation> estimation;
  estimation->SetInputData(isSeen ? floor.Seen() : ToPolyData(floor.Points));
  estimation->Update();
  const Surfels surfels(estimation->GetOutput());
  double area = 0.0, expected = 0.0;
  for (size_t i = floor.First; i < floor.Points.size(); ++i)
  {
    if (floor.Points[i][2] > begin * FloorAtWall::Apart)
    {
      area += surfels.Area(static_cast<vtkIdType>(i));
      expected += FloorAtWall::Pitch * FloorAtWall::Apart;
    }
  }
  return area / expected;
}

/// The floor stays closed: where there are lines all around, and, since its noise is within it or
/// its scanner is known, beside a wall that is dense, too.
TEST_CASE("Scan lines at the foot of a wall")
{
  CHECK_NEAR(AreaOfFloor({ 0.004, 0.0 }, 3.5), 1.0, 0.1);
  CHECK_NEAR(AreaOfFloor({ 0.0025, 0.01 }, 0.5), 1.0, 0.1);
  CHECK_NEAR(AreaOfFloor({ 0.0025, 0.0 }, 0.5, true), 1.0, 0.1);
}

/// This floor with a shadow on it: the twenty points of the line before it, which has no next one
/// there, look like a rod, but those beside them are not its ends.
TEST_CASE("Scan lines beside a shadow")
{
  FloorAtWall floor(0.0025, 0.0);
  std::vector<Vec>& points = floor.Points;
  const auto isInShadow = [](const Vec& p) {
    return std::abs(p[0] - 0.5) < 0.1 && p[2] > 1.5 * FloorAtWall::Apart &&
      p[2] < 4.5 * FloorAtWall::Apart;
  };
  points.erase(std::remove_if(points.begin(), points.end(), isInShadow), points.end());
  vtkNew<vtkSurfelEstimation> estimation;
  estimation->SetInputData(floor.Seen());
  estimation->Update();
  const Surfels surfels(estimation->GetOutput());
  int small = 0;
  for (size_t i = floor.First; i < points.size(); ++i)
  {
    const double area = surfels.Area(static_cast<vtkIdType>(i));
    small += area < 0.3 * FloorAtWall::Pitch * FloorAtWall::Apart ? 1 : 0;
  }
  CHECK(small <= 22);
}

/// The area of a floor on which the lines of five scanners beside each other fall together: bands
/// that are 0.1 wide and 0.4 apart, with points 0.08 apart of each scanner. Over that of the floor
/// between the outermost bands. A wall is far behind.
double AreaOfBands(bool areSeen)
{
  std::vector<Vec> points, scanners;
  Random random(11);
  const double pitch = 0.08, apart = 0.4;
  for (int scanner = 0; scanner < 5; ++scanner)
  {
    scanners.push_back({ 0.4 * scanner, -4.0, 0.9 });
  }
  for (int band = 0; band < 6; ++band)
  {
    for (int k = 0; k < 50; ++k)
    {
      for (int scanner = 0; scanner < 5; ++scanner)
      {
        points.push_back(
          { pitch * (k + 0.2 * scanner), apart * band + 0.1 * (random() - 0.5), 0.0 });
      }
    }
  }
  // Among many others that are spread evenly.
  for (const Vec& p :
    MakeRectangle({ 0, 4, 0 }, { 1, 0, 0 }, 10, { 0, 0, 1 }, 10, pitch, 0.4, Random(5)).Points)
  {
    points.push_back(p);
  }
  vtkNew<vtkSurfelEstimation> estimation;
  estimation->SetInputData(areSeen ? SeenFrom(scanners, points) : ToPolyData(points));
  estimation->SetOrientationModeToTwoSided();
  estimation->Update();
  const Surfels surfels(estimation->GetOutput());
  double area = 0.0;
  for (vtkIdType i = 0; i < surfels.Count(); ++i)
  {
    const double y = surfels.Position(i)[1];
    area += y > 0.5 * apart && y < 4.5 * apart ? surfels.Area(i) : 0.0;
  }
  return area / (50 * pitch * 4 * apart);
}

/// Between lines that a scanner sees next to each other a surface is closed, though they are six
/// spacings apart. Where no scanner is known, that is a hole.
TEST_CASE("Lines of several scanners")
{
  CHECK_NEAR(AreaOfBands(true), 1.0, 0.1);
  CHECK(AreaOfBands(false) < 0.8);
}

/// The sums of kernels at 160 x 160 places of the plane z = 0.
class Coverage
{
public:
  static constexpr int Places = 160, Reach = 8;
  static constexpr double Step = 0.01;

  explicit Coverage(const Surfels& surfels)
    : Sums(Places * Places)
  {
    for (vtkIdType k = 0; k < surfels.Count(); ++k)
    {
      const Vec p = surfels.Position(k);
      const int x = static_cast<int>(p[0] / Step), y = static_cast<int>(p[1] / Step);
      for (int i = std::max(x - Reach, 0); i < std::min(x + Reach, Places); ++i)
      {
        for (int j = std::max(y - Reach, 0); j < std::min(y + Reach, Places); ++j)
        {
          this->Sums[Places * i + j] += surfels.Kernel(k, { Step * i, Step * j, 0.0 });
        }
      }
    }
  }

  double At(int i, int j) const { return this->Sums[Places * i + j]; }

private:
  std::vector<double> Sums;
};

/// A square hole.
struct Window
{
  double From, To;

  bool Has(double x, double y, double border) const
  {
    return std::min(x, y) > this->From - border && std::max(x, y) < this->To + border;
  }
};

/// A wall of 1.6 x 1.6 with a window, which three scanners that turn have seen: their lines are
/// eight steps apart, cross each other at small angles, and fall together in places.
struct TurningScanners
{
  static constexpr double Step = 0.005, Size = 1.6;
  static constexpr Window Opening{ 0.6, 1.0 };

  static std::vector<Vec> Points(double noise)
  {
    std::vector<Vec> points;
    Random random(12);
    for (int scanner = 0; scanner < 3; ++scanner)
    {
      const double slope = 0.025 * (scanner - 1), phase = random();
      for (int line = -2; line < 44; ++line)
      {
        for (double x = Step * random(); x < Size; x += Step)
        {
          const double y = 8.0 * Step * (line + phase) + slope * x;
          if (y > 0.0 && y < Size && !Opening.Has(x, y, 0.0))
          {
            points.push_back({ x, y, noise * Step * (random() + random() - 1.0) });
          }
        }
      }
    }
    return points;
  }
};

/// Between the lines of scanners that turn a surface is closed, wherever these fall together, and
/// its windows stay open.
TEST_CASE("Lines of scanners that turn")
{
  for (const double noise : { 0.3, 1.5 })
  {
    CAPTURE(noise);
    vtkNew<vtkSurfelEstimation> estimation;
    estimation->SetInputData(ToPolyData(TurningScanners::Points(noise)));
    estimation->Update();
    const Surfels surfels(estimation->GetOutput());
    int open = 0, places = 0, closed = 0, inWindow = 0;
    const Coverage coverage(surfels);
    for (int i = 10; i < 150; ++i)
    {
      for (int j = 10; j < 150; ++j)
      {
        const double x = Coverage::Step * i, y = Coverage::Step * j;
        const bool isCovered = coverage.At(i, j) > 0.25;
        if (TurningScanners::Opening.Has(x, y, -0.05))
        {
          ++inWindow;
          closed += isCovered ? 1 : 0;
        }
        else if (!TurningScanners::Opening.Has(x, y, 0.05))
        {
          ++places;
          open += isCovered ? 0 : 1;
        }
      }
    }
    CHECK(open <= 0.002 * places);
    CHECK(closed <= 0.01 * inWindow);
  }
}
}
