// SPDX-License-Identifier: BSD-3-Clause
/**
 * Sorting by depth: keys with a float's order in the upper 32 bits and an index in the lower ones.
 */
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

namespace SurfelSplatting
{
/// Order of floats as unsigned integers.
inline std::uint32_t SortableBits(float value)
{
  std::uint32_t bits;
  std::memcpy(&bits, &value, sizeof(bits));
  return bits & 0x80000000u ? ~bits : bits | 0x80000000u;
}

/// The float of these bits.
inline float FloatOfBits(std::uint32_t sortable)
{
  const std::uint32_t bits = sortable & 0x80000000u ? sortable & 0x7fffffffu : ~sortable;
  float value;
  std::memcpy(&value, &bits, sizeof(value));
  return value;
}

/// A key, and what it is made of.
inline std::uint64_t KeyOf(float depth, std::uint32_t index)
{
  return static_cast<std::uint64_t>(SortableBits(depth)) << 32 | index;
}
inline std::uint32_t IndexOfKey(std::uint64_t key)
{
  return static_cast<std::uint32_t>(key);
}
inline float DepthOfKey(std::uint64_t key)
{
  return FloatOfBits(static_cast<std::uint32_t>(key >> 32));
}

/// Sorts keys, ascending by depth and index: by two digits of the depth, which hold the more bits
/// the more keys there are, and keys of equal digits by comparison.
class KeySorter
{
public:
  static constexpr int MostDigitBits = 11;

  void Sort(std::uint64_t* keys, std::size_t size);

private:
  std::vector<std::uint64_t> Work;
  std::array<std::uint32_t, 2 << MostDigitBits> Ends; // of the keys of each digit
};
}
