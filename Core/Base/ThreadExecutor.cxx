// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/ThreadExecutor.h"

#include <algorithm>
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
  for (unsigned int i = 1; i < this->NumberOfThreads; ++i)
  {
    threads.emplace_back([&pieces] { pieces.Run(); });
  }
  pieces.Run();
  for (std::thread& thread : threads)
  {
    thread.join();
  }
  pieces.Rethrow();
}
}
