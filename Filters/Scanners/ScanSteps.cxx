// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Scanners/ScanSteps.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace SurfelGeometry
{
namespace
{
/// The share of the steps of a window that may be off: others jump as well, or were left out.
constexpr int MostOff = StepsInWindow / 4;

/// Where steps have several lengths, the longest is so many times as long as their mean. What they
/// are off across their line counts more than along it.
constexpr double LongestStep = 5.0, AcrossWeight = 3.0, AlongWeight = 0.1;

/// The unit of such steps is the shortest one or one of so many parts of it, and lengths are off
/// its multiples by less than this, as a root mean square, without the few that may be off. A third
/// is chance. Steps are not longer than so many units, nor shorter than a part of their mean.
constexpr int MostParts = 6;
constexpr double UnitOff = 0.12, MostUnits = 40.0, ShortestStep = 0.05;

using StepVectors = std::array<Eigen::Vector3d, StepsInWindow>;

/// As Eigen's normalized(), with one division instead of three.
Eigen::Vector3d UnitOf(const Eigen::Vector3d& v)
{
  const double squared = v.squaredNorm();
  return squared > 0.0 ? Eigen::Vector3d((1.0 / std::sqrt(squared)) * v) : v;
}

/// Batcher's sorting network (odd-even merges) of the steps of a window: which are to be compared.
/// It has no branches that depend on the values, and sorts several coordinates at a time. Three
/// calls of std::nth_element take five times as long.
struct SortingNetwork
{
  int Count = 0;
  std::array<std::array<unsigned char, 2>, 4 * StepsInWindow> Pairs{};

  constexpr SortingNetwork()
  {
    for (int p = 1; p < StepsInWindow; p *= 2)
    {
      for (int k = p; k >= 1; k /= 2)
      {
        for (int j = k % p; j + k < StepsInWindow; j += 2 * k)
        {
          this->Merge(p, k, j);
        }
      }
    }
  }

private:
  constexpr void Merge(int p, int k, int first)
  {
    for (int i = first; i < first + k && i + k < StepsInWindow; ++i)
    {
      if (i / (2 * p) == (i + k) / (2 * p))
      {
        this->Pairs[this->Count][0] = static_cast<unsigned char>(i);
        this->Pairs[this->Count][1] = static_cast<unsigned char>(i + k);
        ++this->Count;
      }
    }
  }
};
constexpr SortingNetwork Network;

double Least(double a, double b)
{
  return std::min(a, b);
}
double Greatest(double a, double b)
{
  return std::max(a, b);
}
Eigen::Array4d Least(const Eigen::Array4d& a, const Eigen::Array4d& b)
{
  return a.min(b);
}
Eigen::Array4d Greatest(const Eigen::Array4d& a, const Eigen::Array4d& b)
{
  return a.max(b);
}

/// The median of each coordinate.
template <typename Value>
Value MedianOfSteps(std::array<Value, StepsInWindow>& values)
{
  for (int k = 0; k < Network.Count; ++k)
  {
    Value& a = values[Network.Pairs[k][0]];
    Value& b = values[Network.Pairs[k][1]];
    const Value least = Least(a, b);
    b = Greatest(a, b);
    a = least;
  }
  return values[StepsInWindow / 2];
}

Eigen::Vector3d MedianOf(const StepVectors& steps)
{
  std::array<Eigen::Array4d, StepsInWindow> values;
  std::transform(steps.begin(), steps.end(), values.begin(),
    [](const Eigen::Vector3d& step) { return Eigen::Array4d(step[0], step[1], step[2], 0.0); });
  return MedianOfSteps(values).head<3>().matrix();
}

/// Distance of steps from their median.
SeenSteps SeeAlike(const StepVectors& steps)
{
  const Eigen::Vector3d median = MedianOf(steps);
  const double length = median.norm();
  SeenSteps seen;
  seen.IsValid = length > 0.0;
  const double perLength = seen.IsValid ? 1.0 / length : 0.0;
  std::transform(steps.begin(), steps.end(), seen.Off.begin(),
    [&](const Eigen::Vector3d& step) { return perLength * (step - median).norm(); });
  seen.MiddleOff = perLength * (steps[StepsBeside] - median);
  return seen;
}

/// Steps along a line: what they are across it, their lengths, and the mean of these without that
/// in the middle.
struct Line
{
  Eigen::Vector3d Along, Normal;
  std::array<double, StepsInWindow> Lengths, Across;
  double Mean = 0.0;

  /// @param sight direction to the middle
  Line(const StepVectors& steps, const Eigen::Vector3d& sight)
  {
    StepVectors directions;
    std::transform(steps.begin(), steps.end(), directions.begin(),
      [](const Eigen::Vector3d& step) { return UnitOf(step); });
    this->Normal = sight.cross(MedianOf(directions)).normalized();
    this->Along = this->Normal.cross(sight);
    for (int k = 0; k < StepsInWindow; ++k)
    {
      this->Across[k] = steps[k].dot(this->Normal);
      this->Lengths[k] = std::copysign(
        (steps[k] - this->Across[k] * this->Normal).norm(), steps[k].dot(this->Along));
    }
    std::array<double, StepsInWindow> sorted = this->Lengths;
    const double longest = LongestStep * MedianOfSteps(sorted);
    int count = 0;
    for (int k = 0; k < StepsInWindow; ++k)
    {
      if (k != StepsBeside && this->Lengths[k] > 0.0 && this->Lengths[k] < longest)
      {
        this->Mean += this->Lengths[k];
        ++count;
      }
    }
    this->Mean /= std::max(count, 1);
  }
};

using Lengths = std::array<double, StepsInWindow - 1>;

/// How many units a length is.
double UnitsIn(double length, double unit)
{
  return static_cast<int>(std::min(std::max(1.0, length / unit), MostUnits) + 0.5);
}

/// A unit by least squares, of the lengths that are nearly multiples of a first guess.
double FitUnit(const Lengths& lengths, double unit)
{
  double products = 0.0, squares = 0.0;
  for (const double length : lengths)
  {
    const double n = UnitsIn(length, unit);
    if (std::abs(length / unit - n) < 0.25)
    {
      products += n * length;
      squares += n * n;
    }
  }
  return squares > 0.0 ? products / squares : unit;
}

/// Whether lengths are multiples of a unit, but a few.
bool AreMultiples(const Lengths& lengths, double unit)
{
  Lengths off;
  std::transform(lengths.begin(), lengths.end(), off.begin(),
    [unit](double length) { return std::abs(length / unit - UnitsIn(length, unit)); });
  const double most = UnitOff * UnitOff * static_cast<double>(off.size() - MostOff);
  if (std::count_if(off.begin(), off.end(), [most](double x) { return x * x >= most; }) > MostOff)
  {
    return false; // as nearly always
  }
  std::sort(off.begin(), off.end());
  return std::inner_product(off.begin(), off.end() - MostOff, off.begin(), 0.0) < most;
}

/// The length of which all lengths but that in the middle and a few are multiples; 0 if there is
/// none.
double UnitOf(const Line& line)
{
  Lengths lengths;
  const auto middle = std::copy_n(line.Lengths.begin(), StepsBeside, lengths.begin());
  std::copy_n(line.Lengths.begin() + (StepsBeside + 1), StepsBeside, middle);
  double shortest = std::numeric_limits<double>::infinity();
  for (const double length : lengths)
  {
    shortest = length > ShortestStep * line.Mean ? std::min(shortest, length) : shortest;
  }
  for (int parts = 1; parts <= MostParts && std::isfinite(shortest); ++parts)
  {
    const double unit = FitUnit(lengths, FitUnit(lengths, shortest / parts));
    if (AreMultiples(lengths, unit))
    {
      return unit;
    }
  }
  return 0.0;
}

/// What is off along a line and across it, together. (std::hypot would need glibc 2.35.)
double OffBoth(double x, double y)
{
  return std::sqrt(x * x + y * y);
}

/// Distance of steps from the line along which they are, and how far their length is from the mean.
SeenSteps SeeAligned(const Line& line)
{
  SeenSteps seen;
  seen.IsValid = line.Mean > 0.0;
  const double perLength = seen.IsValid ? 1.0 / line.Mean : 0.0;
  const double weight = AcrossWeight * perLength;
  for (int k = 0; k < StepsInWindow; ++k)
  {
    const double length = perLength * line.Lengths[k];
    seen.Off[k] =
      OffBoth(weight * line.Across[k], std::max({ 0.0, -length, length - LongestStep }));
  }
  const double length = perLength * line.Lengths[StepsBeside];
  seen.MiddleOff =
    weight * line.Across[StepsBeside] * line.Normal + AlongWeight * (length - 1.0) * line.Along;
  return seen;
}

/// Distance of steps from multiples of a unit along a line.
SeenSteps SeeMultiples(const Line& line)
{
  const double unit = UnitOf(line);
  SeenSteps seen;
  seen.IsValid = unit > 0.0;
  const double perUnit = seen.IsValid ? 1.0 / unit : 0.0;
  for (int k = 0; k < StepsInWindow; ++k)
  {
    const double length = perUnit * line.Lengths[k];
    const double n = UnitsIn(length, 1.0);
    // Lines may be bent: what is off across counts where the jump is, and elsewhere less.
    const double across = line.Across[k] * (k == StepsBeside ? perUnit : 1.0 / line.Mean);
    seen.Off[k] = OffBoth(across, length - n);
    if (k == StepsBeside)
    {
      seen.MiddleOff = across * line.Normal + (length - n) * line.Along;
    }
  }
  seen.Along = line.Along;
  seen.Unit = unit;
  return seen;
}

StepVectors StepsFrom(const Eigen::Vector3d& place, const ScanWindow& window)
{
  StepVectors steps;
  Eigen::Vector3d last = UnitOf(window.Points[0] - place);
  for (int k = 0; k < StepsInWindow; ++k)
  {
    const Eigen::Vector3d next = UnitOf(window.Points[k + 1] - place);
    steps[k] = next - last;
    last = next;
  }
  return steps;
}
}

SeenSteps SeenFrom(const Eigen::Vector3d& place, const ScanWindow& window, Steps are)
{
  const StepVectors steps = StepsFrom(place, window);
  if (are == Steps::Alike)
  {
    return SeeAlike(steps);
  }
  const Line line(steps, (0.5 * (window.Before() + window.Behind()) - place).normalized());
  return are == Steps::Aligned ? SeeAligned(line) : SeeMultiples(line);
}

bool SeenSteps::AreRegular(double part) const
{
  const auto off =
    std::count_if(this->Off.begin(), this->Off.end(), [&](double step) { return !(step < part); });
  return this->IsValid && off <= MostOff;
}

bool SeenSteps::Agree(double part) const
{
  return this->Off[StepsBeside] < part && this->AreRegular(part);
}
}
