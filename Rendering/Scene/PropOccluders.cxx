// SPDX-License-Identifier: BSD-3-Clause
#include "Rendering/Scene/PropOccluders.h"

#include "SurfelData/SMPExecutor.h"

#include <algorithm>
#include <cstddef>
#include <limits>

namespace SurfelSplatting
{
namespace
{
std::size_t NumberOfPixels(const SceneView& view)
{
  return static_cast<std::size_t>(view.Size[0]) * view.Size[1];
}
}

const float* PropOccluders::SplatBlurredPixels(
  const SceneView& view, const SplatContext& context, std::vector<SurfelCloud>& clouds)
{
  if (!view.OccluderDepth || !view.PropImage)
  {
    this->BlurredPixels = DepthImageSurfels();
    return view.OccluderDepth;
  }
  this->SharpDepth.assign(view.OccluderDepth, view.OccluderDepth + NumberOfPixels(view));
  DepthImage props = *view.PropImage;
  props.MinConfusion = view.MinConfusion();
  this->BlurredPixels.MakeSurfels(
    context.Camera, context.Optics, props, this->SharpDepth.data(), SMPExecutor());
  if (this->BlurredPixels.Size() > 0)
  {
    clouds.push_back(this->BlurredPixels.Get());
  }
  return this->SharpDepth.data();
}

const float* PropOccluders::ShareDepth(const SceneView& view, const float* depth, Ranks& ranks)
{
  const std::size_t pixels = NumberOfPixels(view);
  this->RootDepth = ranks.FromRoot([&] {
    Message message;
    if (depth && std::any_of(depth, depth + pixels, [](float distance) {
          return distance < std::numeric_limits<float>::infinity();
        }))
    {
      Put(depth, pixels, message);
    }
    return message;
  });
  return this->RootDepth.empty() ? nullptr : reinterpret_cast<const float*>(this->RootDepth.data());
}
}
