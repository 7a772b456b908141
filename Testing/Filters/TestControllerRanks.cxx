// SPDX-License-Identifier: BSD-3-Clause
/**
 * A rank that lacks memory for a message, or for anything: all ranks throw, and none waits for it.
 * The program's own operator new refuses what is too large for a thread.
 */
#include "Core/Picture/SplatExchange.h"
#include "Parallel/ControllerRanks.h"
#include "ThreadController.h"

#include <doctest/doctest.h>

#include <atomic>
#include <cstdlib>
#include <limits>
#include <new>

namespace
{
constexpr std::size_t Unlimited = std::numeric_limits<std::size_t>::max();
thread_local std::size_t Largest = Unlimited; // bytes that this thread gets at once
}

void* operator new(std::size_t size)
{
  void* memory = size <= Largest ? std::malloc(size > 0 ? size : 1) : nullptr;
  if (!memory)
  {
    throw std::bad_alloc();
  }
  return memory;
}
void operator delete(void* memory) noexcept
{
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept
{
  std::free(memory);
}

using namespace SurfelSplatting;

namespace
{
constexpr std::size_t Long = 100'000;

/// How many of three ranks throw RanksLackMemory if one gets not more than so much at once.
template <typename Function>
int CountThrows(std::size_t largest, const Function& function)
{
  std::atomic<int> thrown{ 0 };
  SurfelTesting::ThreadController::Run(3, [&](vtkMultiProcessController* controller) {
    ControllerRanks ranks(controller);
    try
    {
      function(ranks, ranks.Rank() == 1 ? largest : Unlimited);
    }
    catch (const RanksLackMemory&)
    {
      ++thrown;
    }
    Largest = Unlimited;
    CHECK(ranks.All(true)); // they are at the same place
  });
  return thrown;
}

/// Each rank gets a long message from each.
void Exchange(Ranks& ranks, std::size_t largest)
{
  std::vector<Message> messages(3, Message(Long, static_cast<unsigned char>(ranks.Rank())));
  Largest = largest;
  const std::vector<Message> received = ranks.Exchange(std::move(messages));
  for (std::size_t sender = 0; sender < 3; ++sender)
  {
    CHECK(received[sender] == Message(Long, static_cast<unsigned char>(sender)));
  }
}

TEST_CASE("No memory for a message")
{
  CHECK(CountThrows(Unlimited, Exchange) == 0);
  CHECK(CountThrows(Long / 2, Exchange) == 3);
}

/// The root has memory for a message, but not for one to each rank.
TEST_CASE("No memory for copies of a message")
{
  const auto share = [](Ranks& ranks, std::size_t largest) {
    const Message own(Long, 1);
    Largest = largest;
    ranks.Share([&] { return own; });
  };
  CHECK(CountThrows(Unlimited, share) == 0);
  CHECK(CountThrows(Long / 2, share) == 3);
}

/// A rank has no memory for the message that it is to make.
TEST_CASE("No memory to make a message")
{
  const auto make = [] { return Message(Long, 1); };
  const auto toRoot = [&](Ranks& ranks, std::size_t largest) {
    Largest = largest;
    const std::vector<Message> received = ranks.ToRoot(make);
    CHECK(received.size() == (ranks.IsRoot() ? 3 : 0));
  };
  CHECK(CountThrows(Unlimited, toRoot) == 0);
  CHECK(CountThrows(Long / 2, toRoot) == 3);
  const auto shareLargest = [](Ranks& ranks, std::size_t largest) {
    std::vector<float> values(Long, static_cast<float>(ranks.Rank()));
    Largest = largest;
    SplatExchange(ranks).ShareLargest(values);
    CHECK(values == std::vector<float>(Long, 2.0f));
  };
  CHECK(CountThrows(Unlimited, shareLargest) == 0);
  CHECK(CountThrows(Long, shareLargest) == 3);
}
}
