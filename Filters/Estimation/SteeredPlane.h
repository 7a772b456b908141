// SPDX-License-Identifier: BSD-3-Clause
/**
 * The tangent plane of a point in the metric of its steering (KernelSteering.h): where neighbours
 * are, and where the bisectors are that bound the point's Voronoi cell.
 *
 * With M_i the metric of point i, and places x' = M_i^(1/2) x, in which M_i is round, the cell of i
 * is bounded towards point j at d by the bisector of the mean metric M = (M_i + M_j) / 2: n . x' =
 * d' . n / 2 with n = M_i^(-1/2) M d. It is the same line for i and j, so that cells still tile
 * where the metric changes (Labelle and Shewchuk 2003, "Anisotropic Voronoi diagrams and
 * guaranteed-quality anisotropic mesh generation", take M_i on one side and M_j on the other, which
 * makes curves).
 */
#pragma once

#include "Filters/Common/VectorMath.h"
#include "Filters/Estimation/KernelSteering.h"

#include <cmath>

namespace SurfelGeometry
{
/// A linear map of the plane, [[XX, XY], [XY, YY]]. Default: the identity.
struct SymmetricMap
{
  float XX = 1.0f, XY = 0.0f, YY = 1.0f;

  float X(float x, float y) const { return this->XX * x + this->XY * y; }
  float Y(float x, float y) const { return this->XY * x + this->YY * y; }
};

/// The tangent plane of a point, and its own metric.
struct SteeredPlane
{
  Vector3 U, V;      // unit, orthogonal
  SymmetricMap Into; // the metric's square root: from the plane to where the metric is round
  SymmetricMap Back; // and back to the plane

  SteeredPlane() = default;
  SteeredPlane(const Vector3& u, const Vector3& v, const Float3& steering)
    : U(u)
    , V(v)
  {
    const Vector3 s = steering;
    const auto x = static_cast<float>(Dot(s, this->U)), y = static_cast<float>(Dot(s, this->V));
    const float r = std::sqrt(SquaredStretch(x * x + y * y)), share = 1.0f / (r + 1.0f / r);
    this->Into = { r - share * x * x, -share * x * y, r - share * y * y };
    this->Back = { 1.0f / r + share * x * x, share * x * y, 1.0f / r + share * y * y };
  }

  /// The tangential vector that belongs to a place in the round metric.
  Vector3 At(double x, double y) const
  {
    const auto a = static_cast<float>(x), b = static_cast<float>(y);
    return static_cast<double>(this->Back.X(a, b)) * this->U +
      static_cast<double>(this->Back.Y(a, b)) * this->V;
  }
};

/// A neighbour's place in the round metric, and the normal of its bisector. Lengths in spacings of
/// the point.
struct FlatNeighbor
{
  float X, Y;
  float CutX, CutY;

  /// The points (x, y) of the bisector have CutX x + CutY y = Offset().
  float Offset() const { return 0.5f * (this->X * this->CutX + this->Y * this->CutY); }
};

/// @param x, y     place in the tangent plane
/// @param sx, sy   the neighbour's steering in the plane
/// @param squared  its squared length
inline FlatNeighbor PlaceInMetric(
  const SteeredPlane& plane, float x, float y, float sx, float sy, float squared)
{
  const float stretch = SquaredStretch(squared), along = sx * x + sy * y;
  const float mx = stretch * x - along * sx, my = stretch * y - along * sy; // M_j d
  FlatNeighbor to;
  to.X = plane.Into.X(x, y);
  to.Y = plane.Into.Y(x, y);
  to.CutX = 0.5f * (to.X + plane.Back.X(mx, my));
  to.CutY = 0.5f * (to.Y + plane.Back.Y(mx, my));
  return to;
}
}
