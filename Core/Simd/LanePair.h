// SPDX-License-Identifier: BSD-3-Clause
/**
 * Two Lanes at a time, for formulas that are templates of Real: where each operation waits for the
 * one before, two independent chains take hardly longer than one.
 */
#pragma once

#include "Core/Simd/Lanes.h"

namespace SurfelSplatting
{
namespace
{
struct MaskPair
{
  LaneMask A, B;
};

struct LanePair
{
  Lanes A, B;

  LanePair() = default;
  SURFELSPLATTING_INLINE LanePair(float x) // implicit, as of Lanes
    : A(x)
    , B(x)
  {
  }
  SURFELSPLATTING_INLINE LanePair(const Lanes& a, const Lanes& b)
    : A(a)
    , B(b)
  {
  }
};

#define SURFELSPLATTING_PAIRS(Result, signature, a, b) \
  SURFELSPLATTING_INLINE Result signature              \
  {                                                    \
    return { a, b };                                   \
  }
SURFELSPLATTING_PAIRS(
  LanePair, operator+(const LanePair& x, const LanePair& y), x.A + y.A, x.B + y.B)
SURFELSPLATTING_PAIRS(
  LanePair, operator-(const LanePair& x, const LanePair& y), x.A - y.A, x.B - y.B)
SURFELSPLATTING_PAIRS(LanePair, operator*(const LanePair& x, const LanePair& y), x.A* y.A, x.B* y.B)
SURFELSPLATTING_PAIRS(
  LanePair, operator/(const LanePair& x, const LanePair& y), x.A / y.A, x.B / y.B)
SURFELSPLATTING_PAIRS(
  MaskPair, operator<(const LanePair& x, const LanePair& y), x.A < y.A, x.B < y.B)
SURFELSPLATTING_PAIRS(
  MaskPair, operator>(const LanePair& x, const LanePair& y), x.A > y.A, x.B > y.B)
SURFELSPLATTING_PAIRS(
  MaskPair, operator<=(const LanePair& x, const LanePair& y), x.A <= y.A, x.B <= y.B)
SURFELSPLATTING_PAIRS(
  MaskPair, operator>=(const LanePair& x, const LanePair& y), x.A >= y.A, x.B >= y.B)
SURFELSPLATTING_PAIRS(MaskPair, operator&(const MaskPair& x, const MaskPair& y), x.A& y.A, x.B& y.B)
SURFELSPLATTING_PAIRS(
  LanePair, Smaller(const LanePair& x, const LanePair& y), Smaller(x.A, y.A), Smaller(x.B, y.B))
SURFELSPLATTING_PAIRS(
  LanePair, Larger(const LanePair& x, const LanePair& y), Larger(x.A, y.A), Larger(x.B, y.B))
SURFELSPLATTING_PAIRS(LanePair, SquareRoot(const LanePair& x), SquareRoot(x.A), SquareRoot(x.B))
SURFELSPLATTING_PAIRS(LanePair, InverseRoot(const LanePair& x), InverseRoot(x.A), InverseRoot(x.B))
SURFELSPLATTING_PAIRS(LanePair, TimesPowerOfTwo(float a, const LanePair& x),
  TimesPowerOfTwo(a, x.A), TimesPowerOfTwo(a, x.B))
SURFELSPLATTING_PAIRS(LanePair, Select(const MaskPair& m, const LanePair& x, const LanePair& y),
  Select(m.A, x.A, y.A), Select(m.B, x.B, y.B))
#undef SURFELSPLATTING_PAIRS
}
}
