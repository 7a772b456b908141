// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Surfels/RoundSurfels.h"

namespace SurfelSplatting
{
RoundSurfels::RoundSurfels(
  std::size_t count, const float* positions, const float* normals, double spacing)
  : Count(count)
  , Positions(positions)
{
  this->Covariances.reserve(6 * count);
  this->AreaVectors.reserve(3 * count);
  const double area = spacing * spacing, variance = 0.25 * area;
  for (std::size_t i = 0; i < count; ++i)
  {
    Vector3 n{ normals[3 * i], normals[3 * i + 1], normals[3 * i + 2] };
    const double length = Norm(n); // 0 gives NaN, and a surfel that is counted and not drawn
    for (double& x : n)
    {
      x /= length;
      this->AreaVectors.push_back(static_cast<float>(area * x));
    }
    // variance (I - n n'), of rank 2 in the tangent plane
    for (const double s : { 1.0 - n[0] * n[0], 1.0 - n[1] * n[1], 1.0 - n[2] * n[2], -n[0] * n[1],
           -n[1] * n[2], -n[0] * n[2] })
    {
      this->Covariances.push_back(static_cast<float>(variance * s));
    }
  }
}

SurfelCloud RoundSurfels::Cloud() const&
{
  SurfelCloud cloud;
  cloud.NumberOfSurfels = this->Count;
  cloud.PositionsFloat = this->Positions;
  cloud.Covariances = this->Covariances.data();
  cloud.AreaVectors = this->AreaVectors.data();
  return cloud;
}
}
