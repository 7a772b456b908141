// SPDX-License-Identifier: BSD-3-Clause
/**
 * Sides of a cloud of several scans, each point of which knows its scanner: what a scanner has seen
 * faces it.
 *
 * A single normal tells its side only if the scanner is well off the tangent plane: where planes
 * are uncertain (noise, edges, foliage) and where the scanner looks along the surface, the sign of
 * the cosine is chance. There the votes of the neighbours decide (Orientation.h). Points that
 * surely face their scanners are the evidence for the side of the patch that they are in; two
 * patches do not become one if both have enough of it and it says the opposite, as of the two sides
 * of a leaf.
 */
#pragma once

#include "Filters/Estimation/PlaneFit.h"

#include <vector>

class vtkDataArray;

namespace SurfelGeometry
{
struct LocalCloud;
class ParityUnionFind;

/// Turns normals towards the scanners, but not those that were given, nor those of thin plates that
/// do not surely face it. Returns [n] the cosines of the angles between both, 0 where a point's
/// scanner is not known.
/// @param toScanner vectors from the input's points to their scanners; null: none is known
std::vector<float> FaceScanners(const LocalCloud& cloud, vtkDataArray* toScanner, PlaneFits& fits);

/// [n] 1: the normal surely faces the scanner. The direction to it has a larger slope over the
/// tangent plane than the neighbours; if these are noise, that is four standard deviations of the
/// slope of a plane through 16 of them.
std::vector<unsigned char> FindSurelySeen(const PlaneFits& fits, const std::vector<float>& facings);

/// Points that surely face their scanners, from which on the side of a patch is known: noise turns
/// fewer by chance in one place.
constexpr int EnoughSeen = 8;

/// A normal that is turned away from its scanner by a larger cosine is not that of what the scanner
/// has seen, as in the corner of an acute angle.
constexpr double MostTurnedAway = 0.3;

/// Joins the sets of a and b, unless enough evidence of both contradicts that.
/// @param evidence [n] at the root of a set: number of points that surely face their scanners with
/// the sign of the root, less that of those with the opposite one
void JoinSeen(int a, int b, bool differ, ParityUnionFind& signs, std::vector<int>& evidence);
}
