// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Estimation/ScannerView.h"

#include "Filters/Common/ArrayTuples.h"
#include "Filters/Estimation/ScanLines.h"
#include "Filters/Neighbors/LocalCloud.h"
#include "Filters/Neighbors/Neighbors.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace SurfelGeometry
{
namespace
{
/// Places of scanners are one if they differ by less than this part of the range: smoothing moves
/// points, but not their vectors.
constexpr double SameScanner = 0.01;

/// A line seen so steeply, as the sine of the angle to the line of sight, has no steps along it.
constexpr double LeastSlant = 0.2;

/// The next line is so many steps along the line away, at least and at most.
constexpr double NearestLine = 0.5, FarthestLine = 2.0;
}

bool ScannerView::GetScanner(int j, Vector3& scanner) const
{
  double way[3];
  ReadTuple(this->ToScanner, this->Cloud.InputIds[j], way);
  const double squared = way[0] * way[0] + way[1] * way[1] + way[2] * way[2];
  scanner = Load(this->Cloud.Position(j)) + Vector3{ way[0], way[1], way[2] };
  return squared > 0.0 && std::isfinite(squared);
}

bool ScannerView::LookAt(int i)
{
  if (!this->ToScanner || !this->GetScanner(i, this->Scanner))
  {
    return false;
  }
  this->Point = Load(this->Cloud.Position(i));
  const Vector3 way = this->Point - this->Scanner;
  this->Range = Norm(way);
  this->Direction = (1.0 / this->Range) * way;
  return true;
}

bool ScannerView::See(int j, Vector3& angles) const
{
  Vector3 scanner;
  if (!this->GetScanner(j, scanner) ||
    !(Norm(scanner - this->Scanner) <= SameScanner * this->Range))
  {
    return false;
  }
  const Vector3 way = Load(this->Cloud.Position(j)) - this->Scanner;
  angles = Normalized(way, this->Direction) - this->Direction;
  return true;
}

double ScannerView::AngleTo(int j) const
{
  Vector3 angles;
  return this->See(j, angles) ? Norm(angles) : std::numeric_limits<double>::infinity();
}

double ScannerView::StepAmong(const int* ids, int count) const
{
  double step = std::numeric_limits<double>::infinity();
  for (int k = 0; k < count; ++k)
  {
    step = std::min(step, this->AngleTo(ids[k]));
  }
  return step;
}

bool ScannerView::AreMostOfOthers(const Neighbors& neighbors) const
{
  const auto others = std::count_if(neighbors.Ids.begin(), neighbors.Ids.end(),
    [this](int j) { return !std::isfinite(this->AngleTo(j)); });
  return 2 * others > neighbors.Count();
}

/// The second smallest, on the other side of the point: the first may be a double one. Zero without
/// any.
double ScannerView::StepAlong(const Vector3& row, const Vector3& across, const Neighbors& neighbors)
{
  this->Steps.clear();
  for (const int j : neighbors.Ids)
  {
    Vector3 angles;
    if (this->See(j, angles) && std::abs(Dot(angles, row)) > 2.0 * std::abs(Dot(angles, across)))
    {
      this->Steps.push_back(std::abs(Dot(angles, row)));
    }
  }
  if (this->Steps.size() < 2)
  {
    return 0.0;
  }
  std::nth_element(this->Steps.begin(), this->Steps.begin() + 1, this->Steps.end());
  return this->Steps[1];
}

bool ScannerView::IsBetweenLines(const Vector3& along, const Neighbors& neighbors)
{
  const Vector3 seen = along - Dot(along, this->Direction) * this->Direction;
  if (!(Norm(seen) > LeastSlant))
  {
    return false;
  }
  const Vector3 row = Normalized(seen, along), across = Cross(this->Direction, row);
  const double step = this->StepAlong(row, across, neighbors);
  this->Sides.clear();
  for (const int j : neighbors.Ids)
  {
    Vector3 angles;
    const bool isSeen = this->See(j, angles);
    const double beside = Dot(angles, across);
    if (isSeen && std::abs(Dot(angles, row)) < 1.1 * step &&
      std::abs(beside) > NearestLine * step && std::abs(beside) < FarthestLine * step)
    {
      const Vector3 way = Load(this->Cloud.Position(j)) - this->Point;
      this->Sides.push_back({ way - Dot(way, along) * along, beside < 0.0 });
    }
  }
  return std::any_of(this->Sides.begin(), this->Sides.end(), [this](const Beside& a) {
    return std::any_of(this->Sides.begin(), this->Sides.end(),
      [&a](const Beside& b) { return a.IsLeft && !b.IsLeft && AreToNextLines(a.Way, b.Way); });
  });
}
}
