// SPDX-License-Identifier: BSD-3-Clause
/**
 * Winding number of a cloud of oriented surfels, at the surfels themselves.
 *
 * Surfels are dipoles: w(q) = sum_j A_j . (p_j - q) / (4 pi |p_j - q|^3) is the share of the
 * directions about q that meet the surface from inside (Barill et al. 2018, "Fast winding
 * numbers for soups and clouds", eq. 8). On a closed surface it is 1/2 where the normals point
 * outward and -1/2 where they point inward, on a plane 0; a hole takes off its solid angle over
 * 4 pi. It is thus a test of being closed that needs no mesh, forgives holes, and has a sign.
 */
#pragma once

#include "SurfelFit.h"

namespace SurfelGeometry
{
struct LocalCloud;

/// Winding number at the point `at` of the surfels `members`, with area = Spacing^2.
double WindingNumber(const LocalCloud& cloud, const std::vector<SurfelFit>& fits,
  const int* members, int count, int at);
}
