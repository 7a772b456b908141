// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Cleaning/DepthSteps.h"

#include "Filters/Common/ParallelFor.h"

#include "vtkPoints.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

namespace SurfelGeometry
{
namespace
{
/// Depths are quantised if so many points share a value on average, and if most differences of
/// neighbouring values of 1/z are within this factor of their median: files round to millimetres.
constexpr size_t PointsPerValue = 64;
constexpr double StepTolerance = 1.6;
constexpr size_t FewestValues = 16;

/// How far a value moves, in steps: half a step of rounding and two deviations of the noise.
constexpr double LargestMove = 1.5;

/// A value and its neighbours on both sides are of one surface if it differs by less from their
/// mean, in steps. Rounding and noise of all three have a deviation of 0.7.
constexpr double LargestDifference = 1.75;

/// Averages of the neighbours: they reach 12 pixels, the width of the widest stairs.
constexpr int Iterations = 300;

/// The image of 1/z; NaN: no point.
class Disparities
{
public:
  Disparities(const DepthImage& image, int axis)
    : Columns(image.Columns)
    , Rows(static_cast<int>(image.Points->GetNumberOfPoints() / image.Columns))
    , Measured(image.Points->GetNumberOfPoints())
  {
    for (size_t i = 0; i < this->Measured.size(); ++i)
    {
      double p[3];
      image.Points->GetPoint(static_cast<vtkIdType>(i), p);
      const double inverse = 1.0 / (p[axis] - image.Viewpoint[axis]);
      this->Measured[i] = std::isfinite(inverse) && inverse != 0.0
        ? inverse
        : std::numeric_limits<double>::quiet_NaN();
    }
  }

  /// The difference of neighbouring values; 0: they are not quantised.
  double FindStep() const
  {
    std::vector<double> values;
    std::copy_if(this->Measured.begin(), this->Measured.end(), std::back_inserter(values),
      [](double d) { return !std::isnan(d); });
    const size_t count = values.size();
    std::sort(values.begin(), values.end());
    values.erase(std::unique(values.begin(), values.end()), values.end());
    if (values.size() < FewestValues || values.size() * PointsPerValue > count ||
      values.front() * values.back() <= 0.0)
    {
      return 0.0;
    }
    std::vector<double> steps(values.size() - 1);
    for (size_t k = 0; k < steps.size(); ++k)
    {
      steps[k] = values[k + 1] - values[k];
    }
    std::sort(steps.begin(), steps.end());
    const double step = steps[steps.size() / 2];
    const double low = steps[steps.size() / 10], high = steps[steps.size() * 9 / 10];
    return high < StepTolerance * step && low * StepTolerance > step ? step : 0.0;
  }

  /// Returns false if stopped.
  bool Smooth(double step, const StageProgress& progress)
  {
    this->Smoothed = this->Measured;
    std::vector<double> next(this->Smoothed);
    for (int k = 0; k < Iterations; ++k)
    {
      ParallelFor(0, this->Rows, 16, [&](vtkIdType begin, vtkIdType end) {
        for (int y = static_cast<int>(begin); y < end; ++y)
        {
          this->SmoothRow(y, step, next);
        }
      });
      std::swap(this->Smoothed, next);
      if (!progress.Step((k + 1.0) / Iterations))
      {
        return false;
      }
    }
    return true;
  }

  /// z after the smoothing over z before; 1 where there is no point.
  double ScaleOf(size_t i) const
  {
    const double scale = this->Measured[i] / this->Smoothed[i];
    return std::isfinite(scale) ? scale : 1.0;
  }

private:
  void SmoothRow(int y, double step, std::vector<double>& next) const
  {
    for (int x = 0; x < this->Columns; ++x)
    {
      const size_t i = static_cast<size_t>(y) * this->Columns + x;
      double sum = 0.0, count = 0.0;
      // In pairs, so that planes stay as they are at their borders, too: one neighbour alone would
      // level them towards the sensor, and tear them apart where noise looks like a border.
      const auto add = [&](bool inside, size_t before, size_t after) {
        const auto mean = [&](
                            const std::vector<double>& v) { return 0.5 * (v[before] + v[after]); };
        // False where there is no point: NaN.
        if (inside && std::abs(mean(this->Measured) - this->Measured[i]) < LargestDifference * step)
        {
          sum += mean(this->Smoothed);
          ++count;
        }
      };
      add(x > 0 && x + 1 < this->Columns, i - 1, i + 1);
      add(y > 0 && y + 1 < this->Rows, i - this->Columns, i + this->Columns);
      const double reach = LargestMove * step;
      next[i] = count > 0.0
        ? std::clamp(sum / count, this->Measured[i] - reach, this->Measured[i] + reach)
        : this->Measured[i];
    }
  }

  int Columns, Rows;
  std::vector<double> Measured, Smoothed; // per world unit
};
}

bool SmoothDepthSteps(
  const DepthImage& image, const StageProgress& progress, std::vector<Float3>& shifts)
{
  shifts.clear();
  for (int axis = 0; axis < 3; ++axis)
  {
    Disparities disparities(image, axis);
    const double step = disparities.FindStep();
    if (step <= 0.0)
    {
      continue;
    }
    if (!disparities.Smooth(step, progress))
    {
      return false;
    }
    shifts.resize(image.Points->GetNumberOfPoints());
    for (size_t i = 0; i < shifts.size(); ++i)
    {
      double p[3];
      image.Points->GetPoint(static_cast<vtkIdType>(i), p);
      const double by = disparities.ScaleOf(i) - 1.0;
      if (by != 0.0)
      {
        const double* v = image.Viewpoint;
        shifts[i] = Vector3{ by * (p[0] - v[0]), by * (p[1] - v[1]), by * (p[2] - v[2]) };
      }
    }
    return true;
  }
  return true;
}
}
