// SPDX-License-Identifier: BSD-3-Clause
/**
 * Which side of a surfel is its outside, as the settings of vtkSurfelEstimation say.
 */
#pragma once

#include "Filters/Orientation/Orientation.h"

class vtkDataArray;

namespace SurfelGeometry
{
class SharedOrientation;

/// What tells the outside of surfels without given normals.
enum class SideRule
{
  Shape,
  Viewpoint,
  Scanners,
  TwoSided // nothing
};

struct SidesInput
{
  SideRule Rule;
  bool UseViewpoint;         // where the shape tells nothing
  double Viewpoint[3];       // world units
  SharedOrientation* Shared; // orientation together with other ranks, or null
  const LocalCloud& Cloud;
  const NeighborGraph& Graph;
  vtkDataArray* ToScanner; // of the input's points, or null
};

/// Turns the normals in `fits` outward. Returns false if stopped.
bool DecideSides(const SidesInput& input, const StageProgress& progress, PlaneFits& fits,
  OrientationResult& result);
}
