// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Volumes/GradientNormals.h"

#include "Filters/Volumes/TransferTable.h"

#include <algorithm>
#include <cmath>

namespace SurfelVolumes
{
double Difference(double low, double scalar, double high)
{
  const bool hasLow = std::abs(low) <= LargestScalar, hasHigh = std::abs(high) <= LargestScalar;
  if (hasLow && hasHigh)
  {
    return 0.5 * (high - low);
  }
  return hasHigh ? high - scalar : hasLow ? scalar - low : 0.0;
}

GradientNormals::GradientNormals(const double (&axes)[3][3])
{
  double determinant = 0.0;
  for (int i = 0; i < 3; ++i)
  {
    for (int k = 0; k < 3; ++k)
    {
      // The cofactors: A^-T times the determinant.
      const int i1 = (i + 1) % 3, i2 = (i + 2) % 3, k1 = (k + 1) % 3, k2 = (k + 2) % 3;
      this->Falling[i][k] = axes[i1][k1] * axes[i2][k2] - axes[i1][k2] * axes[i2][k1];
    }
    determinant += axes[0][i] * this->Falling[0][i];
  }
  for (auto& row : this->Falling)
  {
    for (double& element : row)
    {
      element = determinant > 0.0 ? -element : element;
    }
  }
}

std::array<double, 3> GradientNormals::operator()(const std::array<double, 3>& derivatives) const
{
  const auto& d = derivatives;
  const double largest = std::max({ std::abs(d[0]), std::abs(d[1]), std::abs(d[2]) });
  std::array<double, 3> normal{ 0.0, 0.0, 0.0 };
  if (!(largest > 0.0))
  {
    return normal;
  }
  double square = 0.0;
  for (int i = 0; i < 3; ++i)
  {
    // Relative to the largest, so that no square overflows.
    for (int k = 0; k < 3; ++k)
    {
      normal[i] += this->Falling[i][k] * (d[k] / largest);
    }
    square += normal[i] * normal[i];
  }
  const double inverse = square > 0.0 ? 1.0 / std::sqrt(square) : 0.0;
  return { inverse * normal[0], inverse * normal[1], inverse * normal[2] };
}
}
