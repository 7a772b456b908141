// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Normalization/SheetKernels.h"

#include "Core/Simd/Multiversion.h"

namespace SurfelGeometry
{
namespace
{
/// exp(-q) is computed as exp(-q / 8)^8 for q up to 8, the largest support.
constexpr float LargestExponent = 8.0f;

/// exp(-8 r) for r from 0 to 1, within 1e-6: a Chebyshev interpolant of exp(-r) of degree 6.
inline float ExpOfEighth(float r)
{
  float e = 0.000849007875f;
  e = e * r - 0.00765432511f;
  e = e * r + 0.0412233177f;
  e = e * r - 0.166515167f;
  e = e * r + 0.499975091f;
  e = e * r - 0.999998454f;
  e = e * r + 0.999999984f;
  e *= e;
  e *= e;
  return e * e;
}
}

SURFEL_MULTIVERSION void FindKernels(
  const SheetKernels& s, const Float3& at, float support, int* __restrict kernels)
{
  for (int first = 0; first < s.Count; first += SheetKernels::Lanes)
  {
    for (int lane = 0; lane < SheetKernels::Lanes; ++lane)
    {
      const int k = first + lane;
      const float x = at.X - s.X[k], y = at.Y - s.Y[k], z = at.Z - s.Z[k];
      const float b1 = s.B1X[k] * x + s.B1Y[k] * y + s.B1Z[k] * z;
      const float b2 = s.B2X[k] * x + s.B2Y[k] * y + s.B2Z[k] * z;
      const float climb = s.NX[k] * x + s.NY[k] * y + s.NZ[k] * z;
      const float q = 0.5f * (b1 * b1 + b2 * b2);
      const float bounded = q < LargestExponent ? q : LargestExponent;
      const float kernel = ExpOfEighth(bounded * (1.0f / LargestExponent));
      const float squared = climb * climb;
      const bool reaches = (q < support) & (squared < s.Climb[k] * s.Climb[k]) &
        (squared >= s.LeastClimb[k] * s.LeastClimb[k]);
      kernels[k] = reaches ? static_cast<int>(KernelPeak * kernel + 0.5f) : 0;
    }
  }
}
}
