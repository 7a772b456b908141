// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Neighbors/AngularGap.h"

#include <algorithm>
#include <cmath>

namespace SurfelGeometry
{
namespace
{
/// A number from 0 to 4 in the order of the angles from -pi.
float PseudoAngle(float x, float y)
{
  const float across = x / (std::abs(x) + std::abs(y)); // 1 along x, -1 against it
  return y < 0.0f ? 1.0f + across : 3.0f - across;
}

/// Whether the angle from a counterclockwise to b is above 3/4 pi.
/// @param turn difference of their pseudo-angles: a right angle is 1
bool IsWide(float ax, float ay, float bx, float by, float turn)
{
  const double cross = static_cast<double>(ax) * by - static_cast<double>(ay) * bx;
  const double dot = static_cast<double>(ax) * bx + static_cast<double>(ay) * by;
  return turn >= 2.0f || (turn > 1.0f && dot < 0.0 && cross < -dot);
}
}

void Directions::Clear()
{
  this->Count = 0;
  this->Octants = 0;
}

bool Directions::HaveGap()
{
  if (!this->MayHaveGap())
  {
    return false;
  }
  if (this->Count < 2)
  {
    return true;
  }
  this->Order.resize(static_cast<std::size_t>(this->Count));
  for (int k = 0; k < this->Count; ++k)
  {
    this->Order[k] = { PseudoAngle(this->X[k], this->Y[k]), k };
  }
  std::sort(this->Order.begin(), this->Order.end());
  auto [before, from] = this->Order.back();
  before -= 4.0f;
  for (const auto& [angle, to] : this->Order)
  {
    if (IsWide(this->X[from], this->Y[from], this->X[to], this->Y[to], angle - before))
    {
      return true;
    }
    before = angle;
    from = to;
  }
  return false;
}
}
