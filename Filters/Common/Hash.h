// SPDX-License-Identifier: BSD-3-Clause
/**
 * Numbers that look random and depend on an id alone.
 */
#pragma once

#include <cstdint>

namespace SurfelGeometry
{
/// Fractional part in [0, 1) of a hash of an id (Steele et al. 2014, splitmix64's finisher).
inline double Hash(std::uint64_t x)
{
  x += 0x9e3779b97f4a7c15ull;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return static_cast<double>((x ^ (x >> 31)) >> 11) * 0x1.0p-53;
}
}
