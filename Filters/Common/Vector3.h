// SPDX-License-Identifier: BSD-3-Clause
/**
 * The few operations on 3-vectors that the filters' loops need, in double; single where they are
 * kept.
 */
#pragma once

#include <algorithm>
#include <cmath>

namespace SurfelGeometry
{
struct Vector3
{
  double X = 0.0, Y = 0.0, Z = 0.0;
};

/// A vector that is kept for each point: half the memory, and the time that pages take.
struct Float3
{
  float X = 0.0f, Y = 0.0f, Z = 0.0f;

  Float3() = default;
  Float3(const Vector3& a)
    : X(static_cast<float>(a.X))
    , Y(static_cast<float>(a.Y))
    , Z(static_cast<float>(a.Z))
  {
  }
  operator Vector3() const { return { this->X, this->Y, this->Z }; }
};

inline Vector3 Load(const float* p)
{
  return { p[0], p[1], p[2] };
}
inline void Store(const Vector3& a, float* p)
{
  p[0] = static_cast<float>(a.X);
  p[1] = static_cast<float>(a.Y);
  p[2] = static_cast<float>(a.Z);
}
inline Vector3 operator+(const Vector3& a, const Vector3& b)
{
  return { a.X + b.X, a.Y + b.Y, a.Z + b.Z };
}
inline Vector3 operator-(const Vector3& a, const Vector3& b)
{
  return { a.X - b.X, a.Y - b.Y, a.Z - b.Z };
}
inline Vector3 operator*(double s, const Vector3& a)
{
  return { s * a.X, s * a.Y, s * a.Z };
}
inline double Dot(const Vector3& a, const Vector3& b)
{
  return a.X * b.X + a.Y * b.Y + a.Z * b.Z;
}
inline float SingleDot(const Float3& a, const Float3& b)
{
  return a.X * b.X + a.Y * b.Y + a.Z * b.Z;
}
inline Vector3 Cross(const Vector3& a, const Vector3& b)
{
  return { a.Y * b.Z - a.Z * b.Y, a.Z * b.X - a.X * b.Z, a.X * b.Y - a.Y * b.X };
}
inline double Length(const Vector3& a)
{
  return std::sqrt(Dot(a, a));
}
/// a / |a|, or `fallback` where a has no usable direction.
inline Vector3 Normalized(const Vector3& a, const Vector3& fallback)
{
  const double length = Length(a);
  return length > 0.0 && std::isfinite(length) ? (1.0 / length) * a : fallback;
}

/// Direction (cosine, sine), cosine >= 0, of the larger principal axis of [[xx, xy], [xy, yy]]:
/// half of the angle of (xx - yy, 2 xy), without the angle.
inline void PrincipalAxis(double xx, double yy, double xy, double& cosine, double& sine)
{
  const double x = xx - yy, y = 2.0 * xy;
  const double length = std::sqrt(x * x + y * y);
  cosine = 1.0;
  sine = 0.0;
  if (length > 0.0 && x >= 0.0)
  {
    cosine = std::sqrt(0.5 * (1.0 + x / length));
    sine = 0.5 * y / (length * cosine);
  }
  else if (length > 0.0)
  {
    sine = std::copysign(std::sqrt(0.5 * (1.0 - x / length)), y);
    cosine = 0.5 * std::max(0.0, y / (length * sine));
  }
}

/// Two unit vectors that make a right-handed frame (u, v, n) with the unit vector n, without
/// a branch that loses digits (Duff et al. 2017, "Building an orthonormal basis, revisited").
inline void TangentFrame(const Vector3& n, Vector3& u, Vector3& v)
{
  const double sign = std::copysign(1.0, n.Z);
  const double a = -1.0 / (sign + n.Z);
  const double b = n.X * n.Y * a;
  u = { 1.0 + sign * n.X * n.X * a, sign * b, -sign * n.X };
  v = { b, sign + n.Y * n.Y * a, -n.Y };
}
}
