// SPDX-License-Identifier: BSD-3-Clause
/**
 * Loops on the threads of vtkSMPTools that may fail: what a thread throws reaches the caller, whose
 * filter says it. Out of a thread of VTK's it would end the process.
 */
#pragma once

#include "Core/Base/Executor.h"
#include "Filters/Common/IdType.h"

#include <cstddef>

namespace SurfelGeometry
{
/// Calls body(begin, end) over [first, last), which are not negative, in pieces of about grain
/// elements; 0: VTK decides. VTKCalls.cxx has it.
/// @throw what one of the calls has thrown, when all have ended
void RunLoop(
  vtkIdType first, vtkIdType last, vtkIdType grain, const SurfelSplatting::RangeFunction& body);

template <typename Body>
void ParallelFor(vtkIdType first, vtkIdType last, vtkIdType grain, const Body& body)
{
  RunLoop(first, last, grain, [&body](std::size_t begin, std::size_t end) {
    body(static_cast<vtkIdType>(begin), static_cast<vtkIdType>(end));
  });
}

template <typename Body>
void ParallelFor(vtkIdType first, vtkIdType last, const Body& body)
{
  ParallelFor(first, last, 0, body);
}
}
