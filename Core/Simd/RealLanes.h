// SPDX-License-Identifier: BSD-3-Clause
/**
 * Several doubles at a time in the compiler's vector types: one register of the instruction set
 * that a translation unit is compiled for, so that everything here is that unit's own. As in
 * Lanes.h a comparison gives a mask, mask ? a : b selects.
 */
#pragma once

#include "Core/Simd/Lanes.h"

#include <cstdint>

namespace SurfelSplatting
{
namespace
{
#if defined(__AVX512F__)
constexpr int RealLaneCount = 8;
#elif defined(__AVX2__)
constexpr int RealLaneCount = 4;
#else
constexpr int RealLaneCount = 2;
#endif
typedef double Reals __attribute__((vector_size(8 * RealLaneCount)));
typedef std::int64_t RealMask __attribute__((vector_size(8 * RealLaneCount)));
typedef float Floats __attribute__((vector_size(4 * RealLaneCount)));
typedef std::int32_t Ints __attribute__((vector_size(4 * RealLaneCount)));

SURFELSPLATTING_INLINE Reals ToReals(double x)
{
  return Reals{} + x;
}

SURFELSPLATTING_INLINE Reals ToReals(const Floats& x)
{
  return __builtin_convertvector(x, Reals);
}

SURFELSPLATTING_INLINE Reals ToReals(const Ints& x)
{
  return __builtin_convertvector(x, Reals);
}

SURFELSPLATTING_INLINE Floats ToFloats(const Reals& x)
{
  return __builtin_convertvector(x, Floats);
}

/// A vector with function(lane) in each lane.
template <typename Vector, typename Function>
SURFELSPLATTING_INLINE Vector FillLanes(Function&& function)
{
  Vector x;
  for (int l = 0; l < RealLaneCount; ++l)
  {
    x[l] = function(l);
  }
  return x;
}

/// The larger one; b where a is NaN.
SURFELSPLATTING_INLINE Reals Larger(const Reals& a, const Reals& b)
{
  return a > b ? a : b;
}

/// The smaller one; b where a is NaN.
SURFELSPLATTING_INLINE Reals Smaller(const Reals& a, const Reals& b)
{
  return a < b ? a : b;
}

SURFELSPLATTING_INLINE Reals Magnitude(const Reals& a)
{
  return (Reals)((RealMask)a & INT64_MAX);
}

SURFELSPLATTING_INLINE Reals SquareRoot(const Reals& a)
{
  Reals root;
  for (int l = 0; l < RealLaneCount; ++l)
  {
    root[l] = __builtin_sqrt(a[l]);
  }
  return root;
}

SURFELSPLATTING_INLINE bool AnyOf(const RealMask& mask)
{
  std::int64_t any = 0;
  for (int l = 0; l < RealLaneCount; ++l)
  {
    any |= mask[l];
  }
  return any != 0;
}

/// NaN and infinity are not.
SURFELSPLATTING_INLINE RealMask IsFinite(const Reals& a)
{
  return a - a == 0.0;
}

struct Reals3
{
  Reals X, Y, Z;
};

SURFELSPLATTING_INLINE Reals Dot(const Reals3& a, const Reals3& b)
{
  return a.X * b.X + a.Y * b.Y + a.Z * b.Z;
}

SURFELSPLATTING_INLINE Reals Norm(const Reals3& a)
{
  return SquareRoot(Dot(a, a));
}

SURFELSPLATTING_INLINE Reals Dot(const double a[3], const Reals3& b)
{
  return a[0] * b.X + a[1] * b.Y + a[2] * b.Z;
}
}
}
