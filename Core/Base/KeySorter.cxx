// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/KeySorter.h"

#include <algorithm>
#include <cstddef>

namespace SurfelSplatting
{
namespace
{
constexpr int Bins = 256; // of a radix pass
constexpr int DepthBit = 32;

/// Sixteen bits of a key's depth, between the nearest and the farthest one.
class DepthDigits
{
public:
  explicit DepthDigits(const std::vector<std::uint64_t>& keys)
  {
    std::uint64_t nearest = keys[0], farthest = keys[0];
    for (const std::uint64_t key : keys)
    {
      nearest = std::min(nearest, key);
      farthest = std::max(farthest, key);
    }
    this->First = static_cast<std::uint32_t>(nearest >> DepthBit);
    const std::uint32_t range = static_cast<std::uint32_t>(farthest >> DepthBit) - this->First;
    while (range >> this->Shift > 0xffff)
    {
      ++this->Shift;
    }
  }

  std::uint32_t operator()(std::uint64_t key) const
  {
    return (static_cast<std::uint32_t>(key >> DepthBit) - this->First) >> this->Shift;
  }

private:
  std::uint32_t First;
  int Shift = 0;
};

/// Counts to where each bin begins.
void SumUp(std::uint32_t* counts)
{
  std::uint32_t sum = 0;
  for (int i = 0; i < Bins; ++i)
  {
    const std::uint32_t count = counts[i];
    counts[i] = sum;
    sum += count;
  }
}

/// Sorts the ranges of keys with the same digits.
void SortTies(std::vector<std::uint64_t>& keys, const DepthDigits& digits)
{
  for (std::size_t begin = 0, end = 0; begin < keys.size(); begin = end)
  {
    const std::uint32_t d = digits(keys[begin]);
    for (end = begin + 1; end < keys.size() && digits(keys[end]) == d;)
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

/// A radix sort by the digits of the depths, in two passes; then ties, few or all of the keys, by
/// all of their bits.
void KeySorter::Sort(std::vector<std::uint64_t>& keys)
{
  constexpr std::size_t few = 32;
  if (keys.size() < few)
  {
    std::sort(keys.begin(), keys.end());
    return;
  }
  const DepthDigits digits(keys);
  std::uint32_t counts[2][Bins] = {};
  for (const std::uint64_t key : keys)
  {
    const std::uint32_t d = digits(key);
    ++counts[0][d & 255];
    ++counts[1][d >> 8];
  }
  SumUp(counts[0]);
  SumUp(counts[1]);
  this->Work.resize(keys.size());
  for (const std::uint64_t key : keys)
  {
    this->Work[counts[0][digits(key) & 255]++] = key;
  }
  for (const std::uint64_t key : this->Work)
  {
    keys[counts[1][digits(key) >> 8]++] = key;
  }
  SortTies(keys, digits);
}
}
