// SPDX-License-Identifier: BSD-3-Clause
#include "SurfelWinding.h"

#include "LocalCloud.h"

#include <cmath>

namespace SurfelGeometry
{
double WindingNumber(const LocalCloud& cloud, const std::vector<SurfelFit>& fits,
  const int* members, int count, int at)
{
  constexpr double fourPi = 4.0 * 3.14159265358979323846;
  const Vector3 q = Load(cloud.Position(at));
  // Softened by half a spacing: a near surfel is not a point, and noise along the normal over a
  // small distance would outweigh the whole rest.
  const double soft = 0.25 * fits[at].Spacing * fits[at].Spacing;
  double sum = 0.0;
  for (int m = 0; m < count; ++m)
  {
    const int j = members[m];
    const SurfelFit& fit = fits[j];
    const Vector3 d = Load(cloud.Position(j)) - q;
    const double squared = Dot(d, d) + soft;
    sum += fit.Spacing * fit.Spacing * Dot(fit.Normal, d) / (squared * std::sqrt(squared));
  }
  return sum / fourPi;
}
}
