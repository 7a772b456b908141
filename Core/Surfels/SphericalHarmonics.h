// SPDX-License-Identifier: BSD-3-Clause
/**
 * Colours that depend on the direction of view, as captures of 3D Gaussian splatting store them
 * (B. Kerbl, G. Kopanas, T. Leimkuehler, G. Drettakis. 3D Gaussian Splatting for Real-Time Radiance
 * Field Rendering. SIGGRAPH 2023): real spherical harmonics up to degree 3, orthonormal on the unit
 * sphere, in the order l = 0 .. 3, m = -l .. l. Functions of odd m have the sign (-1)^m of Condon
 * and Shortley.
 */
#pragma once

#include "Core/Simd/RealLanes.h"

namespace SurfelSplatting
{
constexpr int MaxHarmonics = 16; ///< of degree 0 to 3

/// Whether there are as many harmonics as some degree from 0 to 3 has.
constexpr bool IsNumberOfHarmonics(int count)
{
  return count == 1 || count == 4 || count == 9 || count == MaxHarmonics;
}

/**
 * Values of the first `count` harmonics.
 * @param direction from the camera to the centre, unit length, in the cloud's own coordinates
 * @param count     1, 4, 9 or 16
 * @param basis     receives them; the others are left unchanged
 */
template <class Real>
SURFELSPLATTING_INLINE void EvaluateHarmonics(
  const Vector3Of<Real>& direction, int count, Real (&basis)[MaxHarmonics])
{
  const Real &x = direction.X, &y = direction.Y, &z = direction.Z;
  basis[0] = Uniform<Real>(0.28209479177387814); // 1/2 sqrt(1 / pi)
  if (count < 4)
  {
    return;
  }
  constexpr double c1 = 0.4886025119029199; // 1/2 sqrt(3 / pi)
  basis[1] = -c1 * y;
  basis[2] = c1 * z;
  basis[3] = -c1 * x;
  if (count < 9)
  {
    return;
  }
  const Real xx = x * x, yy = y * y, zz = z * z;
  constexpr double c2 = 1.0925484305920792; // 1/2 sqrt(15 / pi)
  basis[4] = c2 * x * y;
  basis[5] = -c2 * y * z;
  basis[6] = 0.31539156525252005 * (2.0 * zz - xx - yy); // 1/4 sqrt(5 / pi)
  basis[7] = -c2 * x * z;
  basis[8] = 0.5 * c2 * (xx - yy);
  if (count < MaxHarmonics)
  {
    return;
  }
  constexpr double c33 = 0.5900435899266435, // 1/4 sqrt(35 / 2 pi)
    c32 = 2.890611442640554,                 // 1/2 sqrt(105 / pi)
    c31 = 0.4570457994644658;                // 1/4 sqrt(21 / 2 pi)
  basis[9] = -c33 * y * (3.0 * xx - yy);
  basis[10] = c32 * x * y * z;
  basis[11] = -c31 * y * (4.0 * zz - xx - yy);
  basis[12] = 0.3731763325901154 * z * (2.0 * zz - 3.0 * xx - 3.0 * yy); // 1/4 sqrt(7 / pi)
  basis[13] = -c31 * x * (4.0 * zz - xx - yy);
  basis[14] = 0.5 * c32 * z * (xx - yy);
  basis[15] = -c33 * x * (xx - 3.0 * yy);
}

/**
 * One channel of the colour: max(0, 0.5 + sum of coefficients times harmonics). Not clamped above.
 * NaN stays NaN, so that a check of the colour finds it.
 * @param basis       from EvaluateHarmonics
 * @param coefficient coefficient(k) is that of the harmonic k, for all lanes
 */
template <class Real, class Coefficient>
SURFELSPLATTING_INLINE Real ColorOfHarmonics(
  const Real (&basis)[MaxHarmonics], int count, Coefficient&& coefficient)
{
  Real sum = Uniform<Real>(0.5);
  for (int k = 0; k < count; ++k)
  {
    sum += basis[k] * coefficient(k);
  }
  return sum < 0.0 ? Real{} : sum;
}
}
