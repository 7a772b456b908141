// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Lens/SubApertures.h"

#include <algorithm>
#include <cmath>

namespace SurfelSplatting
{
namespace
{
/// Moves points to mean 0 and scales them to a mean squared distance of 2 variance.
void SetMoments(std::vector<ApertureSample>& points, double variance)
{
  const double count = static_cast<double>(points.size());
  ApertureSample mean{ 0.0, 0.0 };
  for (const ApertureSample& p : points)
  {
    mean.X += p.X / count;
    mean.Y += p.Y / count;
  }
  double squares = 0.0;
  for (ApertureSample& p : points)
  {
    p.X -= mean.X;
    p.Y -= mean.Y;
    squares += (p.X * p.X + p.Y * p.Y) / count;
  }
  const double scale = squares > 0.0 ? std::sqrt(2.0 * variance / squares) : 0.0;
  for (ApertureSample& p : points)
  {
    p.X *= scale;
    p.Y *= scale;
  }
}

/// How many of `count` parts of the disc of equal area are on each of some concentric rings, of
/// nearly equal widths.
/// @param halves of the rings; an odd one is a part in the middle, or a lone ring
std::vector<int> NumbersOnRings(int count, int halves)
{
  std::vector<int> numbers;
  int first = 0;
  for (int ring = 0; ring < (halves + 1) / 2; ++ring)
  {
    const double border = (2.0 * (ring + 1) - halves % 2) / halves;
    const double share = count * border * border;
    const double last = halves % 2 == 0 ? std::ceil(share - 1e-9) : std::round(share);
    numbers.push_back(std::max(static_cast<int>(last), 1) - first);
    first += numbers.back();
  }
  return numbers;
}

/// Points on concentric rings, each in the middle of an equal share of the disc.
std::vector<ApertureSample> Rings(int count, int halves)
{
  std::vector<ApertureSample> points;
  int ring = 0;
  for (const int number : NumbersOnRings(count, halves))
  {
    const double first = static_cast<double>(points.size());
    const double radius = number == 1 ? 0.0 : std::sqrt(0.5 * (2.0 * first + number) / count);
    // Rings are rotated by an irrational share of the spacing, so that no points line up.
    const double phase = 0.38196601125010515 * ring++;
    for (int i = 0; i < number; ++i)
    {
      const double angle = 2.0 * Pi * (i + phase) / number;
      points.push_back({ radius * std::cos(angle), radius * std::sin(angle) });
    }
  }
  return points;
}

/// Adds the cells of a ring between two radii.
void AddRing(double inner, double outer, int number, std::vector<ApertureCell>& cells)
{
  if (number == 1)
  {
    cells.push_back({ { 0.0, 0.0 }, outer, {} });
    return;
  }
  const double half = Pi / number, squares = inner * inner + outer * outer;
  const double along = 2.0 / 3.0 * (squares + inner * outer) / (inner + outer);
  const double mean = along * std::sin(half) / half, tilt = std::sin(2.0 * half) / (2.0 * half);
  const double xx = 0.25 * squares * (1.0 + tilt) - mean * mean;
  const double yy = 0.25 * squares * (1.0 - tilt);
  const double area = std::sqrt(xx * yy);
  for (int i = 0; i < number; ++i)
  {
    const double c = std::cos(2.0 * half * i), s = std::sin(2.0 * half * i);
    const LensShape shape{ (xx * c * c + yy * s * s) / area, (xx * s * s + yy * c * c) / area,
      (xx - yy) * c * s / area };
    cells.push_back({ { mean * c, mean * s }, 2.0 * std::sqrt(area), shape });
  }
}

View ViewFrom(const View& view, const Lens& lens, const Vector3& center)
{
  View shifted = view;
  shifted.WorldToCamera.T[0] -= center[0];
  shifted.WorldToCamera.T[1] -= center[1];
  shifted.Cx += view.Fx * center[0] / lens.FocalDistance;
  shifted.Cy += view.Fy * center[1] / lens.FocalDistance;
  return shifted;
}
}

std::vector<ApertureCell> ApertureCells(int count)
{
  constexpr int largestLoneRing = 4;
  const int halves = static_cast<int>(std::round(2.0 * std::sqrt(count / Pi)));
  std::vector<ApertureCell> cells;
  double inner = 0.0;
  int first = 0;
  for (const int number : NumbersOnRings(count, count <= largestLoneRing ? 2 : halves))
  {
    first += number;
    const double outer = std::sqrt(static_cast<double>(first) / count);
    AddRing(inner, outer, number, cells);
    inner = outer;
  }
  return cells;
}

std::vector<ApertureSample> ApertureSamples(int count)
{
  // The first point is always near the middle.
  constexpr int largestLoneRing = 5;
  const int rings =
    count <= largestLoneRing ? 0 : static_cast<int>(std::ceil(0.5 * std::sqrt(count) - 0.6));
  std::vector<ApertureSample> points = Rings(count, 2 * rings + 1);
  SetMoments(points, 0.25);
  return points;
}

bool IsWhole(const View& view, const Lens& lens, const ApertureSampling& sampling)
{
  return view.Parallel || !(lens.Radius > 0.0) || (sampling.Count <= 1 && !sampling.Pinholes);
}

std::vector<SubAperture> DivideLens(
  const View& view, const Lens& lens, const ApertureSampling& sampling)
{
  if (IsWhole(view, lens, sampling))
  {
    return { SubAperture{ view, lens } };
  }
  const int count = std::max(1, sampling.Count);
  std::vector<SubAperture> parts;
  const auto add = [&](const ApertureSample& at, double radius, const LensShape& shape) {
    const Vector3 center{ lens.Radius * at.X, lens.Radius * at.Y, 0.0 };
    parts.push_back({ ViewFrom(view, lens, center),
      { lens.Radius * radius, lens.FocalDistance, shape }, center });
  };
  if (sampling.Pinholes)
  {
    for (const ApertureSample& point : ApertureSamples(count))
    {
      add(point, 0.0, {});
    }
    return parts;
  }
  for (const ApertureCell& cell : ApertureCells(count))
  {
    add(cell.Center, cell.Radius, cell.Shape);
  }
  return parts;
}
}
