// SPDX-License-Identifier: BSD-3-Clause
/**
 * Lets one formula serve one surfel or several at a time. Formulas are templates of Real, which is
 * double or a vector of doubles (vector types of GCC and Clang) with one surfel per lane.
 *
 * A comparison gives a mask (bool for double), and mask ? a : b chooses lane by lane. The result of
 * a lane does not depend on the other lanes. VectorReal has as many lanes as fit the instruction
 * set that a translation unit is compiled for.
 */
#pragma once

#include "Core/Simd/Inline.h"

#include <cstdint>
#include <type_traits>

#if defined(__AVX2__)
#include <immintrin.h>
#endif

namespace SurfelSplatting
{
/// Types with as many lanes as Real: masks, floats and integers.
template <class Real>
struct LaneTypes
{
  static constexpr int Count = static_cast<int>(sizeof(Real) / sizeof(double));
  typedef std::int64_t Mask __attribute__((vector_size(sizeof(Real))));
  typedef float Float __attribute__((vector_size(sizeof(Real) / 2)));
  typedef std::int32_t Int __attribute__((vector_size(sizeof(Real) / 2)));
};

template <>
struct LaneTypes<double>
{
  static constexpr int Count = 1;
  typedef bool Mask;
  typedef float Float;
  typedef std::int32_t Int;
};

template <class Real>
using MaskOf = typename LaneTypes<Real>::Mask;
template <class Real>
using FloatOf = typename LaneTypes<Real>::Float;
template <class Real>
using IntOf = typename LaneTypes<Real>::Int;

/// The doubles of one register in this translation unit's instruction set.
#if defined(__AVX512F__)
typedef double VectorReal __attribute__((vector_size(64)));
#elif defined(__AVX2__)
typedef double VectorReal __attribute__((vector_size(32)));
#else
typedef double VectorReal __attribute__((vector_size(16)));
#endif

/// x in all lanes.
template <class Real>
SURFELSPLATTING_INLINE Real Uniform(double x)
{
  return Real{} + x;
}

/// For formulas that serve Lanes (Lanes.h) as well.
SURFELSPLATTING_INLINE double Select(bool chosen, double a, double b)
{
  return chosen ? a : b;
}

/// Converts the lanes to another type; rounds towards zero if it is an integer type.
template <class To, class From>
SURFELSPLATTING_INLINE To ConvertLanes(const From& x)
{
  if constexpr (std::is_arithmetic<From>::value)
  {
    return static_cast<To>(x);
  }
  else
  {
    return __builtin_convertvector(x, To);
  }
}

template <class Real>
SURFELSPLATTING_INLINE Real Widen(const FloatOf<Real>& x)
{
  return ConvertLanes<Real>(x);
}

template <class Real>
SURFELSPLATTING_INLINE Real WidenInt(const IntOf<Real>& x)
{
  return ConvertLanes<Real>(x);
}

template <class Real>
SURFELSPLATTING_INLINE FloatOf<Real> Narrow(const Real& x)
{
  return ConvertLanes<FloatOf<Real>>(x);
}

/// One lane of anything that has lanes.
template <class Lanes>
SURFELSPLATTING_INLINE auto LaneAt(const Lanes& x, int lane)
{
  if constexpr (std::is_arithmetic<Lanes>::value)
  {
    return x;
  }
  else
  {
    return x[lane];
  }
}

/// Sets each of `count` lanes to function(lane).
template <class Lanes, class Function>
SURFELSPLATTING_INLINE Lanes FillLanes(int count, Function&& function)
{
  if constexpr (std::is_arithmetic<Lanes>::value)
  {
    return static_cast<Lanes>(function(0));
  }
  else
  {
    Lanes x;
    for (int l = 0; l < count; ++l)
    {
      x[l] = function(l);
    }
    return x;
  }
}

/// The larger value of each lane; b where a is NaN. GCC 12 would compare and choose vectors.
template <class Real>
SURFELSPLATTING_INLINE Real Larger(const Real& a, const Real& b)
{
#if defined(__AVX512F__)
  if constexpr (sizeof(Real) == sizeof(__m512d))
  {
    return _mm512_maskz_max_pd(0xff, a, b);
  }
#elif defined(__AVX2__)
  if constexpr (sizeof(Real) == sizeof(__m256d))
  {
    return _mm256_max_pd(a, b);
  }
#endif
  return a > b ? a : b;
}

/// The smaller value of each lane; b where a is NaN.
template <class Real>
SURFELSPLATTING_INLINE Real Smaller(const Real& a, const Real& b)
{
#if defined(__AVX512F__)
  if constexpr (sizeof(Real) == sizeof(__m512d))
  {
    return _mm512_maskz_min_pd(0xff, a, b);
  }
#elif defined(__AVX2__)
  if constexpr (sizeof(Real) == sizeof(__m256d))
  {
    return _mm256_min_pd(a, b);
  }
#endif
  return a < b ? a : b;
}

template <class Real>
SURFELSPLATTING_INLINE Real Magnitude(const Real& a)
{
  if constexpr (std::is_arithmetic<Real>::value)
  {
    return __builtin_fabs(a);
  }
  else
  {
    return (Real)((MaskOf<Real>)a & INT64_MAX);
  }
}

template <class Real>
SURFELSPLATTING_INLINE Real SquareRoot(const Real& a)
{
  return FillLanes<Real>(
    LaneTypes<Real>::Count, [&](int l) { return __builtin_sqrt(LaneAt(a, l)); });
}

/// 1 / sqrt(a), a > 0.
template <class Real>
SURFELSPLATTING_INLINE Real InverseRoot(const Real& a)
{
  return 1.0 / SquareRoot(a);
}

/// base^exponent, lane by lane.
template <class Real>
SURFELSPLATTING_INLINE Real Powers(const Real& base, const Real& exponent)
{
  return FillLanes<Real>(LaneTypes<Real>::Count,
    [&](int l) { return __builtin_pow(LaneAt(base, l), LaneAt(exponent, l)); });
}

template <class Real>
SURFELSPLATTING_INLINE Real Power(const Real& base, double exponent)
{
  if (exponent == 1.0)
  {
    return base;
  }
  return Powers(base, Uniform<Real>(exponent));
}

/// False for NaN and infinity.
template <class Real>
SURFELSPLATTING_INLINE MaskOf<Real> IsFinite(const Real& a)
{
  return a - a == 0.0;
}

template <class Mask>
SURFELSPLATTING_INLINE Mask Not(const Mask& mask)
{
  if constexpr (std::is_arithmetic<Mask>::value)
  {
    return !mask;
  }
  else
  {
    return ~mask;
  }
}

/// The lanes before a number of them.
template <class Real>
SURFELSPLATTING_INLINE MaskOf<Real> LanesBefore(double count)
{
  return FillLanes<Real>(LaneTypes<Real>::Count, [](int l) { return l; }) < count;
}

/// Number of lanes that are set in a mask.
template <class Real>
SURFELSPLATTING_INLINE int CountLanes(const MaskOf<Real>& mask)
{
#if defined(__AVX512F__)
  if constexpr (sizeof(Real) == sizeof(__m512i))
  {
    return __builtin_popcount(_mm512_test_epi64_mask((__m512i)mask, (__m512i)mask));
  }
#endif
  int count = 0;
  for (int l = 0; l < LaneTypes<Real>::Count; ++l)
  {
    count += LaneAt(mask, l) ? 1 : 0;
  }
  return count;
}

template <class Real>
SURFELSPLATTING_INLINE bool AnyLane(const MaskOf<Real>& mask)
{
#if defined(__AVX512F__)
  if constexpr (sizeof(Real) == sizeof(__m512i))
  {
    return _mm512_test_epi64_mask((__m512i)mask, (__m512i)mask) != 0;
  }
#elif defined(__AVX2__)
  if constexpr (sizeof(Real) == sizeof(__m256i))
  {
    return _mm256_testz_si256((__m256i)mask, (__m256i)mask) == 0;
  }
#endif
  std::int64_t any = 0;
  for (int l = 0; l < LaneTypes<Real>::Count; ++l)
  {
    any |= LaneAt(mask, l);
  }
  return any != 0;
}

/// A vector in space for each lane.
template <class Real>
struct Vector3Of
{
  Real X, Y, Z;
};

template <class Real>
SURFELSPLATTING_INLINE Real Dot(const Vector3Of<Real>& a, const Vector3Of<Real>& b)
{
  return a.X * b.X + a.Y * b.Y + a.Z * b.Z;
}

/// a: a row of a matrix that all lanes share.
template <class Real>
SURFELSPLATTING_INLINE Real Dot(const double (&a)[3], const Vector3Of<Real>& b)
{
  return a[0] * b.X + a[1] * b.Y + a[2] * b.Z;
}

template <class Real>
SURFELSPLATTING_INLINE Real Norm(const Vector3Of<Real>& a)
{
  return SquareRoot(Dot(a, a));
}
}
