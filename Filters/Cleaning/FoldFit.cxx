// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Cleaning/FoldFit.h"

#include "Core/Simd/Multiversion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

namespace SurfelGeometry
{
namespace
{
/// Places where the fold may be at first, at steps of a sixteenth of the points' extent.
constexpr int Slices = 16;

/// The points of each side, at least.
constexpr double LeastShare = 0.1;

/// Angles between the normals. Flatter folds are within a quadric's reach; steeper ones would be a
/// sheet of noise cut along its middle.
constexpr double LargestCosine = 0.87, LeastCosine = -0.6;

/// Each point joins the side on which it is, so many times; a fold that has as many squares as this
/// times what is wanted will not come below it.
constexpr int Rounds = 4;
constexpr double Hopeless = 1.15;

/// Points at the fold are no farther below both planes than so many deviations. Those of a rounded
/// edge are below them by so much of the deviation in the mean; those of a sharp one, with
/// noise, above.
constexpr double FoldReach = 2.0, RoundedShare = 0.2;

Vector3 PlaceOf(const QuadricPoint& point)
{
  return { point.x, point.y, point.z };
}

Vector3 MeanOf(const PlaneMoments& moments)
{
  return (1.0 / moments.Count) * moments.Sum;
}

/// Times the number of points.
Eigen::Matrix3d CovarianceOf(const PlaneMoments& moments)
{
  const Vector3& s = moments.Sum;
  const double share = 1.0 / moments.Count;
  Eigen::Matrix3d covariance;
  covariance(0, 0) = moments.XX - share * s[0] * s[0];
  covariance(1, 1) = moments.YY - share * s[1] * s[1];
  covariance(2, 2) = moments.ZZ - share * s[2] * s[2];
  covariance(0, 1) = covariance(1, 0) = moments.XY - share * s[0] * s[1];
  covariance(0, 2) = covariance(2, 0) = moments.XZ - share * s[0] * s[2];
  covariance(1, 2) = covariance(2, 1) = moments.YZ - share * s[1] * s[2];
  return covariance;
}

/// Squared distances of the points to their plane, summed: the least eigenvalue of the covariance,
/// from below, by Newton's method. Where the points are near a plane, this is exact; elsewhere the
/// plane is a bad one in any case. PCL's formula, with an angle's cosines, took more than half of
/// the time of a split.
double PlaneSquares(const PlaneMoments& moments)
{
  constexpr int steps = 4;
  const Eigen::Matrix3d c = CovarianceOf(moments);
  const double xx = c(1, 1) * c(2, 2) - c(1, 2) * c(1, 2);
  const double xy = c(0, 2) * c(1, 2) - c(0, 1) * c(2, 2);
  const double xz = c(0, 1) * c(1, 2) - c(0, 2) * c(1, 1);
  const double trace = c.trace(), determinant = c(0, 0) * xx + c(0, 1) * xy + c(0, 2) * xz;
  const double minors = xx + c(0, 0) * (c(1, 1) + c(2, 2)) - c(0, 1) * c(0, 1) - c(0, 2) * c(0, 2);
  double root = 0.0;
  for (int step = 0; step < steps; ++step)
  {
    const double value = ((root - trace) * root + minors) * root - determinant;
    const double slope = (3.0 * root - 2.0 * trace) * root + minors;
    root -= slope > 0.0 ? value / slope : 0.0;
  }
  return std::max(0.0, root);
}

Vector3 NormalOf(const PlaneMoments& moments)
{
  Eigen::Vector3d normal;
  double variance;
  pcl::eigen33(CovarianceOf(moments), variance, normal);
  return { normal[0], normal[1], normal[2] };
}

/// @param points [4 count] x, y, z, and something else
SURFEL_MULTIVERSION void FindWays(
  const float* __restrict points, int count, const Vector3& way, float* __restrict ways)
{
  const auto [a, b, c] = way;
  for (int k = 0; k < count; ++k)
  {
    ways[k] = static_cast<float>(a * points[4 * k] + b * points[4 * k + 1] + c * points[4 * k + 2]);
  }
}

/// @param points [4 count] x, y, z, and something else
/// @param heights [count] over the higher of the two planes
/// @param leads [count] of the first plane over the second
SURFEL_MULTIVERSION void FindHeights(const float* __restrict points, int count,
  const FoldPlane planes[2], double* __restrict heights, float* __restrict leads)
{
  const auto [a, atA] = planes[0];
  const auto [b, atB] = planes[1];
  for (int k = 0; k < count; ++k)
  {
    const double x = points[4 * k], y = points[4 * k + 1], z = points[4 * k + 2];
    const double overA = a[0] * x + a[1] * y + a[2] * z + atA;
    const double overB = b[0] * x + b[1] * y + b[2] * z + atB;
    heights[k] = std::max(overA, overB);
    leads[k] = static_cast<float>(overA - overB);
  }
}
}

void PlaneMoments::Add(const Vector3& p, double weight)
{
  const double x = weight * p[0], y = weight * p[1], z = weight * p[2];
  this->Count += weight;
  this->Sum = this->Sum + Vector3{ x, y, z };
  this->XX += x * p[0];
  this->XY += x * p[1];
  this->XZ += x * p[2];
  this->YY += y * p[1];
  this->YZ += y * p[2];
  this->ZZ += z * p[2];
}

void PlaneMoments::Add(const PlaneMoments& other, double weight)
{
  this->Count += weight * other.Count;
  this->Sum = this->Sum + weight * other.Sum;
  this->XX += weight * other.XX;
  this->XY += weight * other.XY;
  this->XZ += weight * other.XZ;
  this->YY += weight * other.YY;
  this->YZ += weight * other.YZ;
  this->ZZ += weight * other.ZZ;
}

bool FoldFit::MayFit(const QuadricCloud& points, const LocalQuadric& middle, double most)
{
  this->Resize(points.size());
  PlaneMoments sides[2];
  return this->SplitAcross(points, middle.WayAcross(), sides) < Hopeless * most ||
    this->SplitAcross(points, middle.PlaneNormal(), sides) < Hopeless * most;
}

bool FoldFit::Fit(const LocalQuadric& quadric, double most)
{
  const QuadricCloud& points = quadric.Points();
  this->Resize(points.size());
  this->Best.Squares = most;
  // Sharp folds, whose mean plane may be along their own sides, are parted by that plane.
  this->TryAcross(points, quadric.WayAcross());
  this->TryAcross(points, quadric.PlaneNormal());
  return this->Best.Squares < most;
}

void FoldFit::Resize(size_t points)
{
  this->Ways.resize(points);
  this->Heights.resize(points);
  this->Side.resize(points);
}

void FoldFit::TryAcross(const QuadricCloud& points, const Vector3& way)
{
  PlaneMoments sides[2];
  Fold fold;
  fold.Squares = this->SplitAcross(points, way, sides);
  bool isChanged = true;
  for (int round = 0; isChanged && round < Rounds; ++round)
  {
    const bool areMany =
      std::min(sides[0].Count, sides[1].Count) >= LeastShare * static_cast<double>(points.size());
    if (!areMany || fold.Squares > Hopeless * this->Best.Squares)
    {
      return;
    }
    isChanged = this->Assign(points, fold, sides);
    const double cosine = Dot(fold.Sides[0].Normal, fold.Sides[1].Normal);
    if (cosine > LeastCosine && cosine < LargestCosine && fold.Squares < this->Best.Squares)
    {
      this->Best = fold;
    }
  }
}

/// Parts the points across the fold, where two planes are nearest to them. Returns their squares.
double FoldFit::SplitAcross(const QuadricCloud& points, const Vector3& way, PlaneMoments sides[2])
{
  FindWays(points[0].data, static_cast<int>(points.size()), way, this->Ways.data());
  const auto [least, most] = std::minmax_element(this->Ways.begin(), this->Ways.end());
  const float start = *least, scale = Slices / (*most - *least);
  double best = std::numeric_limits<double>::infinity();
  if (!std::isfinite(scale))
  {
    return best;
  }
  std::array<PlaneMoments, Slices> slices;
  PlaneMoments before, after;
  for (size_t k = 0; k < points.size(); ++k)
  {
    const int slice = std::min(static_cast<int>(scale * (this->Ways[k] - start)), Slices - 1);
    slices[slice].Add(PlaceOf(points[k]), 1.0);
    this->Side[k] = static_cast<unsigned char>(slice);
  }
  for (const PlaneMoments& slice : slices)
  {
    after.Add(slice, 1.0);
  }
  int first = 0; // slice of the second side
  for (int k = 1; k < Slices; ++k)
  {
    before.Add(slices[k - 1], 1.0);
    after.Add(slices[k - 1], -1.0);
    const bool areMany =
      std::min(before.Count, after.Count) >= LeastShare * static_cast<double>(points.size());
    const double squares = areMany ? PlaneSquares(before) + PlaneSquares(after) : best;
    if (squares < best)
    {
      best = squares;
      first = k;
      sides[0] = before;
      sides[1] = after;
    }
  }
  for (unsigned char& side : this->Side)
  {
    side = side < first ? 0 : 1;
  }
  return best;
}

/// The plane of each side, with its normal away from the other side; then each point to the side on
/// which it is. Returns whether one has changed.
bool FoldFit::Assign(const QuadricCloud& points, Fold& fold, PlaneMoments sides[2])
{
  const Vector3 way = MeanOf(sides[1]) - MeanOf(sides[0]);
  for (int s = 0; s < 2; ++s)
  {
    const Vector3 normal = NormalOf(sides[s]);
    const double toOther = (s == 0 ? 1.0 : -1.0) * Dot(normal, way);
    const Vector3 away = std::copysign(1.0, -toOther) * normal;
    fold.Sides[s] = { away, -Dot(away, MeanOf(sides[s])) };
  }
  FindHeights(points[0].data, static_cast<int>(points.size()), fold.Sides, this->Heights.data(),
    this->Ways.data());
  double squares = 0.0;
  bool isChanged = false;
  for (size_t k = 0; k < points.size(); ++k)
  {
    squares += this->Heights[k] * this->Heights[k];
    const unsigned char side = this->Ways[k] > 0.0f ? 0 : 1;
    if (side != this->Side[k])
    {
      const Vector3 p = PlaceOf(points[k]);
      sides[side].Add(p, 1.0);
      sides[1 - side].Add(p, -1.0);
      this->Side[k] = side;
      isChanged = true;
    }
  }
  fold.Squares = squares;
  return isChanged;
}

double FoldFit::Fold::Height(const Vector3& p) const
{
  const auto& [a, b] = this->Sides;
  return std::max(Dot(a.Normal, p) + a.Height, Dot(b.Normal, p) + b.Height);
}

double FoldFit::Deviation(const QuadricCloud& points) const
{
  return std::sqrt(this->Best.Squares / static_cast<double>(points.size()));
}

double FoldFit::SquaresOf(const QuadricCloud& points, int count) const
{
  return std::accumulate(
    points.begin(), points.begin() + count, 0.0, [this](double sum, const QuadricPoint& p) {
      const double height = this->Best.Height({ p.x, p.y, p.z });
      return sum + height * height;
    });
}

bool FoldFit::IsRounded(const QuadricCloud& points, double spacing) const
{
  const auto& [a, b] = this->Best.Sides;
  const double deviation = this->Deviation(points);
  const double reach = std::max(spacing, FoldReach * deviation);
  double sum = 0.0, count = 0.0;
  for (const QuadricPoint& point : points)
  {
    const Vector3 p = { point.x, point.y, point.z };
    const double overA = Dot(a.Normal, p) + a.Height, overB = Dot(b.Normal, p) + b.Height;
    const bool isAtFold = std::min(overA, overB) > -reach;
    sum += isAtFold ? std::max(overA, overB) : 0.0;
    count += isAtFold ? 1.0 : 0.0;
  }
  return sum < -RoundedShare * deviation * count;
}

double FoldFit::FoldDistance() const
{
  const auto& [a, b] = this->Best.Sides;
  const double cosine = Dot(a.Normal, b.Normal);
  const double squares =
    a.Height * a.Height + b.Height * b.Height - 2.0 * cosine * a.Height * b.Height;
  return std::sqrt(std::max(0.0, squares) / (1.0 - cosine * cosine));
}

Vector3 FoldFit::Shift() const
{
  const auto& [a, b] = this->Best.Sides;
  const FoldPlane& side = a.Height > b.Height ? a : b;
  const FoldPlane& other = a.Height > b.Height ? b : a;
  const Vector3 shift = -side.Height * side.Normal;
  const double beyond = other.Height + Dot(shift, other.Normal);
  if (beyond <= 0.0)
  {
    return shift;
  }
  // The foot is beyond the fold: to the fold, within the plane.
  const double cosine = Dot(side.Normal, other.Normal);
  const Vector3 way = other.Normal - cosine * side.Normal;
  return shift - (beyond / (1.0 - cosine * cosine)) * way;
}
}
