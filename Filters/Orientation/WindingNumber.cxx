// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Orientation/WindingNumber.h"

#include "Filters/Common/ParallelFor.h"
#include "Filters/Neighbors/LocalCloud.h"

#include <algorithm>
#include <cmath>

namespace SurfelGeometry
{
namespace
{
constexpr int WindingGroupSize = 64;

/// A group counts as one dipole beyond this many of its radii. The error is some percent of the
/// group's own term, of either sign.
constexpr double FarAway = 5.0;

/// 4 pi times the winding number of a dipole.
double Dipole(const Vector3& area, const Vector3& d, double soft)
{
  const double squared = Dot(d, d) + soft;
  return Dot(area, d) / (squared * std::sqrt(squared));
}
}

WindingNumbers::WindingNumbers(const OrientedFits& oriented, const int* members, int count)
  : Oriented(oriented)
  , Members(members)
  , Count(count)
{
  this->Groups.resize(static_cast<size_t>((count + WindingGroupSize - 1) / WindingGroupSize));
  const auto groups = static_cast<vtkIdType>(this->Groups.size());
  constexpr vtkIdType grain = 64;
  ParallelFor(0, groups, grain, [&](vtkIdType g, vtkIdType end) {
    for (; g < end; ++g)
    {
      const int first = static_cast<int>(g) * WindingGroupSize;
      this->Groups[g] = this->MakeGroup(first, std::min(count, first + WindingGroupSize));
    }
  });
}

WindingNumbers::Group WindingNumbers::MakeGroup(int begin, int end) const
{
  const LocalCloud& cloud = this->Oriented.Cloud;
  Group group{};
  double weights = 0.0;
  for (int m = begin; m < end; ++m)
  {
    const int j = this->Members[m];
    const double weight = AreaOf(this->Oriented.Fits[j]);
    weights += weight;
    group.Center = group.Center + weight * Load(cloud.Position(j));
    group.Area = group.Area + weight * this->Oriented.Normal(j);
  }
  group.Center = (weights > 0.0 ? 1.0 / weights : 0.0) * group.Center;
  for (int m = begin; m < end; ++m)
  {
    group.Radius =
      std::max(group.Radius, Norm(Load(cloud.Position(this->Members[m])) - group.Center));
  }
  return group;
}

double WindingNumbers::Sum(
  const Group& group, int begin, int end, const Vector3& q, double soft) const
{
  const Vector3 d = group.Center - q;
  if (Dot(d, d) > FarAway * FarAway * group.Radius * group.Radius && end - begin > 1)
  {
    return Dipole(group.Area, d, soft);
  }
  double sum = 0.0;
  for (int m = begin; m < end; ++m)
  {
    const int j = this->Members[m];
    sum += Dipole(AreaOf(this->Oriented.Fits[j]) * this->Oriented.Normal(j),
      Load(this->Oriented.Cloud.Position(j)) - q, soft);
  }
  return sum;
}

double WindingNumbers::At(int at) const
{
  const Vector3 q = Load(this->Oriented.Cloud.Position(at));
  // Softened by half a spacing: a near surfel is not a point; otherwise noise along the normal over
  // a small distance would outweigh everything else.
  const double spacing = this->Oriented.Fits[at].Spacing;
  const double soft = 0.25 * spacing * spacing;
  double sum = 0.0;
  for (size_t g = 0; g < this->Groups.size(); ++g)
  {
    const int begin = static_cast<int>(g) * WindingGroupSize;
    sum +=
      this->Sum(this->Groups[g], begin, std::min(this->Count, begin + WindingGroupSize), q, soft);
  }
  return sum / (4.0 * Pi);
}
}
