// SPDX-License-Identifier: BSD-3-Clause
/**
 * The linear algebra that the core needs, in double: 2 and 3 dimensions.
 */
#pragma once

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

/// Symmetric 3x3 matrix in VTK's component order XX, YY, ZZ, XY, YZ, XZ.
struct Symmetric3
{
  double XX, YY, ZZ, XY, YZ, XZ;

  /// S v.
  Vector3 Multiply(const Vector3& v) const
  {
    return { XX * v[0] + XY * v[1] + XZ * v[2], XY * v[0] + YY * v[1] + YZ * v[2],
      XZ * v[0] + YZ * v[1] + ZZ * v[2] };
  }

  double Trace() const { return XX + YY + ZZ; }

  /// Of Frobenius: the sum of the squared eigenvalues.
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

  /// Largest eigenvalue of an S of rank 2 or less, from its two invariants; never above the trace.
  double LargestEigenvalueOfRankTwo() const
  {
    const double minors = XX * YY - XY * XY + YY * ZZ - YZ * YZ + XX * ZZ - XZ * XZ;
    const double trace = this->Trace();
    const double discriminant = trace * trace - 4.0 * minors;
    return 0.5 * (trace + (discriminant > 0.0 ? std::sqrt(discriminant) : 0.0));
  }
};

/// Symmetric 3x3 matrix of numbers or of lanes (Core/Simd/RealLanes.h).
template <class Real>
struct Symmetric3Of
{
  Real XX, YY, ZZ, XY, YZ, XZ;
};

/// Symmetric 2x2 matrix.
template <class Real>
struct Symmetric2Of
{
  Real XX, YY, XY;
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

  /// L S L'.
  Symmetric3 ApplyToCovariance(const Symmetric3& s) const
  {
    const Vector3 x = s.Multiply(L[0]), y = s.Multiply(L[1]), z = s.Multiply(L[2]);
    return { Dot(L[0], x), Dot(L[1], y), Dot(L[2], z), Dot(L[0], y), Dot(L[1], z), Dot(L[0], z) };
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
};
}
