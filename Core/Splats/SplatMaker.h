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
/// Prepares for the set-up what is the same for all of a cloud's surfels. One for all threads.
class SplatMaker
{
public:
  SplatMaker() = default;
  SplatMaker(const SplatMaker&) = delete;
  SplatMaker& operator=(const SplatMaker&) = delete;

  /// What it makes splats of. The cloud must outlive that; memory is kept.
  /// @param target not used where the context asks for the scalar one
  void Set(const SplatContext& context, const SurfelCloud& cloud,
    const SetupTarget& target = SelectSetupTarget());

  /// Asks for the memory of surfels that will be made soon.
  void Prefetch(std::size_t begin, std::size_t count, int level) const;

  /// Appends the visible splats of surfels [begin, begin + count), all of one level.
  void Make(std::size_t begin, std::size_t count, int level, SplatOutput& output) const
  {
    this->Target->MakeSplats(this->Job, begin, count, level, output);
  }

private:
  void SetTransforms(const View& view);
  void SetOptics(const SplatContext& context);
  void SetLights(const std::vector<Light>& lights, const Material& material);

  const SetupTarget* Target = nullptr;
  std::vector<ShadingLight> Lights;
  SetupJob Job;
};
}
