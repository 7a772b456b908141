// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Normalization/SurfelTable.h"

#include "Filters/Neighbors/LocalCloud.h"

#include <algorithm>
#include <cmath>

namespace SurfelGeometry
{
namespace
{
/// Kernels are in the order of the input, which may be any: so many are being loaded at a time.
constexpr std::size_t SurfelsAhead = 16;
}

void SurfelTable::Begin(int first, int last)
{
  this->First = first;
  this->OwnCount = static_cast<unsigned int>(last - first);
  this->OtherIds.clear();
  this->Slots.assign(this->Slots.size(), Slot());
}

void SurfelTable::Load()
{
  const std::size_t count = this->OwnCount + this->OtherIds.size();
  const auto idOf = [this](std::size_t number) {
    return number < this->OwnCount ? this->First + static_cast<int>(number)
                                   : this->OtherIds[number - this->OwnCount];
  };
  // Along the surface a kernel ends where its exponent reaches the support, across it at the
  // offset; the rest is for rounding.
  const auto farthest = static_cast<float>(2.0002 * this->Problem.Settings.Support);
  const auto offset = static_cast<float>(this->Problem.Settings.NormalOffset);
  this->Entries.resize(count);
  for (std::size_t number = 0; number < std::min(count, SurfelsAhead); ++number)
  {
    this->Problem.Kernels.Prefetch(idOf(number));
  }
  for (std::size_t number = 0; number < count; ++number)
  {
    if (number + SurfelsAhead < count)
    {
      this->Problem.Kernels.Prefetch(idOf(number + SurfelsAhead));
    }
    const int id = idOf(number);
    Entry& entry = this->Entries[number];
    entry.Kernel = this->Problem.Kernels.Make(id);
    entry.Position = SurfelGeometry::Load(this->Problem.Cloud.Position(id));
    const float climb = offset * entry.Kernel.Sigma;
    entry.Reach = std::sqrt(farthest * entry.Kernel.LargestVariance + climb * climb);
  }
}

SurfelTable::Slot& SurfelTable::FindSlot(int id)
{
  constexpr std::uint64_t golden = 0x9e3779b97f4a7c15ull; // Fibonacci hashing
  const std::size_t mask = this->Slots.size() - 1;
  std::size_t at = (static_cast<std::uint64_t>(id) * golden >> 32) & mask;
  while (this->Slots[at].Id != id && this->Slots[at].Id != Free)
  {
    at = (at + 1) & mask;
  }
  return this->Slots[at];
}

std::uint16_t SurfelTable::NumberOfOther(int id)
{
  Slot& slot = this->FindSlot(id);
  if (slot.Id == id)
  {
    return slot.Number;
  }
  const auto number = static_cast<std::uint16_t>(this->OwnCount + this->OtherIds.size());
  slot.Id = id;
  slot.Number = number;
  this->OtherIds.push_back(id);
  if (2 * this->OtherIds.size() > this->Slots.size())
  {
    this->Grow();
  }
  return number;
}

void SurfelTable::Grow()
{
  this->Slots.assign(2 * this->Slots.size(), Slot());
  for (std::size_t k = 0; k < this->OtherIds.size(); ++k)
  {
    Slot& slot = this->FindSlot(this->OtherIds[k]);
    slot.Id = this->OtherIds[k];
    slot.Number = static_cast<std::uint16_t>(this->OwnCount + k);
  }
}
}
