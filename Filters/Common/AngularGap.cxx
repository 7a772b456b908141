// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Common/AngularGap.h"

#include "Filters/Common/VectorMath.h"

#include <algorithm>
#include <cmath>

namespace SurfelGeometry
{
void Directions::Clear()
{
  this->Count = 0;
  this->Octants = 0;
}

bool Directions::HaveGap()
{
  // Such an angle contains at least two whole octants.
  const unsigned int free = ~this->Octants & 255u;
  if ((free & (free >> 1 | free << 7)) == 0)
  {
    return false;
  }
  if (this->Count == 0)
  {
    return true;
  }
  this->Angles.resize(this->Count);
  std::transform(this->X, this->X + this->Count, this->Y, this->Angles.begin(),
    [](double x, double y) { return std::atan2(y, x); });
  std::sort(this->Angles.begin(), this->Angles.end());
  double gap = this->Angles.front() + 2.0 * Pi - this->Angles.back();
  for (size_t k = 1; k < this->Angles.size(); ++k)
  {
    gap = std::max(gap, this->Angles[k] - this->Angles[k - 1]);
  }
  return gap > 0.75 * Pi;
}
}
