// SPDX-License-Identifier: BSD-3-Clause
/**
 * Which side of a surfel is the outside, and whether that can be known at all.
 *
 * 1. Every edge of the neighbourhood graph votes on the relative sign of its two normals.
 * 2. Trustworthy edges are joined along a maximum spanning forest into patches.
 * 3. Patches are joined by the sum of all votes between them, the surest pair first. Where the
 *    votes contradict each other, as where surfaces cross, patches stay apart.
 * 4. Each component that turns out closed (its winding number says so) is turned outward and is
 *    one-sided; one that a viewpoint decides faces it; any other one is two-sided.
 */
#pragma once

#include "Filters/Estimation/PlaneFit.h"

namespace SurfelGeometry
{
struct LocalCloud;

struct OrientationSettings
{
  bool UseViewpoint = false;
  Vector3 Viewpoint{};          // relative to the cloud's origin
  double FacingAgreement = 0.8; // of the area, for a viewpoint to decide
};

/// Result per point, beside the turned normals.
struct Sidedness
{
  std::vector<int> Components;         // [n] 0 .. NumberOfComponents - 1
  std::vector<unsigned char> TwoSided; // [n]
  int NumberOfComponents = 0;
  int NumberOfClosedComponents = 0;
};

/// Turns the normals in `fits` consistently and decides their sides. Points whose normals were
/// given are one-sided and keep their sign; others follow them where the votes agree.
/// Returns false if stopped.
bool OrientConsistently(const LocalCloud& cloud, const NeighborGraph& graph,
  const OrientationSettings& settings, const StageProgress& monitor, std::vector<PlaneFit>& fits,
  Sidedness& sides);

/// Turns every normal to face `viewpoint` (relative to the cloud's origin).
void FaceViewpoint(const LocalCloud& cloud, const Vector3& viewpoint, std::vector<PlaneFit>& fits);
}
