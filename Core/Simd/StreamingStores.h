// SPDX-License-Identifier: BSD-3-Clause
/**
 * Stores that bypass the caches, for arrays that do not fit into them: memory that is overwritten
 * as a whole need not be read first. The functions are local to each translation unit.
 */
#pragma once

#include <cstdint>

#if defined(__SSE2__)
#include <immintrin.h>
#endif

namespace SurfelSplatting
{
namespace
{
#if defined(__SSE2__)
inline bool CanStreamTo(const float* array)
{
  return reinterpret_cast<std::uintptr_t>(array) % 16 == 0;
}

/// @param to a multiple of four floats from the begin of an array that can be streamed to
inline void StreamFour(float* to, float a, float b, float c, float d)
{
  _mm_stream_ps(to, __m128{ a, b, c, d });
}

/// Call before other threads read the streamed values.
inline void FinishStreaming()
{
  _mm_sfence();
}
#else
inline bool CanStreamTo(const float*)
{
  return false;
}

inline void StreamFour(float* to, float a, float b, float c, float d)
{
  to[0] = a;
  to[1] = b;
  to[2] = c;
  to[3] = d;
}

inline void FinishStreaming() {}
#endif
}
}
