// SPDX-License-Identifier: BSD-3-Clause
/**
 * Runs the core's loops on vtkSMPTools' threads, with a filter's progress and abort.
 */
#pragma once

#include "Core/Base/Executor.h"
#include "Filters/Common/StageProgress.h"
#include "SurfelData/SMPExecutor.h"

#include <algorithm>

namespace SurfelGeometry
{
/**
 * Runs the loops of one stage of a filter. Their number is unknown, so each one advances the
 * progress by a share of what is left. After an abort all further loops do nothing: the results are
 * then useless, but no access is out of bounds.
 */
class ProgressExecutor : public SurfelSplatting::Executor
{
public:
  explicit ProgressExecutor(const StageProgress& progress)
    : Progress(progress)
  {
  }

  bool Stopped() const { return this->WasStopped; }

  void For(std::size_t size, std::size_t grain, const RangeFunction& function) const override
  {
    const std::size_t slice = std::max(grain, (size + Slices - 1) / Slices);
    for (std::size_t begin = 0; begin < size && !this->WasStopped; begin += slice)
    {
      SurfelSplatting::SMPExecutor().For(std::min(slice, size - begin), grain,
        [&](std::size_t first, std::size_t last) { function(begin + first, begin + last); });
      this->Done += Share * (1.0 - this->Done);
      this->WasStopped = !this->Progress.Step(this->Done);
    }
  }

private:
  static constexpr std::size_t Slices = 8;
  static constexpr double Share = 0.02;
  StageProgress Progress;
  mutable double Done = 0.0;
  mutable bool WasStopped = false;
};
}
