// SPDX-License-Identifier: BSD-3-Clause
/**
 * The surfels that a block of surfels reads, by numbers of 16 bits: its own ones first, then others
 * near them. Their kernels lie together in memory.
 */
#pragma once

#include "Filters/Normalization/WeightProblem.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace SurfelGeometry
{
class SurfelTable
{
public:
  /// Largest number of surfels in a table.
  static constexpr int Capacity = 1 << 16;

  struct Entry
  {
    WeightedKernel Kernel;
    Float3 Position; // relative to the cloud's origin
    float Reach;     // distance at which the kernel has ended, world units
  };

  explicit SurfelTable(const WeightProblem& problem)
    : Problem(problem)
    , Slots(1024)
  {
  }

  /// Begins a block with its own surfels, from `first` to `last`.
  void Begin(int first, int last);

  /// The number of a surfel, which gets one if it has none. Call before Load().
  std::uint16_t NumberOf(int id)
  {
    const unsigned int own = static_cast<unsigned int>(id) - static_cast<unsigned int>(this->First);
    return own < this->OwnCount ? static_cast<std::uint16_t>(own) : this->NumberOfOther(id);
  }

  /// Loads the entries of all surfels that have numbers.
  void Load();

  const Entry& operator[](std::size_t number) const { return this->Entries[number]; }

  /// Ids of the surfels that are not the block's own, in the order of their numbers.
  const std::vector<int>& Others() const { return this->OtherIds; }

private:
  static constexpr int Free = -1;

  struct Slot
  {
    int Id = Free;
    std::uint16_t Number = 0;
  };

  std::uint16_t NumberOfOther(int id);
  Slot& FindSlot(int id);
  void Grow();

  const WeightProblem& Problem;
  int First = 0;
  unsigned int OwnCount = 0;
  std::vector<Entry> Entries;
  std::vector<int> OtherIds;
  std::vector<Slot> Slots; // hash table of the others; a power of two, at most half full
};
}
