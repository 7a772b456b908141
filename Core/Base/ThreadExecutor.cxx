// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/ThreadExecutor.h"

#include <algorithm>
#include <atomic>
#include <thread>
#include <vector>

namespace SurfelSplatting
{
ThreadExecutor::ThreadExecutor(unsigned int numberOfThreads)
  : NumberOfThreads(std::max(1u, numberOfThreads))
{
}

void ThreadExecutor::For(std::size_t size, std::size_t grain, const RangeFunction& function) const
{
  std::atomic<std::size_t> next{ 0 };
  ExceptionCarrier carrier;
  auto work = [&]() {
    for (std::size_t begin = next.fetch_add(grain); begin < size; begin = next.fetch_add(grain))
    {
      carrier.Run([&]() { function(begin, std::min(size, begin + grain)); });
    }
  };
  std::vector<std::thread> threads;
  for (unsigned int i = 1; i < this->NumberOfThreads; ++i)
  {
    threads.emplace_back(work);
  }
  work();
  for (std::thread& thread : threads)
  {
    thread.join();
  }
  carrier.Rethrow();
}
}
