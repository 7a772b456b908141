// SPDX-License-Identifier: BSD-3-Clause
/**
 * Makes the splats of a cloud's surfels or nodes, as many at a time as the processor can.
 */
#pragma once

#include "Core/Splats/SetupTarget.h"
#include "Core/Splats/SplatSetup.h"

#include <optional>
#include <vector>

namespace SurfelSplatting
{
/// Takes the set-up kernel where it knows all that the frame needs, and MakeSplat for the rest: the
/// paper's rule of detail, colours by level, spot lights. One for all threads.
class SplatMaker
{
public:
  SplatMaker() = default;
  SplatMaker(const SplatMaker&) = delete;
  SplatMaker& operator=(const SplatMaker&) = delete;

  /// What it makes splats of, both of which must outlive that; keeps its memory.
  void Set(const SplatContext& context, const SurfelCloud& cloud,
    const SetupTarget& kernel = SelectSetupTarget());

  /// Asks for the memory of surfels that will be made soon.
  void Prefetch(std::size_t begin, std::size_t count, int level) const;

  /// Appends the visible splats of surfels [begin, begin + count), all of one level.
  void Make(std::size_t begin, std::size_t count, int level, SplatOutput& output) const;

private:
  void SetCloud(const SurfelCloud& cloud);
  void SetOptics();
  void SetLights(const Material& material);
  void MakeOneByOne(std::size_t begin, std::size_t count, int level, SplatOutput& output) const;

  const SplatContext* Context = nullptr;
  std::optional<TruncatedGaussian> Gaussian;
  std::optional<PlacedCloud> Cloud;
  const SetupTarget* Kernel = nullptr;
  bool OneByOne = false;
  std::vector<SetupLight> Lights;
  SetupJob Job{};
};
}
