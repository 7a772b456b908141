// SPDX-License-Identifier: BSD-3-Clause
/**
 * Tells rooms, which were scanned from inside, from closed things, which were scanned from outside.
 *
 * As surfaces both are the same. But a room has a floor and a ceiling, and between them something
 * that nobody sees from outside:
 * - What stands free or hangs, such as chairs and lamps, lies inside of the surface, by its winding
 *   number. What pokes into it from outside, as the foot of a statue into its base, does not count.
 * - What hides the floor or a wall, such as cupboards, is part of the surface. With normals that
 *   point out of the room its tops face down. So more level area between floor and ceiling faces
 *   down than up; where a thing stands on the ground, it is the other way round. There are things
 *   that are wider at their tops, so this counts only if the surface is as high as rooms are, in
 *   metres or feet, and nowhere narrower than high.
 *
 * An empty room has nothing of this, and remains a box.
 */
#pragma once

#include "Filters/Orientation/ConsistentSets.h"
#include "Filters/Orientation/OutsideDecision.h"

#include <vector>

namespace SurfelGeometry
{
/// Whether a set of points whose normals point outward is a room.
/// @param twoSided [n]
/// @param sets     of all points
/// @param number   of the set
bool IsRoom(const LocalCloud& cloud, const NeighborGraph& graph, const PlaneFits& fits,
  const std::vector<unsigned char>& twoSided, const ConsistentSets& sets, int number);
}
