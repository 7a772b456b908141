// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/KeySorter.h"

#include <algorithm>
#include <cstddef>

namespace SurfelSplatting
{
namespace
{
constexpr int DepthBit = 32;

/// A run of keys.
struct KeyRun
{
  std::uint64_t* Begin;
  std::size_t Size;
};

/// Two digits of a key's depth, between the nearest and the farthest one.
class DepthDigits
{
public:
  /// @param keys at least one
  explicit DepthDigits(const KeyRun& keys)
  {
    while (this->Bits < KeySorter::MostDigitBits && keys.Size >> this->Bits > 1)
    {
      ++this->Bits;
    }
    std::uint64_t nearest = keys.Begin[0], farthest = keys.Begin[0];
    for (std::size_t i = 1; i < keys.Size; ++i)
    {
      nearest = std::min(nearest, keys.Begin[i]);
      farthest = std::max(farthest, keys.Begin[i]);
    }
    this->First = static_cast<std::uint32_t>(nearest >> DepthBit);
    const std::uint32_t length = static_cast<std::uint32_t>(farthest >> DepthBit) - this->First;
    while (length >> this->Shift >> (2 * this->Bits) != 0)
    {
      ++this->Shift;
    }
  }

  std::size_t Count() const { return std::size_t{ 1 } << this->Bits; }
  std::uint32_t Both(std::uint64_t key) const
  {
    return (static_cast<std::uint32_t>(key >> DepthBit) - this->First) >> this->Shift;
  }
  std::uint32_t Low(std::uint64_t key) const
  {
    return this->Both(key) & ((std::uint32_t{ 1 } << this->Bits) - 1);
  }
  std::uint32_t High(std::uint64_t key) const { return this->Both(key) >> this->Bits; }

private:
  std::uint32_t First;
  int Bits = 8; ///< of a digit
  int Shift = 0;
};

/// Numbers become the sums of those before them.
void SumBefore(std::uint32_t* numbers, std::size_t count)
{
  std::uint32_t sum = 0;
  for (std::size_t i = 0; i < count; ++i)
  {
    const std::uint32_t number = numbers[i];
    numbers[i] = sum;
    sum += number;
  }
}

/// Sorts keys that are in the order of their digits. Most are alone with theirs. Where others are
/// far away, or surfaces face the camera, many share them.
void SortEqualDigits(const KeyRun& keys, const DepthDigits& digits)
{
  constexpr std::ptrdiff_t crowded = 16;
  std::uint64_t* const end = keys.Begin + keys.Size;
  for (std::uint64_t* next = keys.Begin + 1; next < end; ++next)
  {
    const std::uint64_t value = *next;
    std::uint64_t* place = next;
    for (; place > keys.Begin && place[-1] > value && next - place < crowded; --place)
    {
      *place = place[-1];
    }
    *place = value;
    if (next - place == crowded)
    {
      const std::uint32_t own = digits.Both(value);
      std::uint64_t* first = place;
      std::uint64_t* last = next + 1;
      for (; first > keys.Begin && digits.Both(first[-1]) == own; --first)
      {
      }
      for (; last < end && digits.Both(*last) == own; ++last)
      {
      }
      std::sort(first, last);
      next = last - 1;
    }
  }
}
}

void KeySorter::Sort(std::uint64_t* keys, std::size_t size)
{
  constexpr std::size_t few = 32;
  if (size < few)
  {
    std::sort(keys, keys + size);
    return;
  }
  const KeyRun all{ keys, size };
  const DepthDigits digits(all);
  std::uint32_t* const low = this->Ends.data();
  std::uint32_t* const high = low + digits.Count();
  std::fill_n(low, 2 * digits.Count(), 0u);
  for (std::size_t i = 0; i < size; ++i)
  {
    ++low[digits.Low(keys[i])];
    ++high[digits.High(keys[i])];
  }
  SumBefore(low, digits.Count());
  SumBefore(high, digits.Count());
  this->Work.resize(size);
  for (std::size_t i = 0; i < size; ++i)
  {
    this->Work[low[digits.Low(keys[i])]++] = keys[i];
  }
  for (const std::uint64_t key : this->Work)
  {
    keys[high[digits.High(key)]++] = key;
  }
  SortEqualDigits(all, digits);
}
}
