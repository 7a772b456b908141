// SPDX-License-Identifier: BSD-3-Clause
#include "Rendering/Scene/RateGovernor.h"

#include <algorithm>
#include <cmath>

namespace SurfelSplatting
{
namespace
{
constexpr double StepsPerOctave = 4.0;
constexpr int LastStep = 16; // MaxCoarsening

/// Frames per decision. Their least load counts: a busy machine makes single frames slower, never
/// faster.
constexpr int FramesPerDecision = 2;

/// Between the loads up to which finer and from which on coarser frames are tried, nothing changes.
constexpr double FullLoad = 1.0, TooMuchLoad = 1.1;

/// A coarser frame saves time if it reduces the load to at most this factor; its step is at least
/// the square root of two, with which the number of nodes halves.
constexpr double SavingRatio = 0.93;
constexpr int SmallestStepUp = 2, LargestStepUp = 4;

/// A finer frame takes no more time if it increases the load to at most this factor.
constexpr double SameRatio = 1.05;

/// A load that has changed by this factor is that of another view.
constexpr double ChangedRatio = 1.5;

/// Steps to the coarsening with which a load above 1 is likely to be 1: other work than that for
/// nodes, whose number falls with the square, stays.
int StepsUp(double load)
{
  const double steps = std::round(StepsPerOctave * 0.7 * std::log2(load));
  return static_cast<int>(std::clamp<double>(steps, SmallestStepUp, LargestStepUp));
}

/// Steps that surely keep a load below 1, since the number of nodes grows with the square; at least
/// one, which may turn out to be too much.
int StepsDown(double load)
{
  const double steps = std::floor(-0.5 * StepsPerOctave * std::log2(std::fmax(load, 1e-3)));
  return static_cast<int>(std::fmax(1.0, steps));
}
}

double RateGovernor::Coarsening() const
{
  return std::exp2(this->Step / StepsPerOctave);
}

void RateGovernor::AddInteractiveFrame(double load, double coarsening)
{
  if (coarsening != this->Coarsening())
  {
    return;
  }
  this->Least = this->Frames > 0 ? std::fmin(this->Least, load) : load;
  ++this->Frames;
  if (this->Frames == FramesPerDecision)
  {
    this->Frames = 0;
    this->Decide(this->Least);
  }
}

void RateGovernor::Decide(double load)
{
  if (this->HasFailed(load))
  {
    (this->Running == Trial::Coarser ? this->CoarserFailed : this->FinerFailed) = true;
    this->SettledLoad = this->LoadBefore;
    this->Step = this->StepBefore;
    this->Running = Trial::None;
    return;
  }
  if (load > ChangedRatio * this->SettledLoad || load * ChangedRatio < this->SettledLoad)
  {
    this->CoarserFailed = this->FinerFailed = false;
  }
  // A row of finer steps is compared with the time before the first of them.
  const bool inRow = this->Running == Trial::Finer && load > FullLoad;
  const double reference = inRow ? this->LoadBefore : load;
  this->Running = Trial::None;
  const bool canBeCoarser = !this->CoarserFailed && this->Step < LastStep;
  if (load > TooMuchLoad && canBeCoarser)
  {
    this->Begin(Trial::Coarser, this->Step + StepsUp(load), load);
  }
  else if (this->Step > 0 && !this->FinerFailed && (load <= FullLoad || !canBeCoarser))
  {
    this->Begin(Trial::Finer, this->Step - StepsDown(load), reference);
  }
}

/// Whether the running trial has had no use.
bool RateGovernor::HasFailed(double load) const
{
  switch (this->Running)
  {
    case Trial::Coarser:
      return load > SavingRatio * this->LoadBefore;
    case Trial::Finer:
      return load > FullLoad && load > SameRatio * this->LoadBefore;
    default:
      return false;
  }
}

void RateGovernor::Begin(Trial trial, int step, double load)
{
  this->Running = trial;
  this->StepBefore = this->Step;
  this->LoadBefore = load;
  this->Step = std::clamp(step, 0, LastStep);
}

void RateGovernor::AddStillFrame()
{
  this->CoarserFailed = this->FinerFailed = false;
  this->Running = Trial::None;
  this->Frames = 0;
}
}
