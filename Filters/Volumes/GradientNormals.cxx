// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Volumes/GradientNormals.h"

#include "Filters/Volumes/TransferTable.h"

#include "vtkPiecewiseFunction.h"

#include <algorithm>
#include <cmath>
#include <limits>

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

double FaceDifference(double inner, double scalar, double outside)
{
  const double least = 0.5 * (outside - scalar);
  const double central = std::abs(inner) <= LargestScalar ? 0.5 * (outside - inner) : 0.0;
  return std::abs(central) > std::abs(least) ? central : least;
}

OutsideScalar::OutsideScalar(vtkPiecewiseFunction* opacity)
  : Low(std::numeric_limits<double>::quiet_NaN())
  , High(this->Low)
{
  constexpr double infinity = std::numeric_limits<double>::infinity();
  const int count = opacity && opacity->GetClamping() ? opacity->GetSize() : 0;
  int ranges = 0;
  bool wasTransparent = false;
  double low = 0.0, high = 0.0;
  for (int i = 0; i < count; ++i)
  {
    double node[4]; // place, value, midpoint, sharpness
    opacity->GetNodeValue(i, node);
    const bool isTransparent = !(node[1] > 0.0);
    if (isTransparent && !wasTransparent)
    {
      ++ranges;
      low = i == 0 ? -infinity : node[0];
    }
    high = !isTransparent ? high : i == count - 1 ? infinity : node[0];
    wasTransparent = isTransparent;
  }
  if (ranges == 1)
  {
    this->Low = low;
    this->High = high;
  }
}

double OutsideScalar::operator()(double scalar) const
{
  return std::isnan(this->Low) ? this->Low : std::clamp(scalar, this->Low, this->High);
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
