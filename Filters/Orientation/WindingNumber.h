// SPDX-License-Identifier: BSD-3-Clause
/**
 * Winding number of a cloud of oriented surfels, at the surfels themselves.
 *
 * Surfels are dipoles: w(q) = sum_j A_j . (p_j - q) / (4 pi |p_j - q|^3) is the share of the
 * directions about q that meet the surface from inside (Barill et al. 2018, "Fast winding
 * numbers for soups and clouds", eq. 8). On a closed surface it is 1/2 where the normals point
 * outward and -1/2 where they point inward, on a plane 0; a hole reduces it by its solid angle over
 * 4 pi. So it tells without a mesh whether a surface is closed, up to holes, and with which sign.
 */
#pragma once

#include "Filters/Estimation/PlaneFit.h"

#include <algorithm>
#include <vector>

namespace SurfelGeometry
{
struct LocalCloud;

struct OrientedFits
{
  const LocalCloud& Cloud;
  const PlaneFits& Fits;
  const std::vector<char>& Flips; // [n] 1: the normal turned round is consistent with the others

  /// Of consistent signs among the members.
  Vector3 Normal(int i) const
  {
    const Vector3 normal = this->Fits[i].Normal;
    return this->Flips[i] ? -1.0 * normal : normal;
  }
};

/// Area of a surfel, world units squared. Where neighbours reach round a thin tube their tangential
/// variances are too small, and with them the spacing. Its nearest ReachRank neighbours reach less
/// far: they cover ReachRank + 1/2 areas per point.
inline double AreaOf(const PlaneFit& fit)
{
  const double area = static_cast<double>(fit.Spacing) * fit.Spacing;
  const double reached = Pi * fit.Reach * fit.Reach / (ReachRank + 0.5);
  return std::clamp(reached, area, 2.0 * area); // isolated points have a long reach
}

/// Winding numbers of some of a cloud's surfels, with the areas AreaOf(fit). A group of surfels far
/// away counts as one dipole (ibid., first order).
class WindingNumbers
{
public:
  /// @param members in the order of the cloud, which keeps neighbours together; must outlive this
  WindingNumbers(const OrientedFits& oriented, const int* members, int count);

  /// Winding number at point `at` of the cloud.
  double At(int at) const;

private:
  struct Group
  {
    Vector3 Center, Area;
    double Radius;
  };

  Group MakeGroup(int begin, int end) const;
  double Sum(const Group& group, int begin, int end, const Vector3& q, double soft) const;

  OrientedFits Oriented;
  const int* Members;
  int Count;
  std::vector<Group> Groups;
};
}
