// SPDX-License-Identifier: BSD-3-Clause
/**
 * Sixteen floats at a time, as vector types of the compiler (GCC, Clang): one register of AVX-512,
 * two of AVX2, four of SSE2 or NEON. A comparison gives a mask; Select(mask, a, b) chooses lane by
 * lane. Everything is local to a translation unit, since each is compiled for another processor.
 */
#pragma once

#include "Core/Simd/Inline.h"

#include <cstdint>

#if defined(__AVX2__)
#include <immintrin.h>
#endif

namespace SurfelSplatting
{
constexpr int LaneCount = 16;

namespace
{
#if defined(__AVX512F__)
constexpr int LanesPerPart = 16;
#elif defined(__AVX2__)
constexpr int LanesPerPart = 8;
#else
constexpr int LanesPerPart = 4;
#endif
constexpr int PartCount = LaneCount / LanesPerPart;

typedef float LanePart __attribute__((vector_size(4 * LanesPerPart)));
typedef std::int32_t IntPart __attribute__((vector_size(4 * LanesPerPart)));
typedef LanePart StoredPart __attribute__((may_alias)); // in an array of floats

#if defined(__AVX512F__)
typedef __mmask16 MaskPart;
SURFELSPLATTING_INLINE MaskPart IsLess(LanePart a, LanePart b)
{
  return _mm512_cmp_ps_mask(a, b, _CMP_LT_OQ);
}
SURFELSPLATTING_INLINE MaskPart IsAtMost(LanePart a, LanePart b)
{
  return _mm512_cmp_ps_mask(a, b, _CMP_LE_OQ);
}
SURFELSPLATTING_INLINE LanePart Choose(MaskPart m, LanePart a, LanePart b)
{
  return _mm512_mask_blend_ps(m, b, a);
}
SURFELSPLATTING_INLINE LanePart Smaller(LanePart a, LanePart b)
{
  return _mm512_maskz_min_ps(0xffff, a, b); // _mm512_min_ps warns in GCC 12
}
SURFELSPLATTING_INLINE LanePart Larger(LanePart a, LanePart b)
{
  return _mm512_maskz_max_ps(0xffff, a, b);
}
SURFELSPLATTING_INLINE LanePart Root(LanePart a)
{
  return _mm512_maskz_sqrt_ps(0xffff, a);
}
SURFELSPLATTING_INLINE LanePart AboutInverseRoot(LanePart a)
{
  return _mm512_maskz_rsqrt14_ps(0xffff, a);
}
SURFELSPLATTING_INLINE unsigned int Bits(MaskPart m)
{
  return m;
}
#else
typedef IntPart MaskPart;
SURFELSPLATTING_INLINE MaskPart IsLess(LanePart a, LanePart b)
{
  return a < b;
}
SURFELSPLATTING_INLINE MaskPart IsAtMost(LanePart a, LanePart b)
{
  return a <= b;
}
SURFELSPLATTING_INLINE LanePart Choose(MaskPart m, LanePart a, LanePart b)
{
  return m ? a : b;
}
// GCC 12 compares and chooses for a < b ? a : b: two instructions instead of one.
SURFELSPLATTING_INLINE LanePart Smaller(LanePart a, LanePart b)
{
#if defined(__AVX2__)
  return _mm256_min_ps(a, b);
#elif defined(__SSE2__)
  return __builtin_ia32_minps(a, b);
#else
  return a < b ? a : b;
#endif
}
SURFELSPLATTING_INLINE LanePart Larger(LanePart a, LanePart b)
{
#if defined(__AVX2__)
  return _mm256_max_ps(a, b);
#elif defined(__SSE2__)
  return __builtin_ia32_maxps(a, b);
#else
  return a > b ? a : b;
#endif
}
SURFELSPLATTING_INLINE LanePart Root(LanePart a)
{
  for (int l = 0; l < LanesPerPart; ++l)
  {
    a[l] = __builtin_sqrtf(a[l]);
  }
  return a;
}
SURFELSPLATTING_INLINE LanePart AboutInverseRoot(LanePart a)
{
#if defined(__AVX2__)
  const LanePart r = _mm256_rsqrt_ps(a);
#elif defined(__SSE2__)
  const LanePart r = __builtin_ia32_rsqrtps(a);
#else
  const LanePart r = 1.0f / Root(a);
#endif
  return r * (1.5f - 0.5f * a * r * r); // a step of Newton's method
}
SURFELSPLATTING_INLINE unsigned int Bits(MaskPart m)
{
#if defined(__AVX2__)
  return static_cast<unsigned int>(_mm256_movemask_ps((__m256)m));
#elif defined(__SSE2__)
  return static_cast<unsigned int>(
    __builtin_ia32_movmskps((float __attribute__((vector_size(16))))m));
#else
  unsigned int bits = 0;
  for (int l = 0; l < LanesPerPart; ++l)
  {
    bits |= (m[l] & 1u) << l;
  }
  return bits;
#endif
}
#endif

/// Lane l of the result is lane l ^ distance.
SURFELSPLATTING_INLINE LanePart Swapped(LanePart a, int distance)
{
#if defined(__clang__)
  LanePart swapped;
  for (int l = 0; l < LanesPerPart; ++l)
  {
    swapped[l] = a[l ^ distance];
  }
  return swapped;
#else
  IntPart order;
  for (int l = 0; l < LanesPerPart; ++l)
  {
    order[l] = l ^ distance;
  }
  return __builtin_shuffle(a, order); // GCC 12 makes no shuffle of the loop
#endif
}

struct LaneMask
{
  MaskPart P[PartCount];

