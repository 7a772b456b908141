// SPDX-License-Identifier: BSD-3-Clause
/**
 * Decides which side of a component is its outside: by the normals that were given, by the winding
 * number where the component is closed, or by a viewpoint. Otherwise the outside is unknown.
 */
#pragma once

#include "Filters/Orientation/WindingNumber.h"

#include <functional>
#include <vector>

namespace SurfelGeometry
{
struct LocalCloud;

/// Largest |sum of the area vectors| over the sum of the areas of what is closed.
constexpr double MaxImbalance = 0.15;

struct OutsideSettings
{
  bool UseViewpoint = false;
  Vector3 Viewpoint{};          // relative to the cloud's origin
  double FacingAgreement = 0.8; // share of the area that must face the viewpoint, or face away
  bool UseScanners = false;     // what scanners have seen faces them; shapes tell nothing
  std::vector<float> Facings{}; // [n] with UseScanners: cosines as of FaceScanners
};

/// Points whose normals have consistent signs.
struct Component
{
  const int* Ids; // ascending
  int Count;
};

struct OutsideInput
{
  OrientedFits Oriented; // the signs of given normals and of plates are outward in the fits
  /// Share of the votes between a component's points that contradict its signs.
  std::function<double(const Component&)> Conflict;
};

struct OutsideSign
{
  int Sign = 0; // +1: the normals point outward; -1: inward; 0: unknown
  bool IsClosed = false;
};

/// The side of a patch that is known without its surroundings: normals were given, or it is a thin
/// plate, or faces the scanners, or is a thin or long tube, whose ends may stick in other things.
/// The wall of a wide hole looks like a short tube.
OutsideSign DecidePatch(
  const OutsideInput& input, const OutsideSettings& settings, const Component& patch);

OutsideSign DecideComponent(
  const OutsideInput& input, const OutsideSettings& settings, const Component& component);
}
