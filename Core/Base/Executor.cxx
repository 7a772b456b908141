// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Executor.h"

#include <algorithm>

namespace SurfelSplatting
{
void SerialExecutor::For(std::size_t size, std::size_t grain, const RangeFunction& function) const
{
  for (std::size_t begin = 0; begin < size; begin += grain)
  {
    function(begin, std::min(size, begin + grain));
  }
}
}
