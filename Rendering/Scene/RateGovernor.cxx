// SPDX-License-Identifier: BSD-3-Clause
#include "Rendering/Scene/RateGovernor.h"

#include <algorithm>
#include <cmath>

namespace SurfelSplatting
{
namespace
{
/// A larger coarsening is useful if it reduces the load to at most this factor.
constexpr double MaxLoadRatio = 0.93;
}

void RateGovernor::AddInteractiveFrame(double load, double coarsening, bool hasProps)
{
  if (load > 1.0 && coarsening > this->LastCoarsening && this->LastLoad > 0.0 &&
    load > MaxLoadRatio * this->LastLoad && hasProps)
  {
    this->LargestUseful = this->LastCoarsening;
  }
  this->LastCoarsening = coarsening;
  this->LastLoad = load;
  if (load > 1.0)
  {
    this->Next = std::min(this->LargestUseful, coarsening * std::min(2.0, std::pow(load, 0.7)));
  }
  else if (load < 0.7)
  {
    this->Next = std::max(1.0, coarsening * std::max(0.7, std::sqrt(load / 0.85)));
  }
}

void RateGovernor::AddStillFrame()
{
  this->LargestUseful = MaxCoarsening;
  this->LastLoad = 0.0;
}
}
