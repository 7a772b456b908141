// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/KeySorter.h"

#include <algorithm>
#include <cstddef>

namespace SurfelSplatting
{
namespace
{
constexpr int DepthBit = 32;

/// Keys of one bin are moved to their places, if there are no more of them.
constexpr std::uint32_t Crowded = 24;

/// A run of keys.
struct KeyRun
{
  std::uint64_t* Begin;
  std::size_t Size;
};

/// The first bits of a key's depth, between the nearest and the farthest one: its bin.
class DepthBins
{
public:
  /// @param largest number of bins
  DepthBins(const KeyRun& keys, std::size_t largest)
  {
    std::uint64_t nearest = keys.Begin[0], farthest = keys.Begin[0];
    for (std::size_t i = 1; i < keys.Size; ++i)
    {
      nearest = std::min(nearest, keys.Begin[i]);
      farthest = std::max(farthest, keys.Begin[i]);
    }
    this->First = static_cast<std::uint32_t>(nearest >> DepthBit);
    const std::uint32_t length = static_cast<std::uint32_t>(farthest >> DepthBit) - this->First;
    while (length >> this->Shift >= largest)
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

/// Copies keys bin by bin, with about as many bins as keys.
/// @param to other memory @param ends where each bin ends there
/// @return number of keys in the fullest bin
std::uint32_t CopyToBins(const KeyRun& keys, std::uint64_t* to, std::vector<std::uint32_t>& ends)
{
  constexpr std::size_t fewestBins = 256, mostBins = 4096;
  std::size_t count = fewestBins;
  while (count < keys.Size && count < mostBins)
  {
    count *= 2;
  }
  const DepthBins bins(keys, count);
  ends.assign(count, 0);
  for (std::size_t i = 0; i < keys.Size; ++i)
  {
    ++ends[bins(keys.Begin[i])];
  }
  std::uint32_t sum = 0, largest = 0;
  for (std::uint32_t& end : ends)
  {
    const std::uint32_t size = end;
    largest = std::max(largest, size);
    end = sum;
    sum += size;
  }
  for (std::size_t i = 0; i < keys.Size; ++i)
  {
    to[ends[bins(keys.Begin[i])]++] = keys.Begin[i];
  }
  return largest;
}

/// Calls a function with the runs of keys in crowded bins.
template <class Function>
void ForCrowded(const KeyRun& keys, const std::vector<std::uint32_t>& ends, Function&& function)
{
  std::uint32_t begin = 0;
  for (const std::uint32_t end : ends)
  {
    if (end - begin > Crowded)
    {
      function(KeyRun{ keys.Begin + begin, end - begin });
    }
    begin = end;
  }
}

void SortByComparison(const KeyRun& keys)
{
  std::sort(keys.Begin, keys.Begin + keys.Size);
}

/// Copies keys of which each is at most a few places away from its own, sorted.
void Insert(const KeyRun& keys, std::uint64_t* to)
{
  for (std::size_t i = 0; i < keys.Size; ++i)
  {
    const std::uint64_t value = keys.Begin[i];
    std::uint64_t* place = to + i;
    for (; place > to && place[-1] > value; --place)
    {
      *place = place[-1];
    }
    *place = value;
  }
}
}

void KeySorter::Sort(std::uint64_t* keys, std::size_t size)
{
  constexpr std::size_t few = 32, worthBins = 96;
  const KeyRun all{ keys, size };
  if (size < few)
  {
    SortByComparison(all);
    return;
  }
  this->Work.resize(size);
  const std::uint32_t largest = CopyToBins(all, this->Work.data(), this->Ends);
  const KeyRun binned{ this->Work.data(), size };
  if (largest > Crowded)
  {
    // Where a few keys are far off, most share few bins.
    ForCrowded(binned, this->Ends, [&](const KeyRun& crowded) {
      if (crowded.Size < worthBins)
      {
        SortByComparison(crowded);
        return;
      }
      CopyToBins(crowded, keys, this->EndsInBin);
      std::copy_n(keys, crowded.Size, crowded.Begin);
      ForCrowded(crowded, this->EndsInBin, SortByComparison);
    });
  }
  Insert(binned, keys);
}
}
