// SPDX-License-Identifier: BSD-3-Clause
/**
 * Loops on the threads of vtkSMPTools that may fail: what a thread throws reaches the caller, whose
 * filter says it. Out of a thread of VTK's it would end the process.
 */
#pragma once

#include "Core/Base/Executor.h"

#include "vtkSMPTools.h"
#include "vtkType.h"

namespace SurfelGeometry
{
/// Calls body(begin, end) over [first, last) in pieces of about grain elements; 0: VTK decides.
/// @throw what one of the calls has thrown, when all have ended
template <typename Body>
void ParallelFor(vtkIdType first, vtkIdType last, vtkIdType grain, Body&& body)
{
  SurfelSplatting::ExceptionCarrier carrier;
  vtkSMPTools::For(first, last, grain,
    [&](vtkIdType begin, vtkIdType end) { carrier.Run([&] { body(begin, end); }); });
  carrier.Rethrow();
}

template <typename Body>
void ParallelFor(vtkIdType first, vtkIdType last, Body&& body)
{
  ParallelFor(first, last, 0, body);
}
}
