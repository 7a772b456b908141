// SPDX-License-Identifier: BSD-3-Clause
/**
 * Makes the splats of a cloud's surfels or nodes.
 */
#pragma once

#include "Core/Splats/SetupTarget.h"
#include "Core/Splats/SplatContext.h"

#include <vector>

namespace SurfelSplatting
{
/// Prepares the inputs of the set-up that are the same for all surfels of a cloud. All threads
/// share one.
class SplatMaker
{
public:
  SplatMaker() = default;
  SplatMaker(const SplatMaker&) = delete;
  SplatMaker& operator=(const SplatMaker&) = delete;

  /// Sets the context and the cloud. The cloud must outlive the calls of Make. Memory is reused.
  /// @param target ignored if the context asks for the scalar target
  void Set(const SplatContext& context, const SurfelCloud& cloud,
    const SetupTarget& target = SelectSetupTarget());

  /// Prefetches the data of a run whose splats will be made soon.
  void Prefetch(const CutRange& run) const;

  /// Tells the cloud's guard, if it has one, that the data of a run will be needed.
  void Announce(const CutRange& run) const;

  /// Appends the visible splats of a run's surfels [skip, skip + count).
  /// @throw DamagedMemory if the cloud has a guard that finds damage
  void Make(const CutRange& run, std::size_t skip, std::size_t count, SplatOutput& output) const
  {
    if (this->Job.Cloud.Guard)
    {
      this->Check(run, skip, count);
    }
    this->Target->MakeSplats(this->Job, run, skip, count, output);
  }
  /// Appends the visible splats of a run.
  void Make(const CutRange& run, SplatOutput& output) const
  {
    this->Make(run, 0, run.Count, output);
  }

  const SurfelCloud& Cloud() const { return this->Job.Cloud; }

private:
  /// Calls function(begin, bytes) for the memory that surfels [skip, skip + count) of a run need.
  template <typename Function>
  void ForMemory(
    const CutRange& run, std::size_t skip, std::size_t count, const Function& function) const;
  void Check(const CutRange& run, std::size_t skip, std::size_t count) const;
  void SetTransforms(const View& view);
  void SetOptics(const SplatContext& context);
  void SetLights(const std::vector<Light>& lights, const Material& material);

  const SetupTarget* Target = nullptr;
  std::vector<Light> Lights;
  SetupJob Job;
};
}
