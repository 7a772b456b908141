// SPDX-License-Identifier: BSD-3-Clause
/**
 * Runs the core's loops on the threads of vtkSMPTools. Internal to the module.
 */
#pragma once

#include "Core/Base/Executor.h"

#include <vtkSMPTools.h>
#include <vtkType.h>

#include <algorithm>
#include <cstddef>

namespace SurfelSplatting
{
class SMPExecutor : public Executor
{
public:
  void For(std::size_t size, std::size_t grain, const RangeFunction& function) const override
  {
    LoopPieces pieces(size, grain, function);
    const auto threads = static_cast<std::size_t>(vtkSMPTools::GetEstimatedNumberOfThreads());
    // VTK's own pieces cost microseconds each, and some backends deal them out beforehand.
    vtkSMPTools::For(0, static_cast<vtkIdType>(std::min(threads, pieces.Count())), 1,
      [&pieces](vtkIdType, vtkIdType) { pieces.Run(); });
    pieces.Rethrow();
  }
};
}
