// SPDX-License-Identifier: BSD-3-Clause
/**
 * The linear algebra that the core needs, in double: 2 and 3 dimensions.
 */
#pragma once

#include "Core/Simd/RealLanes.h"

#include <array>
#include <cmath>

namespace SurfelSplatting
{
constexpr double Pi = 3.14159265358979323846;

using Vector3 = std::array<double, 3>;

inline double Dot(const Vector3& a, const Vector3& b)
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

inline double Norm(const Vector3& a)
{
  return std::sqrt(Dot(a, a));
}

inline Vector3 operator+(const Vector3& a, const Vector3& b)
{
  return { a[0] + b[0], a[1] + b[1], a[2] + b[2] };
}

inline Vector3 operator-(const Vector3& a, const Vector3& b)
{
  return { a[0] - b[0], a[1] - b[1], a[2] - b[2] };
}

inline Vector3 operator*(double s, const Vector3& a)
{
  return { s * a[0], s * a[1], s * a[2] };
}

inline Vector3 Cross(const Vector3& a, const Vector3& b)
{
  return { a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0] };
}

/// cos(acos(r) / 3) within 1e-10, for r from -1 to 1. With s = cos(acos(r) / 2) it is cos(2/3
/// acos(s)), which is smooth for s from 0 to 1: a Chebyshev interpolant in 2 s - 1 of degree 10.
inline double CosineOfThird(double r)
{
  constexpr double coefficients[] = { -2.027306014142e-07, 7.119254998105e-07, -1.990468563024e-06,
    7.385892175396e-06, -2.894026037718e-05, 1.164948910767e-04, -5.041210201953e-04,
    2.466340276021e-03, -1.550918862085e-02, 2.474090669525e-01, 7.660444431190e-01 };
  const double x = 2.0 * std::sqrt(0.5 * (1.0 + r)) - 1.0;
  double sum = 0.0;
  for (const double coefficient : coefficients)
  {
    sum = sum * x + coefficient;
  }
  return sum;
}

/// Symmetric 3x3 matrix in VTK's component order XX, YY, ZZ, XY, YZ, XZ. Real is double or lanes of
/// doubles (Core/Simd/RealLanes.h).
template <class Real>
struct Symmetric3Of
{
  Real XX, YY, ZZ, XY, YZ, XZ;

  SURFELSPLATTING_INLINE Real Trace() const { return XX + YY + ZZ; }

  /// Sum of the principal minors, tr adj S: that of the products of two eigenvalues.
  SURFELSPLATTING_INLINE Real SumOfMinors() const
  {
    return XX * YY - XY * XY + YY * ZZ - YZ * YZ + XX * ZZ - XZ * XZ;
  }

  /// S v.
  Vector3 Multiply(const Vector3& v) const
  {
    return { XX * v[0] + XY * v[1] + XZ * v[2], XY * v[0] + YY * v[1] + YZ * v[2],
      XZ * v[0] + YZ * v[1] + ZZ * v[2] };
  }

  /// The square of the Frobenius norm: the sum of the squared eigenvalues.
  double SquaredNorm() const
  {
    return XX * XX + YY * YY + ZZ * ZZ + 2.0 * (XY * XY + YZ * YZ + XZ * XZ);
  }

  /// Largest eigenvalue of a positive semi-definite S (Smith 1961).
  double LargestEigenvalue() const
  {
    const double mean = this->Trace() / 3.0;
    const double x = XX - mean, y = YY - mean, z = ZZ - mean;
    const double p2 = (x * x + y * y + z * z + 2.0 * (XY * XY + YZ * YZ + XZ * XZ)) / 6.0;
    if (!(p2 > 0.0))
    {
      return mean;
    }
    const double p = std::sqrt(p2);
    const double half =
      (x * (y * z - YZ * YZ) - XY * (XY * z - YZ * XZ) + XZ * (XY * YZ - y * XZ)) / (2.0 * p2 * p);
    return mean + 2.0 * p * CosineOfThird(std::fmin(1.0, std::fmax(-1.0, half)));
  }
};
using Symmetric3 = Symmetric3Of<double>;

/// Symmetric 2x2 matrix. Real is double or lanes of doubles.
template <class Real>
struct Symmetric2Of
{
  Real XX, YY, XY;

  SURFELSPLATTING_INLINE Real Mean() const { return 0.5 * (XX + YY); }
  SURFELSPLATTING_INLINE Real Radius() const
  {
    const Real half = 0.5 * (XX - YY);
    return SquareRoot(half * half + XY * XY);
  }
  SURFELSPLATTING_INLINE Real LargestEigenvalue() const { return this->Mean() + this->Radius(); }
  SURFELSPLATTING_INLINE Real SmallestEigenvalue() const { return this->Mean() - this->Radius(); }
};
using Symmetric2 = Symmetric2Of<double>;

/// Affine map x -> L x + t, L row by row.
struct Affine3
{
  std::array<Vector3, 3> L{ { { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } } };
  Vector3 T{ 0, 0, 0 };

  Vector3 Apply(const Vector3& x) const
  {
    return { Dot(L[0], x) + T[0], Dot(L[1], x) + T[1], Dot(L[2], x) + T[2] };
  }

  Vector3 ApplyLinear(const Vector3& x) const
  {
    return { Dot(L[0], x), Dot(L[1], x), Dot(L[2], x) };
  }

  double Determinant() const
  {
    return L[0][0] * (L[1][1] * L[2][2] - L[1][2] * L[2][1]) -
      L[0][1] * (L[1][0] * L[2][2] - L[1][2] * L[2][0]) +
      L[0][2] * (L[1][0] * L[2][1] - L[1][1] * L[2][0]);
  }

  /// a after b.
  static Affine3 Compose(const Affine3& a, const Affine3& b)
  {
    Affine3 c;
    for (int i = 0; i < 3; ++i)
    {
      for (int j = 0; j < 3; ++j)
      {
        c.L[i][j] = a.L[i][0] * b.L[0][j] + a.L[i][1] * b.L[1][j] + a.L[i][2] * b.L[2][j];
      }
      c.T[i] = Dot(a.L[i], b.T) + a.T[i];
    }
    return c;
  }

  /// |det L| L^-T: how area vectors transform. The absolute value keeps the outside of a mirrored
  /// surface (Documentation/DataContract.md). It is computed from cofactors, so L may be singular.
  std::array<Vector3, 3> AreaMatrix() const
  {
    std::array<Vector3, 3> c;
    const double sign = this->Determinant() < 0.0 ? -1.0 : 1.0;
    for (int i = 0; i < 3; ++i)
    {
      for (int j = 0; j < 3; ++j)
      {
        const int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
        c[i][j] = sign * (L[i1][j1] * L[i2][j2] - L[i1][j2] * L[i2][j1]);
      }
    }
    return c;
  }

  /// The inverse map. L must not be singular.
  Affine3 Inverse() const
  {
    Affine3 inverse;
    const std::array<Vector3, 3> area = this->AreaMatrix(); // |det L| L^-T
    const double scale = 1.0 / std::abs(this->Determinant());
    for (int i = 0; i < 3; ++i)
    {
      for (int j = 0; j < 3; ++j)
      {
        inverse.L[j][i] = scale * area[i][j];
      }
    }
    inverse.T = inverse.ApplyLinear({ -T[0], -T[1], -T[2] });
    return inverse;
  }
};
}
