// SPDX-License-Identifier: BSD-3-Clause
/**
 * The neighbours that may bound the Voronoi cell of a point, in its plane, and their sides of it.
 */
#pragma once

#include "Filters/Estimation/CellPolygon.h"
#include "Filters/Estimation/SteeredPlane.h"
#include "Filters/Neighbors/SurfaceFold.h"

#include <algorithm>
#include <cmath>

namespace SurfelGeometry
{
/// Neighbours whose bisectors may bound a cell. In a random sampling a cell has 6 on average,
/// hardly ever one that is not among the 20 nearest points.
constexpr int CellNeighbors = KeptNeighbors;

/// Neighbours that may bound a cell which those leave open: beside a border or a step of density
/// they fill half a disc of a radius of 7 spacings, where 10 times sparser points have 7 in the
/// other.
constexpr int OpenNeighbors = 4 * CellNeighbors;

/// The same between scan lines: those of a few scanners may fall together, 16 steps apart.
constexpr int SheetCapacity = 12 * CellNeighbors;

/// Cosine of the angle up to which folds have one direction, and standard deviation of the
/// distances, in spacings, up to which they are one line. Normals with noise give many lines.
constexpr float FoldCosine = 0.9f, FoldSpread = 0.05f;

/// The surface ends where the surrounding areas, smoothed by a Gaussian of this many spacings,
/// cover half of the plane. Areas fitted near a border are a seventh too large (PlaneFitter.cxx,
/// SetExtent), hence 0.57 instead of 0.5: squares of regular, jittered and random points then get
/// their area within 0.3 %.
constexpr double BorderSmoothing = 1.0;
constexpr double BorderCoverage = 0.57;
constexpr int BorderSteps = 12;

/// What bounds a cell towards a neighbour: the line X x + Y y = Offset.
struct CellSide
{
  float X, Y, Offset;
};

inline CellSide BisectorTo(const FlatNeighbor& at)
{
  return { at.CutX, at.CutY, at.Offset() };
}

/// Neighbours of a point on its sheet and behind folds, nearest first.
struct FlatSheet
{
  int Count;
  FlatNeighbor At[SheetCapacity];
  CellSide Sides[SheetCapacity];
  FoldLine Folds[SheetCapacity];
  float Areas[SheetCapacity]; // spacings squared

  void Add(const FlatNeighbor& neighbor, const FoldLine& fold, float area)
  {
    this->At[this->Count] = neighbor;
    this->Sides[this->Count] = BisectorTo(neighbor);
    this->Folds[this->Count] = fold;
    this->Areas[this->Count] = area;
    ++this->Count;
  }

  /// The direction, a unit vector, in which there are the fewest neighbours; false if all are
  /// alike.
  bool FindOutward(double& x, double& y) const
  {
    x = y = 0.0;
    for (int k = 0; k < this->Count; ++k)
    {
      x -= this->At[k].X;
      y -= this->At[k].Y;
    }
    const double length = std::sqrt(x * x + y * y);
    x /= length;
    y /= length;
    return length > 0.0;
  }

  /// Share of the plane around (x, y) that the areas cover, smoothed by so many spacings.
  double Coverage(double x, double y, double smoothing) const
  {
    const double variance = smoothing * smoothing;
    double sum = std::exp(-0.5 * (x * x + y * y) / variance);
    for (int k = 0; k < this->Count; ++k)
    {
      const double dx = this->At[k].X - x, dy = this->At[k].Y - y;
      sum += this->Areas[k] * std::exp(-0.5 * (dx * dx + dy * dy) / variance);
    }
    return sum / (2.0 * Pi * variance);
  }

