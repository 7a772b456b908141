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

#include "Filters/Estimation/PlaneFit.h"

#include <vector>

namespace SurfelGeometry
{
struct LocalCloud;

/// Of some of a cloud's surfels, with area = Spacing^2. Groups of them that are far away count as
/// one dipole each (ibid., first order).
class WindingNumbers
{
public:
  /// @param members in the order of the cloud, which keeps neighbours together; kept by the caller
  WindingNumbers(
    const LocalCloud& cloud, const std::vector<PlaneFit>& fits, const int* members, int count);

  /// At the cloud's point `at`.
  double At(int at) const;

private:
  struct Group
  {
    Vector3 Center, Area;
    double Radius;
  };

  double Sum(const Group& group, int begin, int end, const Vector3& q, double soft) const;

  const LocalCloud& Cloud;
  const std::vector<PlaneFit>& Fits;
  const int* Members;
  int Count;
  std::vector<Group> Groups;
};
}
