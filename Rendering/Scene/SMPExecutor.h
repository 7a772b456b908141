// SPDX-License-Identifier: BSD-3-Clause
/**
 * Runs the core's loops on the threads of vtkSMPTools. Internal to the module.
 */
#pragma once

#include "Core/Base/Executor.h"

#include <vtkSMPTools.h>
#include <vtkType.h>

#include <cstddef>

namespace SurfelSplatting
{
class SMPExecutor : public Executor
{
public:
  void For(std::size_t size, std::size_t grain, const RangeFunction& function) const override
  {
    ExceptionCarrier carrier;
    vtkSMPTools::For(0, static_cast<vtkIdType>(size), static_cast<vtkIdType>(grain),
      [&](vtkIdType begin, vtkIdType end) {
        carrier.Run(
          [&]() { function(static_cast<std::size_t>(begin), static_cast<std::size_t>(end)); });
      });
    carrier.Rethrow();
  }
};
}
