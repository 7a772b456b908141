// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/ThreadExecutor.h"

#include <algorithm>
#include <exception>
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
  LoopPieces pieces(size, grain, function);
  std::vector<std::thread> threads;
  threads.reserve(this->NumberOfThreads - 1);
  try
  {
    for (unsigned int i = 1; i < this->NumberOfThreads; ++i)
    {
      threads.emplace_back([&pieces] { pieces.Run(); });
    }
  }
  catch (const std::exception&)
  {
    // The system starts no more threads; those that run do the work.
  }
  pieces.Run();
  for (std::thread& thread : threads)
  {
    thread.join();
  }
  pieces.Rethrow();
}
}
