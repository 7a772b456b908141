// SPDX-License-Identifier: BSD-3-Clause
/**
 * Eight floats at a time in the compiler's own vector types (GCC, Clang), lowered to whatever the
 * target has. A comparison gives a mask, all bits of a lane set or none; mask ? a : b selects lane
 * by lane.
 */
#pragma once

#include <cstdint>

#if defined(__GNUC__)
#define SURFELSPLATTING_INLINE __attribute__((always_inline)) inline
#else
#error "The raster uses vector types of GCC and Clang."
#endif

namespace SurfelSplatting
{
constexpr int LaneCount = 8;
typedef float Lanes __attribute__((vector_size(4 * LaneCount)));
typedef std::int32_t LaneMask __attribute__((vector_size(4 * LaneCount)));
typedef std::int64_t LanePairs __attribute__((vector_size(4 * LaneCount)));

SURFELSPLATTING_INLINE void Set(Lanes& x, float value)
{
  x = Lanes{} + value;
}

SURFELSPLATTING_INLINE void Min(Lanes& x, const Lanes& y)
{
  x = y < x ? y : x;
}

SURFELSPLATTING_INLINE void Max(Lanes& x, const Lanes& y)
{
  x = y > x ? y : x;
}

SURFELSPLATTING_INLINE bool Any(const LaneMask& mask)
{
  const LanePairs pairs = (LanePairs)mask; // same bits
  return (pairs[0] | pairs[1] | pairs[2] | pairs[3]) != 0;
}

SURFELSPLATTING_INLINE void Sqrt(Lanes& x)
{
  Lanes root;
  for (int l = 0; l < LaneCount; ++l)
  {
    root[l] = __builtin_sqrtf(x[l]);
  }
  x = root;
}

/// x = exp(-x) for x in [0, 80]: 2^n times Cephes' polynomial for 2^f, f in [-1/2, 1/2]. Relative
/// error 2e-7 + 7.5e-8 x: the polynomial's, and that of rounding x log2(e).
SURFELSPLATTING_INLINE void ExpOfMinus(Lanes& x)
{
  const Lanes t = x * -1.44269504f;
  const Lanes shifted =
    t + 12582912.0f; // 1.5 * 2^23: rounds to the nearest integer in the low bits
  const Lanes f = t - (shifted - 12582912.0f);
  Lanes p = 1.535336188e-4f * f + 1.339887440e-3f;
  p = p * f + 9.618437357e-3f;
  p = p * f + 5.550332471e-2f;
  p = p * f + 2.402264791e-1f;
  p = p * f + 6.931472028e-1f;
  p = p * f + 1.0f;
  // The shift drops the 1.5 * 2^23 part.
  const LaneMask bits = ((LaneMask)shifted + 127) << 23;
  x = p * (Lanes)bits;
}
}
