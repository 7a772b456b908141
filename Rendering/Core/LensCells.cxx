// SPDX-License-Identifier: BSD-3-Clause
#include "LensCells.h"

#include <algorithm>
#include <cmath>

namespace SurfelSplatting
{
namespace
{
/// Moves points to mean 0 and scales them to a mean squared distance of 2 variance.
void SetMoments(std::vector<LensPoint>& points, double variance)
{
  const double count = static_cast<double>(points.size());
  LensPoint mean{ 0.0, 0.0 };
  for (const LensPoint& p : points)
  {
    mean.X += p.X / count;
    mean.Y += p.Y / count;
  }
  double squares = 0.0;
  for (LensPoint& p : points)
  {
    p.X -= mean.X;
    p.Y -= mean.Y;
    squares += (p.X * p.X + p.Y * p.Y) / count;
  }
  const double scale = squares > 0.0 ? std::sqrt(2.0 * variance / squares) : 0.0;
  for (LensPoint& p : points)
  {
    p.X *= scale;
    p.Y *= scale;
  }
}

/// Points on concentric rings, each the middle of an equal share of the disc.
std::vector<LensPoint> Rings(int count)
{
  constexpr int largestLoneRing = 5;
  const int rings =
    count <= largestLoneRing ? 0 : static_cast<int>(std::ceil(0.5 * std::sqrt(count) - 0.6));
  std::vector<LensPoint> points;
  for (int ring = 0; ring <= rings; ++ring)
  {
    const double first = static_cast<double>(points.size());
    const double border = (ring + 0.5) / (rings + 0.5);
    const double last = ring == rings ? count : std::fmax(1.0, std::round(count * border * border));
    const int number = static_cast<int>(last - first);
    const double radius = number == 1 ? 0.0 : std::sqrt(0.5 * (first + last) / count);
    // Turned against one another by an irrational share of the spacing: no common radii.
    const double phase = 0.38196601125010515 * ring;
    for (int i = 0; i < number; ++i)
    {
      const double angle = 2.0 * Pi * (i + phase) / number;
      points.push_back({ radius * std::cos(angle), radius * std::sin(angle) });
    }
  }
  return points;
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

std::vector<LensPoint> LensCellCenters(int count)
{
  std::vector<LensPoint> points = Rings(count);
  SetMoments(points, 0.25 * (1.0 - 1.0 / count));
  return points;
}

std::vector<LensPoint> LensSamplePoints(int count)
{
  std::vector<LensPoint> points = Rings(count);
  SetMoments(points, 0.25);
  return points;
}

bool IsWhole(const View& view, const Lens& lens, const LensSampling& sampling)
{
  return view.Parallel || !(lens.Radius > 0.0) || (sampling.Count <= 1 && !sampling.Pinholes);
}

std::vector<LensCell> DivideLens(const View& view, const Lens& lens, const LensSampling& sampling)
{
  if (IsWhole(view, lens, sampling))
  {
    return { LensCell{ view, lens } };
  }
  const int count = std::max(1, sampling.Count);
  Lens part = lens;
  part.Radius = sampling.Pinholes ? 0.0 : lens.Radius / std::sqrt(static_cast<double>(count));
  std::vector<LensCell> cells;
  for (const LensPoint& p : sampling.Pinholes ? LensSamplePoints(count) : LensCellCenters(count))
  {
    const Vector3 center{ lens.Radius * p.X, lens.Radius * p.Y, 0.0 };
    cells.push_back({ ViewFrom(view, lens, center), part, center });
  }
  return cells;
}
}
