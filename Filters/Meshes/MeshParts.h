// SPDX-License-Identifier: BSD-3-Clause
/**
 * Sides of the faces of a mesh, and the connected parts that agree on them.
 */
#pragma once

#include <array>
#include <vector>

namespace SurfelGeometry
{
/// Numbers of the places of a triangle's corners, in their order as seen from outside.
using Corners = std::array<int, 3>;

/// Whether the order of the corners tells from where triangles are seen: two that meet pass their
/// edge in opposite directions, and of solids that touch as many pass it in one as in the other.
bool HaveSides(const std::vector<Corners>& triangles);

/// [n] number of the part of each triangle, from 0, by their first triangles. Two are of one part
/// if they share an edge with no third one, and pass it in opposite directions.
std::vector<int> FindParts(const std::vector<Corners>& triangles);
}
