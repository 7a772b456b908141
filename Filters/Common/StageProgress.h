// SPDX-License-Identifier: BSD-3-Clause
/**
 * Parallel loops that report progress, and stop on an abort.
 */
#pragma once

#include "Filters/Common/ParallelFor.h"

#include "vtkAlgorithm.h"
#include "vtkVersionMacros.h"

#include <algorithm>

namespace SurfelGeometry
{
/// Progress of one stage of a filter: 0..1 of the stage are From..To of the filter.
class StageProgress
{
public:
  StageProgress(vtkAlgorithm* algorithm, double from, double to)
    : Algorithm(algorithm)
    , From(from)
    , To(to)
  {
  }

  /// The progress of a part of this stage.
  StageProgress Part(double from, double to) const
  {
    const double length = this->To - this->From;
    return StageProgress(this->Algorithm, this->From + from * length, this->From + to * length);
  }

  /// Reports the finished fraction of the stage. Returns false on an abort.
  bool Step(double fraction) const
  {
    if (!this->Algorithm)
    {
      return true;
    }
    this->Algorithm->UpdateProgress(this->From + fraction * (this->To - this->From));
#if VTK_MAJOR_VERSION > 9 || (VTK_MAJOR_VERSION == 9 && VTK_MINOR_VERSION >= 3)
    return !this->Algorithm->CheckAbort();
#else
    return !this->Algorithm->GetAbortExecute();
#endif
  }

private:
  vtkAlgorithm* Algorithm; // null: no reports
  double From;
  double To;
};

/// Calls body(begin, end) over [0, count) in parallel. Between blocks, the calling thread reports
/// progress and checks for an abort. Returns false if stopped.
template <typename Body>
bool ParallelFor(vtkIdType count, const StageProgress& progress, Body&& body)
{
  constexpr vtkIdType block = 1 << 18; // a tenth of a second or two
  constexpr vtkIdType grain = 1 << 10;
  for (vtkIdType begin = 0; begin < count; begin += block)
  {
    const vtkIdType end = std::min(count, begin + block);
    ParallelFor(begin, end, grain, body);
    if (!progress.Step(static_cast<double>(end) / static_cast<double>(count)))
    {
      return false;
    }
  }
  return true;
}
}
