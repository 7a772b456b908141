// SPDX-License-Identifier: BSD-3-Clause
#include "Parallel/ControllerRanks.h"

#include "vtkMultiProcessController.h"

#include <algorithm>
#include <cstdint>
#include <new>
#include <stdexcept>

namespace SurfelSplatting
{
namespace
{
/// Tags that no other messages use.
constexpr int ValueTag = 52601, DataTag = 52602;

/// MPI counts are ints.
constexpr std::size_t MaxPiece = std::size_t{ 1 } << 29;

/// Throws if a message has failed: the ranks are then at different places and cannot go on
/// together.
void Check(int succeeded)
{
  if (!succeeded)
  {
    throw std::runtime_error(
      "A message between the processes of the vtkMultiProcessController has failed.");
  }
}

template <typename Function>
bool HasMemory(const Function& function)
{
  try
  {
    function();
    return true;
  }
  catch (const std::bad_alloc&)
  {
    return false;
  }
}
}

int ControllerRanks::Size() const
{
  return this->Controller->GetNumberOfProcesses();
}

int ControllerRanks::Rank() const
{
  return this->Controller->GetLocalProcessId();
}

/// In each round every rank has one partner, which may be itself.
template <typename Function>
void ControllerRanks::ForPartners(Function&& function) const
{
  const int size = this->Size(), rank = this->Rank();
  for (int round = 0; round < size; ++round)
  {
    function(((round - rank) % size + size) % size);
  }
}

/// The lower rank sends first.
template <typename SendFunction, typename ReceiveFunction>
void ControllerRanks::TakeTurns(int partner, SendFunction&& send, ReceiveFunction&& receive) const
{
  if (this->Rank() < partner)
  {
    send();
    receive();
  }
  else
  {
    receive();
    send();
  }
}

template <typename T>
T ControllerRanks::Swap(const T& own, int partner) const
{
  T other{};
  const vtkIdType size = sizeof(T);
  this->TakeTurns(
    partner,
    [&] {
      Check(this->Controller->Send(
        reinterpret_cast<const unsigned char*>(&own), size, partner, ValueTag));
    },
    [&] {
      Check(this->Controller->Receive(
        reinterpret_cast<unsigned char*>(&other), size, partner, ValueTag));
    });
  return other;
}

bool ControllerRanks::All(bool value)
{
  bool all = value;
  this->ForPartners([&](int partner) {
    if (partner != this->Rank())
    {
      all = this->Swap(static_cast<unsigned char>(value ? 1 : 0), partner) != 0 && all;
    }
  });
  return all;
}

void ControllerRanks::SwapMessages(const Message& out, Message& in, int partner) const
{
  const auto forPieces = [](std::size_t size, const auto& function) {
    for (std::size_t at = 0; at < size; at += MaxPiece)
    {
      function(at, static_cast<vtkIdType>(std::min(MaxPiece, size - at)));
    }
  };
  this->TakeTurns(
    partner,
    [&] {
      forPieces(out.size(), [&](std::size_t at, vtkIdType size) {
        Check(this->Controller->Send(out.data() + at, size, partner, DataTag));
      });
    },
    [&] {
      forPieces(in.size(), [&](std::size_t at, vtkIdType size) {
        Check(this->Controller->Receive(in.data() + at, size, partner, DataTag));
      });
    });
}

/// Two partners send nothing if one of them has no memory for what it receives. All rounds take
/// place, so that nobody waits.
std::vector<Message> ControllerRanks::Exchange(std::vector<Message> messages)
{
  std::vector<Message> received;
  bool hasMemory = HasMemory([&] { received.resize(messages.size()); });
  this->ForPartners([&](int partner) {
    Message& out = messages[static_cast<std::size_t>(partner)];
    Message own; // what this rank receives
    if (partner == this->Rank())
    {
      own = std::move(out);
    }
    else
    {
      const std::uint64_t size = this->Swap(std::uint64_t{ out.size() }, partner);
      hasMemory = hasMemory && HasMemory([&] { own.resize(static_cast<std::size_t>(size)); });
      const bool partnerHas = this->Swap(static_cast<unsigned char>(hasMemory), partner) != 0;
      if (hasMemory && partnerHas)
      {
        this->SwapMessages(out, own, partner);
      }
      Message().swap(out);
    }
    if (hasMemory)
    {
      received[static_cast<std::size_t>(partner)] = std::move(own);
    }
  });
  if (!this->All(hasMemory))
  {
    throw RanksLackMemory();
  }
  return received;
}
}
