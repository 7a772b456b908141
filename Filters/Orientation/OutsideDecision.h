// SPDX-License-Identifier: BSD-3-Clause
/**
 * Decides which side of a component is its outside: by the normals that were given, by the winding
 * number where the component is closed, or by a viewpoint. Otherwise the outside is unknown.
 */
#pragma once

#include "Filters/Estimation/PlaneFit.h"

#include <vector>

namespace SurfelGeometry
{
struct LocalCloud;

struct OutsideSettings
{
  bool UseViewpoint = false;
  Vector3 Viewpoint{};          // relative to the cloud's origin
  double FacingAgreement = 0.8; // share of the area that must face the viewpoint, or face away
};

/// Points whose normals have consistent signs.
struct Component
{
  const int* Ids; // ascending
  int Count;
  double Conflict; // share of the votes between its points that contradict its orientation
};

struct OutsideInput
{
  const LocalCloud& Cloud;
  const std::vector<PlaneFit>& Fits;  // the signs of given normals and of plates are outward
  const std::vector<Float3>& Normals; // [n] of consistent signs in the component
};

struct OutsideSign
{
  int Sign = 0; // +1: the normals point outward; -1: inward; 0: unknown
  bool IsClosed = false;
};

/// The sign of a thin plate, or of a thin or long tube, whose ends may stick in other things: it is
/// known without the surroundings. The wall of a wide hole looks like a short tube.
int DecidePatch(const OutsideInput& input, const Component& patch);

OutsideSign DecideOutside(
  const OutsideInput& input, const OutsideSettings& settings, const Component& component);
}
