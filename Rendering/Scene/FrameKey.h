// SPDX-License-Identifier: BSD-3-Clause
/**
 * Everything that a picture depends on, as numbers: frames with equal keys have equal pictures.
 * Internal to the module.
 */
#pragma once

#include "Core/Splats/SplatContext.h"
#include "Rendering/Scene/SceneView.h"

#include <vtkType.h>

#include <cstdint>
#include <vector>

namespace SurfelSplatting
{
class FrameKey
{
public:
  FrameKey() = default;

  /// @param settings MTime of the splatter
  FrameKey(const std::vector<SceneItem>& items, const SceneView& view, const SplatContext& context,
    vtkMTimeType settings);

  bool operator==(const FrameKey& other) const;

private:
  void Add(double value);
  void Add(const Affine3& transform);
  void AddItem(const SceneItem& item);
  void AddView(const SplatContext& context);
  void AddLight(const Light& light);

  std::vector<std::uint64_t> Values;
  std::vector<float> OccluderDepth, PropDepth, PropColor;
};
}
