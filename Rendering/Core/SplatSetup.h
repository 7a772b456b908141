// SPDX-License-Identifier: BSD-3-Clause
/**
 * From surfels to splats: cull, project, blur by the lens, shade.
 */
#pragma once

#include "Executor.h"
#include "Lens.h"
#include "ResamplingKernel.h"
#include "Splat.h"
#include "SurfelCloud.h"
#include "View.h"

#include <cstdint>
#include <vector>

namespace SurfelSplatting
{
struct SplatSettings
{
  KernelType Kernel = KernelType::PearsonII;
  double Cutoff = 2.5;    ///< c on the Gaussian's exponent, (0, 20]
  double Prefilter = 1.0; ///< h, variance of the pixel filter in px^2, > 0
};

/// Splats of all clouds of a frame with their pixel boxes, in the order of the surfels.
struct SplatList
{
  std::vector<Splat> Splats;
  std::vector<PixelBox> Boxes;
  std::uint64_t NumberOfSurfels = 0;
  std::uint64_t NumberOfInvalidSurfels =
    0; ///< not drawn: non-finite values, or too large for float sums

  void Clear();
};

/// Everything that is the same for all surfels of a frame.
struct SplatContext
{
  View Camera;
  Lens Optics;
  std::vector<Light> Lights; ///< camera space
  SplatSettings Settings;
};

enum class SplatStatus
{
  Visible,
  Culled,
  Invalid
};

/// Projects one surfel. The scalar reference of the set-up.
SplatStatus MakeSplat(const SplatContext& context, const TruncatedGaussian& gaussian,
  const SurfelCloud& cloud, const Affine3& localToCamera,
  const std::array<Vector3, 3>& areaToCamera, std::size_t surfel, Splat& splat, PixelBox& box);

/// Appends the visible splats of a cloud to the list.
void AppendSplats(
  const SplatContext& context, const SurfelCloud& cloud, const Executor& executor, SplatList& list);
}
