// SPDX-License-Identifier: BSD-3-Clause
#include "Parallel/ControllerRanks.h"

#include "vtkMultiProcessController.h"

#include <algorithm>
#include <cstdint>
#include <stdexcept>

namespace SurfelSplatting
{
namespace
{
/// Tags that no other messages use.
constexpr int SizeTag = 52601, DataTag = 52602;

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
}

int ControllerRanks::Size() const
{
  return this->Controller->GetNumberOfProcesses();
}

int ControllerRanks::Rank() const
{
  return this->Controller->GetLocalProcessId();
}

void ControllerRanks::Send(const Message& message, int to)
{
  const std::uint64_t size = message.size();
  Check(this->Controller->Send(
    reinterpret_cast<const unsigned char*>(&size), vtkIdType{ sizeof(size) }, to, SizeTag));
  for (std::size_t at = 0; at < message.size(); at += MaxPiece)
  {
    const std::size_t piece = std::min(MaxPiece, message.size() - at);
    Check(this->Controller->Send(message.data() + at, static_cast<vtkIdType>(piece), to, DataTag));
  }
}

void ControllerRanks::Receive(Message& message, int from)
{
  std::uint64_t size = 0;
  Check(this->Controller->Receive(
    reinterpret_cast<unsigned char*>(&size), vtkIdType{ sizeof(size) }, from, SizeTag));
  message.resize(static_cast<std::size_t>(size));
  for (std::size_t at = 0; at < message.size(); at += MaxPiece)
  {
    const std::size_t piece = std::min(MaxPiece, message.size() - at);
    Check(
      this->Controller->Receive(message.data() + at, static_cast<vtkIdType>(piece), from, DataTag));
  }
}

/// In each round every rank has one partner, which may be itself; the lower rank sends first.
std::vector<Message> ControllerRanks::Exchange(std::vector<Message> messages)
{
  const int size = this->Size(), rank = this->Rank();
  std::vector<Message> received(messages.size());
  for (int round = 0; round < size; ++round)
  {
    const int partner = ((round - rank) % size + size) % size;
    Message& out = messages[static_cast<std::size_t>(partner)];
    Message& in = received[static_cast<std::size_t>(partner)];
    if (partner == rank)
    {
      in = std::move(out);
    }
    else if (rank < partner)
    {
      this->Send(out, partner);
      this->Receive(in, partner);
    }
    else
    {
      this->Receive(in, partner);
      this->Send(out, partner);
    }
    Message().swap(out);
  }
  return received;
}
}
