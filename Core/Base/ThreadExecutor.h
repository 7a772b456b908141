// SPDX-License-Identifier: BSD-3-Clause
/**
 * An executor on threads of the standard library, which it starts for each call; on fewer if the
 * system does not start as many.
 */
#pragma once

#include "Core/Base/Executor.h"

namespace SurfelSplatting
{
class ThreadExecutor : public Executor
{
public:
  explicit ThreadExecutor(unsigned int numberOfThreads);
  void For(std::size_t size, std::size_t grain, const RangeFunction& function) const override;

private:
  unsigned int NumberOfThreads;
};
}
