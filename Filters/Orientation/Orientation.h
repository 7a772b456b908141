// SPDX-License-Identifier: BSD-3-Clause
/**
 * Turns the normals of a cloud consistently outward.
 *
 * 1. Every edge of the neighbourhood graph votes on the relative sign of its two normals
 *    (OrientationGraph.h).
 * 2. Reliable edges join points to patches, along a maximum spanning forest.
 * 3. The outside of each patch is decided where it needs no help (OutsideDecision.h): that of tubes
 *    and plates whose ends stick in other things, too.
 * 4. The sums of the votes between patches join them to components (SignPropagation.h).
 * 5. The outside of the other components is decided. A component with a known outside is one-sided,
 *    any other is two-sided.
 * 6. Rooms, which were scanned from inside, are turned inward (Rooms.h).
 *
 * Where scanners are known, shapes tell nothing: 2. keeps patches apart that face them from
 * opposite sides, 3. and 5. ask whether a patch faces them (ScannerSides.h), and there is no 6. So
 * a part of a cloud has the sides that it has in the whole.
 */
#pragma once

#include "Filters/Common/StageProgress.h"
#include "Filters/Orientation/OutsideDecision.h"

namespace SurfelGeometry
{
/// Results of the orientation besides the flipped normals.
struct OrientationResult
{
  std::vector<unsigned char> TwoSided; // [n]
  int NumberOfComponents = 0;
  int NumberOfClosedComponents = 0;
};

/// Turns the normals in `fits` consistently outward. Points whose normals were given keep them and
/// are one-sided; the others of their component follow them if the votes agree.
/// Returns false if stopped.
bool OrientConsistently(const LocalCloud& cloud, const NeighborGraph& graph,
  const OutsideSettings& settings, const StageProgress& progress, PlaneFits& fits,
  OrientationResult& result);

/// Turns every normal towards `viewpoint` (relative to the cloud's origin).
void FaceViewpoint(const LocalCloud& cloud, const Vector3& viewpoint, PlaneFits& fits);
}
