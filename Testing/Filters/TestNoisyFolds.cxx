// SPDX-License-Identifier: BSD-3-Clause
// Cleaning keeps the folds of noisy clouds sharp, and makes none where there is none.
#include "CleaningTesting.h"

#include "vtkPointCloudCleaning.h"

#include <limits>

using namespace SurfelTesting;

namespace
{
/// Normal distribution.
double Gauss(Random& random)
{
  const double length = std::sqrt(-2.0 * std::log(1.0 - random()));
  return length * std::cos(2.0 * Pi * random());
}

/// Two half planes of random points that meet in the y axis at right angles, with noise, in
/// spacings.
std::vector<Vec> NoisyFold(int count, double share)
{
  const double length = std::sqrt(0.5 * count);
  Random random(3);
  std::vector<Vec> points(count);
  for (int i = 0; i < count; ++i)
  {
    const double away = length * random(), along = length * (random() - 0.5);
    const double off = share * Gauss(random);
    points[i] = i % 2 == 0 ? Vec{ away, along, off } : Vec{ -off, along, -away };
  }
  return points;
}

constexpr int GroundPoints = 20000, SheetPoints = 100, OtherPoints = 150, SheetPairs = 80;

/// A noisy ground, and pairs of sheets: one of 10 x 10 spacings that bends a little, and one that
/// begins beside it, four spacings away, and goes down.
/// @param shift of the second sheets, along the gap
std::vector<Vec> SheetsOverGround(double angle, double shift)
{
  constexpr double noise = 0.3, curvature = 0.05, gap = 4.0;
  Random random(5);
  std::vector<Vec> points;
  for (int i = 0; i < GroundPoints; ++i)
  {
    points.push_back({ 140.0 * random(), 140.0 * random(), noise * Gauss(random) });
  }
  const double cosine = std::cos(angle), sine = std::sin(angle);
  for (int pair = 0; pair < SheetPairs; ++pair)
  {
    const double x = 80.0 * (pair % 10), y = 80.0 * (pair / 10), z = 200.0;
    for (int i = 0; i < SheetPoints; ++i)
    {
      const double away = 10.0 * random(), along = 10.0 * random();
      const double height = noise * Gauss(random) - 0.5 * curvature * away * away;
      points.push_back({ x - away, y + along, z + height });
    }
    for (int i = 0; i < OtherPoints; ++i)
    {
      const double away = 15.0 * random(), along = 10.0 * random(), off = noise * Gauss(random);
      points.push_back({ x + gap + cosine * away + sine * off, y + along + shift,
        z - sine * away + cosine * off });
    }
  }
  return points;
}

/// Of the first sheets' points that have `neighbors` points nearer than the second sheet: which
/// have another place than in the other cloud.
int CountOthers(const std::vector<Vec>& points, int neighbors, vtkPointSet* a, vtkPointSet* b)
{
  int others = 0;
  for (int first = GroundPoints; first < static_cast<int>(points.size());
       first += SheetPoints + OtherPoints)
  {
    const int end = first + SheetPoints;
    for (int i = first; i < end; ++i)
    {
      double nearest = std::numeric_limits<double>::infinity();
      for (int k = end; k < end + OtherPoints; ++k)
      {
        nearest = std::min(nearest, Length(Minus(points[k], points[i])));
      }
      int nearer = -1; // without the point itself
      for (int k = first; k < end; ++k)
      {
        nearer += Length(Minus(points[k], points[i])) < nearest ? 1 : 0;
      }
      Vec p, q;
      a->GetPoint(i, p.data());
      b->GetPoint(i, q.data());
      others += nearer >= neighbors && Length(Minus(p, q)) > 1e-6 ? 1 : 0;
    }
  }
  return others;
}
}

/// Quadrics alone are off by 0.25 and 0.42 spacings (root mean square), roofs by 0.14 and 0.18.
TEST_CASE("Noisy folds stay sharp")
{
  for (const double share : { 0.3, 0.6 })
  {
    vtkNew<vtkPointCloudCleaning> cleaning;
    const Messages quiet(cleaning);
    cleaning->RemoveStrayPointsOff();
    cleaning->SetInputData(ToPolyData(NoisyFold(20000, share), VTK_DOUBLE));
    cleaning->Update();
    double squares = 0.0, count = 0.0;
    for (vtkIdType i = 0; i < cleaning->GetOutput()->GetNumberOfPoints(); ++i)
    {
      Vec p;
      cleaning->GetOutput()->GetPoint(i, p.data());
      // To the half plane z = 0, x > 0, or x = 0, z < 0.
      const double off =
        std::min(std::hypot(std::min(p[0], 0.0), p[2]), std::hypot(p[0], std::max(p[2], 0.0)));
      if (std::hypot(p[0], p[2]) < 1.0 && std::abs(p[1]) < 40.0)
      {
        squares += off * off;
        count += 1.0;
      }
    }
    CAPTURE(share);
    CHECK(count > 100.0);
    CHECK(std::sqrt(squares / count) < 0.3 * share + 0.08);
  }
}

/// Points of a leaf went to the fold of two planes, through their own leaf and the next one, and
/// left a neighbour alone. Of about 11,000 points here, 97 have another place if folds may be
/// farther than the 32 neighbours of the smoothing, else 58: the second sheet also changes the
/// noise that is measured.
TEST_CASE("Planes of two sheets are no fold")
{
  int others = 0;
  for (const double angle : { Pi / 3.0, Pi / 2.0 })
  {
    vtkSmartPointer<vtkPointSet> smooth[2];
    const std::vector<Vec> points = SheetsOverGround(angle, 0.0);
    for (const int isFar : { 0, 1 })
    {
      vtkNew<vtkPointCloudCleaning> cleaning;
      const Messages quiet(cleaning);
      cleaning->RemoveStrayPointsOff();
      cleaning->SetInputData(ToPolyData(SheetsOverGround(angle, 30.0 * isFar), VTK_DOUBLE));
      cleaning->Update();
      CHECK(cleaning->GetNumberOfMovedPoints() > 0.99 * static_cast<double>(points.size()));
      smooth[isFar] = cleaning->GetOutput();
    }
    others += CountOthers(points, 32, smooth[0], smooth[1]);
  }
  CHECK(others < 75);
}
