// SPDX-License-Identifier: BSD-3-Clause
/**
 * Everything that a picture depends on, as numbers: two frames with the same key are the same.
 * Internal to the module.
 */
#pragma once

#include "Core/Splats/SplatContext.h"
#include "vtkSurfelSplatter.h"

#include <cstdint>
#include <vector>

namespace SurfelSplatting
{
class FrameKey
{
public:
  FrameKey() = default;

  /// @param settings MTime of the splatter
  FrameKey(const std::vector<vtkSurfelSplatter::Item>& items, const vtkSurfelSplatter::View& view,
    const SplatContext& context, vtkMTimeType settings);

  bool operator==(const FrameKey& other) const;

private:
  void Add(double value);
  void Add(const Affine3& transform);
  void AddItem(const vtkSurfelSplatter::Item& item);
  void AddView(const SplatContext& context);
  void AddLight(const Light& light);

  std::vector<std::uint64_t> Values;
  std::vector<float> OccluderDepth, OthersDepth, OthersColor;
};
}
