// SPDX-License-Identifier: BSD-3-Clause
/**
 * Operations on 3-vectors for the filters: computed in double, stored in float.
 */
#pragma once

#include "Core/Base/Geometry.h"

#include <algorithm>
#include <cmath>

namespace SurfelGeometry
{
using SurfelSplatting::Cross;
using SurfelSplatting::Dot;
using SurfelSplatting::Norm;
using SurfelSplatting::Pi;
using SurfelSplatting::Vector3;
using SurfelSplatting::operator+;
using SurfelSplatting::operator-;
using SurfelSplatting::operator*;

/// A vector stored for each point: half the memory of a Vector3, and half the time to move it.
struct Float3
{
  float X = 0.0f, Y = 0.0f, Z = 0.0f;

  Float3() = default;
  Float3(const Vector3& a)
    : X(static_cast<float>(a[0]))
    , Y(static_cast<float>(a[1]))
    , Z(static_cast<float>(a[2]))
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
  p[0] = static_cast<float>(a[0]);
  p[1] = static_cast<float>(a[1]);
  p[2] = static_cast<float>(a[2]);
}
/// In single precision.
inline float SingleDot(const Float3& a, const Float3& b)
{
  return a.X * b.X + a.Y * b.Y + a.Z * b.Z;
}
/// a / |a|, or `fallback` if a is zero or not finite.
inline Vector3 Normalized(const Vector3& a, const Vector3& fallback)
{
  const double length = Norm(a);
  return length > 0.0 && std::isfinite(length) ? (1.0 / length) * a : fallback;
}

/// Direction (cosine, sine), cosine >= 0, of the larger principal axis of [[xx, xy], [xy, yy]]. Its
/// angle is half that of (xx - yy, 2 xy), but is not computed.
template <typename Scalar>
void PrincipalAxis(Scalar xx, Scalar yy, Scalar xy, Scalar& cosine, Scalar& sine)
{
  constexpr auto one = Scalar(1), half = Scalar(0.5);
  const Scalar x = xx - yy, y = xy + xy;
  const Scalar length = std::sqrt(x * x + y * y);
  cosine = one;
  sine = Scalar(0);
  if (length > Scalar(0) && x >= Scalar(0))
  {
    cosine = std::sqrt(half * (one + x / length));
    sine = half * y / (length * cosine);
  }
  else if (length > Scalar(0))
  {
    sine = std::copysign(std::sqrt(half * (one - x / length)), y);
    cosine = half * std::max(Scalar(0), y / (length * sine));
  }
}

/// Completes the unit vector n to a right-handed orthonormal frame (u, v, n), accurate for every n
/// (Duff et al. 2017, "Building an orthonormal basis, revisited").
inline void TangentFrame(const Vector3& n, Vector3& u, Vector3& v)
{
  const double sign = std::copysign(1.0, n[2]);
  const double a = -1.0 / (sign + n[2]);
  const double b = n[0] * n[1] * a;
  u = { 1.0 + sign * n[0] * n[0] * a, sign * b, -sign * n[0] };
  v = { b, sign + n[1] * n[1] * a, -n[1] };
}
}
