// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Estimation/SurfelKernel.h"

#include "Filters/Estimation/PlaneFit.h"
#include "Filters/Estimation/VoronoiCell.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace SurfelGeometry
{
SurfelKernel SpacingKernel(const PlaneFit& fit, double scale, bool elliptical)
{
  const double spacing = fit.Spacing, area = spacing * spacing;
  const double ratio = elliptical
    ? std::sqrt(fit.VarianceU / std::max<double>(fit.VarianceV, std::numeric_limits<float>::min()))
    : 1.0;
  return { fit.AxisU, scale * scale * area * ratio, scale * scale * area / ratio, area };
}

SurfelKernel CellKernel(const PlaneFit& fit, const VoronoiCell& cell)
{
  return { fit.AxisU, fit.VarianceU, fit.VarianceV, cell.Area };
}

double MeanBlur(double blur)
{
  return std::sqrt(1.0 / 12.0 + blur * blur);
}

void BoundAxes(double maximumRatio, SurfelKernel& kernel)
{
  const double bound = maximumRatio * maximumRatio;
  if (kernel.VarianceU > bound * kernel.VarianceV)
  {
    // The same product, a smaller ratio.
    const double product = std::sqrt(kernel.VarianceU * kernel.VarianceV);
    kernel.VarianceU = product * maximumRatio;
    kernel.VarianceV = product / maximumRatio;
  }
}

void StoreCovariance(const SurfelKernel& kernel, const Vector3& normal, float* s)
{
  const Vector3 u = kernel.AxisU;
  const Vector3 v = Cross(normal, u);
  const double varianceU = kernel.VarianceU, varianceV = kernel.VarianceV;
  s[0] = static_cast<float>(varianceU * u[0] * u[0] + varianceV * v[0] * v[0]);
  s[1] = static_cast<float>(varianceU * u[1] * u[1] + varianceV * v[1] * v[1]);
  s[2] = static_cast<float>(varianceU * u[2] * u[2] + varianceV * v[2] * v[2]);
  s[3] = static_cast<float>(varianceU * u[0] * u[1] + varianceV * v[0] * v[1]);
  s[4] = static_cast<float>(varianceU * u[1] * u[2] + varianceV * v[1] * v[2]);
  s[5] = static_cast<float>(varianceU * u[0] * u[2] + varianceV * v[0] * v[2]);
}
}
