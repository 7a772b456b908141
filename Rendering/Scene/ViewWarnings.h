// SPDX-License-Identifier: BSD-3-Clause
/**
 * What the user is told about views whose pictures may surprise. Internal to the module.
 */
#pragma once

#include <functional>
#include <vector>

namespace SurfelSplatting
{
struct SceneItem;
struct SceneView;

class ViewWarnings
{
public:
  using Warn = std::function<void(const char*)>;

  /// Warns of a complete view; once of each trouble.
  /// @param areFinite whether the splatter's settings are: VTK's macros keep NaN
  void Tell(const SceneView& view, bool areFinite, const Warn& warn);

  /// Warns of surfels too far to be drawn, and of mappers with clipping planes; once of each.
  void TellOfItems(const std::vector<SceneItem>& items, const SceneView& view, const Warn& warn);

private:
  bool ToldParallel = false, ToldOffAxis = false, ToldNotFinite = false, ToldPlanes = false,
       ToldFar = false;
};
}
