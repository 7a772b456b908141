// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Normalization/SurfelTable.h"

#include "Filters/Common/LocalCloud.h"

namespace SurfelGeometry
{
void SurfelTable::Begin(int first, int last)
{
  this->First = first;
  this->OwnCount = static_cast<unsigned int>(last - first);
  this->Entries.clear();
  this->OtherIds.clear();
  this->Slots.assign(this->Slots.size(), Slot());
  for (int id = first; id < last; ++id)
  {
    this->Append(id);
  }
}

void SurfelTable::Append(int id)
{
  const float* p = this->Problem.Cloud.Position(id);
  this->Entries.push_back({ this->Problem.KernelOf(id), Load(p) });
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
  const auto number = static_cast<std::uint16_t>(this->Entries.size());
  slot.Id = id;
  slot.Number = number;
  this->OtherIds.push_back(id);
  this->Append(id);
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
