// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Ranks.h"

#include "Core/Base/MemoryGuard.h"

#include <algorithm>
#include <exception>

namespace SurfelSplatting
{
std::vector<Message> Ranks::Share(const Packing& pack)
{
  std::vector<Message> messages;
  this->DoOwn([&] { messages.assign(static_cast<std::size_t>(this->Size()), pack()); });
  return this->Exchange(std::move(messages));
}

Message Ranks::FromRoot(const Packing& pack)
{
  return this->Share([&] { return this->IsRoot() ? pack() : Message(); })[0];
}

std::vector<Message> Ranks::ToRoot(const Packing& pack)
{
  std::vector<Message> messages;
  this->DoOwn([&] {
    messages.resize(static_cast<std::size_t>(this->Size()));
    messages[0] = pack();
  });
  messages = this->Exchange(std::move(messages));
  if (!this->IsRoot())
  {
    messages.clear();
  }
  return messages;
}

double Ranks::Largest(double value)
{
  double largest = value;
  for (const Message& m : this->Share([&] { return MessageOf(value); }))
  {
    largest = std::max(largest, MessageReader(m).Get<double>());
  }
  return largest;
}

void Ranks::DoOwn(const std::function<void()>& work)
{
  bool hasMemory = true;
  std::exception_ptr damage;
  try
  {
    work();
  }
  catch (const std::bad_alloc&)
  {
    hasMemory = false;
  }
  catch (const DamagedMemory&)
  {
    damage = std::current_exception();
  }
  if (this->All(hasMemory && !damage))
  {
    return;
  }
  if (this->Any(!hasMemory))
  {
    throw RanksLackMemory();
  }
  if (damage)
  {
    std::rethrow_exception(damage);
  }
  throw DamagedMemory("the file of another process is damaged; see what that says");
}

void Ranks::DoTogether(const std::function<void()>& work)
{
  bool hasMemory = true;
  try
  {
    work();
  }
  catch (const RanksLackMemory&)
  {
    throw; // all ranks do
  }
  catch (const std::bad_alloc&)
  {
    hasMemory = false;
  }
  // The others meet this call at their next one of the kind, or here.
  this->DoOwn([&] {
    if (!hasMemory)
    {
      throw std::bad_alloc();
    }
  });
}

double Ranks::RootValue(double value)
{
  return MessageReader(this->FromRoot([&] { return MessageOf(value); })).Get<double>();
}
}
