// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/KeySorter.h"

#include <algorithm>
#include <cstddef>

namespace SurfelSplatting
{
namespace
{
constexpr int DepthBit = 32;

/// The first bits of a key's depth, between the nearest and the farthest one: its bin.
class DepthBins
{
public:
  /// @param largest number of bins
  DepthBins(const std::vector<std::uint64_t>& keys, std::size_t largest)
  {
    std::uint64_t nearest = keys[0], farthest = keys[0];
    for (const std::uint64_t key : keys)
    {
      nearest = std::min(nearest, key);
      farthest = std::max(farthest, key);
    }
    this->First = static_cast<std::uint32_t>(nearest >> DepthBit);
    const std::uint32_t range = static_cast<std::uint32_t>(farthest >> DepthBit) - this->First;
    while (range >> this->Shift >= largest)
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

/// Sorts keys of which each is at most a few places away from its own.
void Insert(std::uint64_t* begin, std::uint64_t* end)
{
  for (std::uint64_t* key = begin + 1; key < end; ++key)
  {
    const std::uint64_t value = *key;
    std::uint64_t* place = key;
    for (; place > begin && place[-1] > value; --place)
    {
      *place = place[-1];
    }
    *place = value;
  }
}
}

/// A bucket sort with about as many bins as keys.
void KeySorter::Sort(std::vector<std::uint64_t>& keys)
{
  constexpr std::size_t few = 32, fewestBins = 256, mostBins = 4096;
  constexpr std::uint32_t crowded = 24;
  if (keys.size() < few)
  {
    std::sort(keys.begin(), keys.end());
    return;
  }
  std::size_t count = fewestBins;
  while (count < keys.size() && count < mostBins)
  {
    count *= 2;
  }
  const DepthBins bins(keys, count);
  this->Ends.assign(count, 0);
  std::uint32_t* ends = this->Ends.data();
  for (const std::uint64_t key : keys)
  {
    ++ends[bins(key)];
  }
  std::uint32_t sum = 0, largest = 0;
  for (std::size_t i = 0; i < count; ++i)
  {
    const std::uint32_t size = ends[i];
    largest = std::max(largest, size);
    ends[i] = sum;
    sum += size;
  }
  this->Work.resize(keys.size());
  for (const std::uint64_t key : keys)
  {
    this->Work[ends[bins(key)]++] = key;
  }
  keys.swap(this->Work);
  if (largest > crowded)
  {
    std::uint32_t begin = 0;
    for (std::size_t i = 0; i < count; begin = ends[i++])
    {
      if (ends[i] - begin > crowded)
      {
        std::sort(keys.data() + begin, keys.data() + ends[i]);
      }
    }
  }
  Insert(keys.data(), keys.data() + keys.size());
}
}