  /// The smaller of the principal variances of point and neighbours over the larger one; about 0.28
  /// of half a disc.
  double Roundness() const
  {
    double sums[2] = {}, xx = 0.0, xy = 0.0, yy = 0.0;
    for (int k = 0; k < this->Count; ++k)
    {
      const double x = this->At[k].X, y = this->At[k].Y;
      sums[0] += x;
      sums[1] += y;
      xx += x * x;
      xy += x * y;
      yy += y * y;
    }
    const double points = this->Count + 1.0;
    xx -= sums[0] * sums[0] / points;
    xy -= sums[0] * sums[1] / points;
    yy -= sums[1] * sums[1] / points;
    const double mean = 0.5 * (xx + yy), half = std::sqrt(mean * mean - xx * yy + xy * xy);
    return mean > 0.0 ? (mean - half) / (mean + half) : 0.0;
  }

  /// By how much the logarithm of the spacing grows in a direction, a unit vector, per spacing:
  /// the regression over the point and its neighbours.
  double Growth(double x, double y) const
  {
    double ways = 0.0, logs = 0.0, squares = 0.0, products = 0.0;
    for (int k = 0; k < this->Count; ++k)
    {
      const double way = this->At[k].X * x + this->At[k].Y * y;
      const double log = 0.5 * std::log(static_cast<double>(this->Areas[k]));
      ways += way;
      logs += log;
      squares += way * way;
      products += way * log;
    }
    const double points = this->Count + 1.0;
    const double spread = squares - ways * ways / points;
    return spread > 0.0 ? (products - ways * logs / points) / spread : 0.0;
  }
};

/// The mean distance of the folds in the direction of the k-th, if they are one line; else 0.
inline float DistanceOfFold(const FoldLine* folds, int count, int k)
{
  float alike = 0.0f, sum = 0.0f, squares = 0.0f;
  for (int m = 0; m < count; ++m)
  {
    const auto& [x, y, distance] = folds[m];
    if (distance > 0.0f && x * folds[k].X + y * folds[k].Y > FoldCosine)
    {
      alike += 1.0f;
      sum += distance;
      squares += distance * distance;
    }
  }
  const float mean = sum / alike;
  const bool isLine = alike > 1.0f && squares / alike - mean * mean < FoldSpread * FoldSpread;
  return isLine ? mean : 0.0f;
}

/// Cells end at folds: calls set(k, side) for each neighbour behind one.
template <class Set>
void FindFoldSides(const SteeredPlane& plane, const FoldLine* folds, int count, const Set& set)
{
  for (int k = 0; k < count; ++k)
  {
    const float distance = folds[k].Distance > 0.0f ? DistanceOfFold(folds, count, k) : 0.0f;
    if (distance > 0.0f)
    {
      const auto& [x, y, own] = folds[k];
      set(k, CellSide{ plane.Back.X(x, y), plane.Back.Y(x, y), distance });
    }
  }
}

/// The point's cell among its neighbours.
inline void CutCell(const FlatSheet& sheet, double reach, CellPolygon& cell)
{
  cell.Reset(reach);
  for (int k = 0; k < sheet.Count; ++k)
  {
    const auto& [x, y, offset] = sheet.Sides[k];
    if (offset > 0.0f && offset * offset < cell.SquaredRadius() * (x * x + y * y))
    {
      cell.Cut(x, y, offset);
    }
  }
}

/// Cuts the cell where the surface ends on the side without neighbours.
/// @param scale of the smoothing
inline void CutAtBorder(const FlatSheet& sheet, double reach, double scale, CellPolygon& cell)
{
  double x, y;
  if (!sheet.FindOutward(x, y))
  {
    return;
  }
  double inside = 0.0, outside = reach;
  for (int step = 0; step < BorderSteps; ++step)
  {
    const double middle = 0.5 * (inside + outside);
    const bool covered =
      sheet.Coverage(middle * x, middle * y, scale * BorderSmoothing) >= BorderCoverage;
    (covered ? inside : outside) = middle;
  }
  cell.Cut(
    static_cast<float>(x), static_cast<float>(y), static_cast<float>(std::max(inside, 0.05)));
}
}
