// SPDX-License-Identifier: BSD-3-Clause
/**
 * Instructions of the processor: prefetching, and bits.
 */
#pragma once

#include <cstdint>

#ifdef __SSE2__
#include <emmintrin.h>
#endif

/// Starts loading the data at an address that will be read soon.
#if defined(__GNUC__)
#define SURFEL_PREFETCH(address) __builtin_prefetch(address)
#else
#define SURFEL_PREFETCH(address) static_cast<void>(address)
#endif

namespace SurfelGeometry
{
/// Bit k tells whether values[k] > 0.
/// @param values [8]
inline unsigned int PositiveBits(const float* values)
{
#ifdef __SSE2__
  const __m128 zero = _mm_setzero_ps();
  const int low = _mm_movemask_ps(_mm_cmpgt_ps(_mm_loadu_ps(values), zero));
  const int high = _mm_movemask_ps(_mm_cmpgt_ps(_mm_loadu_ps(values + 4), zero));
  return static_cast<unsigned int>(low | high << 4);
#else
  unsigned int bits = 0;
  for (int k = 0; k < 8; ++k)
  {
    bits |= (values[k] > 0.0f ? 1u : 0u) << k;
  }
  return bits;
#endif
}

/// Number of the lowest bit that is set; `bits` is not 0.
inline int LowestBit(std::uint64_t bits)
{
#ifdef __GNUC__
  return __builtin_ctzll(bits);
#else
  int bit = 0;
  while ((bits >> bit & 1) == 0)
  {
    ++bit;
  }
  return bit;
#endif
}
}