  /// Bit l: lane l.
  SURFELSPLATTING_INLINE unsigned int ToBits() const
  {
    unsigned int bits = 0;
    for (int p = 0; p < PartCount; ++p)
    {
      bits |= Bits(P[p]) << (p * LanesPerPart);
    }
    return bits;
  }
};

struct Lanes
{
  LanePart P[PartCount];

  Lanes() = default;
  SURFELSPLATTING_INLINE Lanes(float x) // implicit: the same number in all lanes
  {
    for (LanePart& p : P)
    {
      p = x - LanePart{}; // 0 + x would be an addition: it is not -0 for -0
    }
  }

  /// Loads sixteen aligned floats.
  static SURFELSPLATTING_INLINE Lanes Load(const float* x)
  {
    Lanes a;
    for (int p = 0; p < PartCount; ++p)
    {
      a.P[p] = *reinterpret_cast<const StoredPart*>(x + p * LanesPerPart);
    }
    return a;
  }

  SURFELSPLATTING_INLINE void Store(float* x) const
  {
    for (int p = 0; p < PartCount; ++p)
    {
      *reinterpret_cast<StoredPart*>(x + p * LanesPerPart) = P[p];
    }
  }
};

#define SURFELSPLATTING_LANES(Result, signature, expression) \
  SURFELSPLATTING_INLINE Result signature                    \
  {                                                          \
    Result r;                                                \
    for (int p = 0; p < PartCount; ++p)                      \
    {                                                        \
      r.P[p] = expression;                                   \
    }                                                        \
    return r;                                                \
  }
SURFELSPLATTING_LANES(Lanes, operator+(const Lanes& a, const Lanes& b), a.P[p] + b.P[p])
SURFELSPLATTING_LANES(Lanes, operator-(const Lanes& a, const Lanes& b), a.P[p] - b.P[p])
SURFELSPLATTING_LANES(Lanes, operator*(const Lanes& a, const Lanes& b), a.P[p] * b.P[p])
SURFELSPLATTING_LANES(Lanes, operator/(const Lanes& a, const Lanes& b), a.P[p] / b.P[p])
SURFELSPLATTING_LANES(LaneMask, operator<(const Lanes& a, const Lanes& b), IsLess(a.P[p], b.P[p]))
SURFELSPLATTING_LANES(LaneMask, operator>(const Lanes& a, const Lanes& b), IsLess(b.P[p], a.P[p]))
SURFELSPLATTING_LANES(
  LaneMask, operator<=(const Lanes& a, const Lanes& b), IsAtMost(a.P[p], b.P[p]))
SURFELSPLATTING_LANES(
  LaneMask, operator>=(const Lanes& a, const Lanes& b), IsAtMost(b.P[p], a.P[p]))
SURFELSPLATTING_LANES(
  LaneMask, operator&(const LaneMask& a, const LaneMask& b), static_cast<MaskPart>(a.P[p] & b.P[p]))
SURFELSPLATTING_LANES(
  LaneMask, operator|(const LaneMask& a, const LaneMask& b), static_cast<MaskPart>(a.P[p] | b.P[p]))
SURFELSPLATTING_LANES(
  Lanes, Select(const LaneMask& m, const Lanes& a, const Lanes& b), Choose(m.P[p], a.P[p], b.P[p]))
/// The smaller and the larger; b where one of them is NaN.
SURFELSPLATTING_LANES(Lanes, Smaller(const Lanes& a, const Lanes& b), Smaller(a.P[p], b.P[p]))
SURFELSPLATTING_LANES(Lanes, Larger(const Lanes& a, const Lanes& b), Larger(a.P[p], b.P[p]))
SURFELSPLATTING_LANES(Lanes, SquareRoot(const Lanes& a), Root(a.P[p]))
/// 1 / sqrt(a), a > 1e-37: the relative error is 6.2e-5. Ten times as fast.
SURFELSPLATTING_LANES(Lanes, InverseRoot(const Lanes& a), AboutInverseRoot(a.P[p]))
SURFELSPLATTING_LANES(Lanes, Swap(const Lanes& a, int distance), Swapped(a.P[p], distance))
#undef SURFELSPLATTING_LANES

SURFELSPLATTING_INLINE Lanes& operator+=(Lanes& a, const Lanes& b)
{
  return a = a + b;
}

SURFELSPLATTING_INLINE Lanes& operator*=(Lanes& a, const Lanes& b)
{
  return a = a * b;
}

/// The smallest of each group of four, in all four lanes.
SURFELSPLATTING_INLINE Lanes SmallestOfFour(const Lanes& a)
{
  const Lanes pairs = Smaller(a, Swap(a, 1));
  return Smaller(pairs, Swap(pairs, 2));
}

/// The largest of each group of four, in all four lanes.
SURFELSPLATTING_INLINE Lanes LargestOfFour(const Lanes& a)
{
  const Lanes pairs = Larger(a, Swap(a, 1));
  return Larger(pairs, Swap(pairs, 2));
}

SURFELSPLATTING_INLINE bool Any(const LaneMask& mask)
{
  return mask.ToBits() != 0;
}

SURFELSPLATTING_INLINE LaneMask AllLanes()
{
  return Lanes(0.0f) <= Lanes(0.0f);
}

/// exp(-x) for x in [0, 80]: 2^n times Cephes' polynomial for 2^f, f in [-1/2, 1/2]. The relative
/// error is 2e-7 from the polynomial plus 7.5e-8 x from rounding x log2(e).
SURFELSPLATTING_INLINE Lanes ExpOfMinus(const Lanes& x)
{
  const Lanes t = x * -1.44269504f;
  // 1.5 * 2^23: rounds to the nearest integer in the low bits
  const Lanes shifted = t + 12582912.0f;
  const Lanes f = t - (shifted - 12582912.0f);
  Lanes e = 1.535336188e-4f * f + 1.339887440e-3f;
  e = e * f + 9.618437357e-3f;
  e = e * f + 5.550332471e-2f;
  e = e * f + 2.402264791e-1f;
  e = e * f + 6.931472028e-1f;
  e = e * f + 1.0f;
  for (int p = 0; p < PartCount; ++p)
  {
    // The shift drops the 1.5 * 2^23 part.
    const IntPart bits = ((IntPart)shifted.P[p] + 127) << 23;
    e.P[p] *= (LanePart)bits;
  }
  return e;
}

/// a 2^x for x in [-125, 0], off by 3e-7 of it, by Estrin's scheme: half as long a chain of
/// operations as of ExpOfMinus, for loops that wait for it. Other lanes get any number or NaN.
SURFELSPLATTING_INLINE Lanes TimesPowerOfTwo(float a, const Lanes& x)
{
  constexpr float toExponent = 12582912.0f + 127.0f; // 1.5 * 2^23, and the bias of exponents
  const Lanes shifted = x + toExponent;
  const Lanes f = x - (shifted - toExponent), squared = f * f;
  Lanes scale;
  for (int p = 0; p < PartCount; ++p)
  {
    scale.P[p] = (LanePart)((IntPart)shifted.P[p] << 23);
  }
  // The polynomial of degree 5 with the smallest relative error in [-1/2, 1/2].
  const Lanes low = 6.931469440e-1f * f + 1.0f, middle = 5.550713092e-2f * f + 2.402212024e-1f;
  const Lanes high = 1.327647129e-3f * f + 9.675540961e-3f;
  return ((high * squared + middle) * squared + low) * (a * scale);
}
}
}
