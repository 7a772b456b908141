// SPDX-License-Identifier: BSD-3-Clause
/**
 * Parallel loops that report progress, and stop on an abort.
 */
#pragma once

#include "Filters/Common/ParallelFor.h"

#include <algorithm>

class vtkAlgorithm;

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

  /// Reports the finished fraction of the stage. Returns false on an abort. VTKCalls.cxx has it.
  bool Step(double fraction) const;

private:
  vtkAlgorithm* Algorithm; // null: no reports
  double From;
  double To;
};

/// Calls body(begin, end) over [0, count) in parallel. Between blocks, the calling thread reports
/// progress and checks for an abort. Returns false if stopped.
template <typename Body>
bool ParallelFor(vtkIdType count, const StageProgress& progress, const Body& body)
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
