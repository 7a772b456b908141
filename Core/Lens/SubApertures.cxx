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

/// Up to so many cells lie on one ring.
constexpr int LargestLoneRing = 6;

/// Points on concentric rings, each in the middle of an equal share of the disc.
/// @param halves of the rings; an odd one is a point in the middle, or a lone ring
std::vector<ApertureSample> Rings(int count, int halves)
{
  const int rings = (halves + 1) / 2;
  std::vector<ApertureSample> points;
  for (int ring = 0; ring < rings; ++ring)
  {
    const double first = static_cast<double>(points.size());
    const double border = (2.0 * (ring + 1) - halves % 2) / halves;
    const double share = count * border * border;
    const double last = halves % 2 == 0 ? std::ceil(share - 1e-9) : std::round(share);
    const int number = static_cast<int>(std::fmax(last, 1.0) - first);
    const double radius = number == 1 ? 0.0 : std::sqrt(0.5 * (2.0 * first + number) / count);
    // Rings are rotated by an irrational share of the spacing, so that no points line up.
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

double SubApertureRadius(int count)
{
  // Nothing covers the middle of a ring of five or six smaller ones.
  constexpr double leastOnLoneRing = 0.49;
  const double equalShare = 1.0 / std::sqrt(static_cast<double>(count));
  return count <= LargestLoneRing ? std::fmax(equalShare, leastOnLoneRing) : equalShare;
}

std::vector<ApertureSample> SubApertureCenters(int count)
{
  // So cells are as far apart along a ring as the rings are.
  const int halves = static_cast<int>(std::round(2.0 * std::sqrt(count / Pi)));
  std::vector<ApertureSample> points = Rings(count, count <= LargestLoneRing ? 1 : halves);
  const double radius = SubApertureRadius(count);
  SetMoments(points, 0.25 * (1.0 - radius * radius));
  return points;
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
  Lens part = lens;
  part.Radius = sampling.Pinholes ? 0.0 : lens.Radius * SubApertureRadius(count);
  std::vector<SubAperture> cells;
  for (const ApertureSample& p :
    sampling.Pinholes ? ApertureSamples(count) : SubApertureCenters(count))
  {
    const Vector3 center{ lens.Radius * p.X, lens.Radius * p.Y, 0.0 };
    cells.push_back({ ViewFrom(view, lens, center), part, center });
  }
  return cells;
}
}
