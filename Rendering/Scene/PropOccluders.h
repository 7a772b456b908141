// SPDX-License-Identifier: BSD-3-Clause
/**
 * Other props in a picture: those that stay sharp hide the surfels behind them, and the pixels of
 * those that the lens blurs become surfels. Internal to the module.
 */
#pragma once

#include "Core/Base/Ranks.h"
#include "Core/Splats/DepthImageSurfels.h"
#include "Core/Splats/SplatContext.h"
#include "Core/Surfels/SurfelCloud.h"
#include "Rendering/Scene/SceneView.h"

#include <vector>

namespace SurfelSplatting
{
class PropOccluders
{
public:
  /// Turns the pixels that the lens blurs into a cloud of their own. Returns the distances of the
  /// props that stay sharp; null if there are no props. They live as long as the view and this.
  const float* SplatBlurredPixels(
    const SceneView& view, const SplatContext& context, std::vector<SurfelCloud>& clouds);

  /// Collective. Returns process 0's distances; null if it has no props.
  /// @param depth of this process, or null
  const float* ShareDepth(const SceneView& view, const float* depth, Ranks& ranks);

  /// The blurred pixels of the last picture.
  const DepthImageSurfels& GetBlurredPixels() const { return this->BlurredPixels; }

private:
  DepthImageSurfels BlurredPixels;
  std::vector<float> SharpDepth; ///< without the pixels that are splatted
  Message RootDepth;             ///< distances of process 0
};
}
