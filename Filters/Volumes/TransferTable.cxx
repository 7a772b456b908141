// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Volumes/TransferTable.h"

#include "vtkColorTransferFunction.h"
#include "vtkPiecewiseFunction.h"
#include "vtkVolumeProperty.h"

#include <algorithm>
#include <cmath>

namespace SurfelVolumes
{
namespace
{
/// Limits a value of a transfer function; NaN becomes 0.
double Limit(double value, double most)
{
  return value > 0.0 ? std::min(value, most) : 0.0;
}

/// Red, green and blue at equidistant scalars.
std::vector<double> SampleColors(vtkVolumeProperty* property, const double range[2], int count)
{
  std::vector<double> colors(3 * static_cast<std::size_t>(count));
  if (property->GetColorChannels(0) != 1)
  {
    property->GetRGBTransferFunction(0)->GetTable(range[0], range[1], count, colors.data());
    return colors;
  }
  std::vector<double> gray(count);
  property->GetGrayTransferFunction(0)->GetTable(range[0], range[1], count, gray.data());
  for (std::size_t i = 0; i < colors.size(); ++i)
  {
    colors[i] = gray[i / 3];
  }
  return colors;
}
}

TransferTable::TransferTable(
  vtkVolumeProperty* property, const double range[2], double unitDistance)
  : Low(std::clamp(range[0], -LargestScalar, LargestScalar))
{
  // A single scalar gets an interval, too.
  const double least = 1e-6 * std::max(1.0, std::abs(this->Low));
  const double ends[2] = { this->Low,
    std::max(std::min(range[1], LargestScalar), this->Low + least) };
  this->StepsPerScalar = Steps / (ends[1] - ends[0]);
  std::vector<double> opacities(Steps + 1);
  property->GetScalarOpacity(0)->GetTable(ends[0], ends[1], Steps + 1, opacities.data());
  const std::vector<double> colors = SampleColors(property, ends, Steps + 1);

  this->Integrals.resize(Steps + 1);
  Medium last;
  for (int i = 0; i <= Steps; ++i)
  {
    Medium medium;
    medium.Extinction = -std::log1p(-Limit(opacities[i], LargestOpacity)) / unitDistance;
    const Medium before = i > 0 ? this->Integrals[i - 1] : Medium();
    const double half = i > 0 ? 0.5 : 0.0; // trapezoids
    this->Integrals[i].Extinction =
      before.Extinction + half * (last.Extinction + medium.Extinction);
    for (int k = 0; k < 3; ++k)
    {
      medium.Emission[k] = medium.Extinction * Limit(colors[3 * i + k], 1.0);
      this->Integrals[i].Emission[k] =
        before.Emission[k] + half * (last.Emission[k] + medium.Emission[k]);
    }
    last = medium;
    this->First = i == 0 ? medium : this->First;
  }
  this->Last = last;
}

void TransferTable::LimitToFunctions(vtkVolumeProperty* property, double range[2])
{
  vtkPiecewiseFunction* opacity = property->GetScalarOpacity(0);
  const bool isGray = property->GetColorChannels(0) == 1;
  vtkPiecewiseFunction* gray = isGray ? property->GetGrayTransferFunction(0) : nullptr;
  vtkColorTransferFunction* rgb = isGray ? nullptr : property->GetRGBTransferFunction(0);
  if (!opacity->GetClamping() || !(gray ? gray->GetClamping() : rgb->GetClamping()))
  {
    return; // 0 beyond their ends
  }
  const double* opacities = opacity->GetRange();
  const double* colors = gray ? gray->GetRange() : rgb->GetRange();
  range[0] = std::min(range[1], std::max(range[0], std::min(opacities[0], colors[0])));
  range[1] = std::max(range[0], std::min(range[1], std::max(opacities[1], colors[1])));
}

double TransferTable::Position(double scalar) const
{
  return std::clamp((scalar - this->Low) * this->StepsPerScalar, 0.0, double{ Steps });
}

Medium TransferTable::Integral(double position) const
{
  const int step = std::min(static_cast<int>(position), Steps - 1);
  const double f = position - step;
  const Medium &a = this->Integrals[step], &b = this->Integrals[step + 1];
  Medium result;
  result.Extinction = a.Extinction + f * (b.Extinction - a.Extinction);
  for (int k = 0; k < 3; ++k)
  {
    result.Emission[k] = a.Emission[k] + f * (b.Emission[k] - a.Emission[k]);
  }
  return result;
}

Medium TransferTable::Mean(double scalar, double reach) const
{
  // In steps of the table; its ends stand for what lies beyond.
  const double center =
    std::clamp((scalar - this->Low) * this->StepsPerScalar, -LargestScalar, LargestScalar);
  const double half = std::clamp(reach * this->StepsPerScalar, 0.5, LargestScalar);
  const double width = 2.0 * half;
  const double below = std::clamp(half - center, 0.0, width);
  const double above = std::clamp(center + half - Steps, 0.0, width);
  const Medium a = this->Integral(std::clamp(center - half, 0.0, double{ Steps }));
  const Medium b = this->Integral(std::clamp(center + half, 0.0, double{ Steps }));
  const auto mean = [&](double first, double last, double inside) {
    return (below / width) * first + (above / width) * last + inside / width;
  };
  Medium result;
  result.Extinction =
    mean(this->First.Extinction, this->Last.Extinction, b.Extinction - a.Extinction);
  for (int k = 0; k < 3; ++k)
  {
    result.Emission[k] =
      mean(this->First.Emission[k], this->Last.Emission[k], b.Emission[k] - a.Emission[k]);
  }
  return result;
}

bool TransferTable::IsEmpty(double low, double high) const
{
  const int from = static_cast<int>(this->Position(low));
  const int to = std::min(static_cast<int>(this->Position(high)) + 1, Steps);
  return this->Integrals[std::max(0, from - 1)].Extinction ==
    this->Integrals[std::min(to + 1, Steps)].Extinction;
}
}
