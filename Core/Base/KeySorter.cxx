// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/KeySorter.h"

#include <algorithm>
#include <cstddef>

namespace SurfelSplatting
{
/// By sixteen bits of the depths between the nearest and the farthest one, in two passes of a radix
/// sort; keys that are alike in these, few or all of them, by what is left.
void KeySorter::Sort(std::vector<std::uint64_t>& keys)
{
  constexpr std::size_t few = 32;
  constexpr int bins = 256, depthBit = 32;
  const std::size_t n = keys.size();
  if (n < few)
  {
    std::sort(keys.begin(), keys.end());
    return;
  }
  std::uint64_t least = keys[0], largest = keys[0];
  for (const std::uint64_t key : keys)
  {
    least = std::min(least, key);
    largest = std::max(largest, key);
  }
  const std::uint32_t first = static_cast<std::uint32_t>(least >> depthBit);
  std::uint32_t range = static_cast<std::uint32_t>(largest >> depthBit) - first;
  int shift = 0;
  while (range >> shift > 0xffff)
  {
    ++shift;
  }
  const auto digits = [&](std::uint64_t key) {
    return (static_cast<std::uint32_t>(key >> depthBit) - first) >> shift;
  };
  std::uint32_t counts[2][bins] = {};
  for (const std::uint64_t key : keys)
  {
    const std::uint32_t d = digits(key);
    ++counts[0][d & 255];
    ++counts[1][d >> 8];
  }
  for (std::uint32_t* digit : counts)
  {
    std::uint32_t sum = 0;
    for (int i = 0; i < bins; ++i)
    {
      const std::uint32_t count = digit[i];
      digit[i] = sum;
      sum += count;
    }
  }
  this->Other.resize(n);
  for (const std::uint64_t key : keys)
  {
    this->Other[counts[0][digits(key) & 255]++] = key;
  }
  for (const std::uint64_t key : this->Other)
  {
    keys[counts[1][digits(key) >> 8]++] = key;
  }
  for (std::size_t begin = 0, end = 0; begin < n; begin = end)
  {
    const std::uint32_t d = digits(keys[begin]);
    for (end = begin + 1; end < n && digits(keys[end]) == d;)
    {
      ++end;
    }
    if (end - begin > 1)
    {
      std::sort(keys.data() + begin, keys.data() + end);
    }
  }
}
}
