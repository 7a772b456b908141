// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Orientation/ScanWindows.h"

#include "Filters/Common/Median.h"

#include <Eigen/Geometry>

#include "vtkPoints.h"
#include "vtkSMPTools.h"

#include <algorithm>
#include <cmath>

namespace SurfelGeometry
{
namespace
{
/// A step is a jump if it is so many times as long as the median of those beside it, and half as
/// many times as long as either of the next ones.
constexpr double JumpFactor = 10.0;

/// The share of the steps of a window that may be off: others jump as well, or were left out.
constexpr int MostOff = StepsInWindow / 4;

/// Fewer jumps than one in so many steps are chance: points are in no order, or those of a surface
/// without an end.
constexpr std::size_t StepsPerJump = 10000;

/// Points are looked at in parts, so that a few of them are in memory at a time.
constexpr vtkIdType PointsInPart = 1 << 16;

/// One of so many parts is looked at first, and the others only if jumps are there.
constexpr vtkIdType PartsPerProbe = 8;

using Positions = std::vector<Eigen::Vector3d>;

/// The finite points of a part and their ids.
struct Part
{
  Positions Points;
  std::vector<vtkIdType> Ids;
};

Part ReadPart(vtkPoints* points, const Eigen::Vector3d& origin, vtkIdType begin, vtkIdType end)
{
  Part part;
  for (vtkIdType i = begin; i < end; ++i)
  {
    Eigen::Vector3d p;
    points->GetPoint(i, p.data());
    p -= origin;
    if (p.allFinite())
    {
      part.Points.push_back(p);
      part.Ids.push_back(i);
    }
  }
  return part;
}

ScanWindow WindowAt(const Part& part, std::size_t middle, bool jumps)
{
  ScanWindow window;
  std::copy_n(
    part.Points.begin() + (middle - StepsBeside), StepsInWindow + 1, window.Points.begin());
  window.Middle = part.Ids[middle];
  window.Jumps = jumps;
  return window;
}

/// @param steps lengths of the part's steps
bool IsJump(const std::vector<double>& steps, std::size_t k)
{
  const double most = std::max(steps[k - 1], steps[k + 1]);
  if (!(steps[k] > 0.5 * JumpFactor * most && most > 0.0))
  {
    return false;
  }
  std::array<double, StepsInWindow - 1> beside;
  std::copy_n(steps.begin() + (k - StepsBeside), StepsBeside, beside.begin());
  std::copy_n(steps.begin() + (k + 1), StepsBeside, beside.begin() + StepsBeside);
  return steps[k] > JumpFactor * Median(beside);
}

/// Leaves about so many of them, evenly.
void Thin(std::vector<std::size_t>& places, std::size_t most)
{
  if (places.size() > most)
  {
    for (std::size_t i = 0; i < most; ++i)
    {
      places[i] = places[i * places.size() / most];
    }
    places.resize(most);
  }
}

std::vector<ScanWindow> WindowsOf(const Part& part, std::size_t most)
{
  const Positions& p = part.Points;
  if (p.size() < 2 * StepsInWindow)
  {
    return {};
  }
  std::vector<double> steps(p.size() - 1);
  for (std::size_t k = 0; k < steps.size(); ++k)
  {
    steps[k] = (p[k + 1] - p[k]).norm();
  }
  const std::size_t end = steps.size() - StepsBeside;
  std::vector<std::size_t> jumps, others;
  for (std::size_t k = StepsBeside; k < end; ++k)
  {
    if (IsJump(steps, k))
    {
      jumps.push_back(k);
    }
  }
  if (jumps.size() * StepsPerJump < steps.size())
  {
    jumps.clear();
  }
  Thin(jumps, most);
  for (std::size_t i = 0; i < most; ++i)
  {
    others.push_back(StepsBeside + i * (end - StepsBeside) / most);
  }
  std::vector<ScanWindow> windows;
  for (std::size_t i = 0, k = 0; i < jumps.size() || k < others.size();)
  {
    const bool isJump = k == others.size() || (i < jumps.size() && jumps[i] <= others[k]);
    windows.push_back(WindowAt(part, isJump ? jumps[i++] : others[k++], isJump));
  }
  return windows;
}

bool HasJumps(const std::vector<ScanWindow>& windows)
{
  return std::any_of(
    windows.begin(), windows.end(), [](const ScanWindow& window) { return window.Jumps; });
}

Eigen::Vector3d FirstFinite(vtkPoints* points)
{
  Eigen::Vector3d p(0.0, 0.0, 0.0);
  for (vtkIdType i = 0; i < points->GetNumberOfPoints(); ++i)
  {
    points->GetPoint(i, p.data());
    if (p.allFinite())
    {
      return p;
    }
  }
  return Eigen::Vector3d::Zero();
}
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

SeenSteps SeenFrom(const Eigen::Vector3d& place, const ScanWindow& window)
{
  std::array<Eigen::Vector3d, StepsInWindow> steps;
  Eigen::Vector3d last = (window.Points[0] - place).normalized();
  for (int k = 0; k < StepsInWindow; ++k)
  {
    const Eigen::Vector3d next = (window.Points[k + 1] - place).normalized();
    steps[k] = next - last;
    last = next;
  }
  Eigen::Vector3d median;
  for (int c = 0; c < 3; ++c)
  {
    std::array<double, StepsInWindow> coordinates;
    std::transform(steps.begin(), steps.end(), coordinates.begin(),
      [c](const Eigen::Vector3d& step) { return step[c]; });
    median[c] = Median(coordinates);
  }
  const double length = median.norm();
  SeenSteps seen;
  seen.IsValid = length > 0.0;
  const double perLength = seen.IsValid ? 1.0 / length : 0.0;
  std::transform(steps.begin(), steps.end(), seen.Off.begin(),
    [&](const Eigen::Vector3d& step) { return perLength * (step - median).norm(); });
  seen.MiddleOff = perLength * (steps[StepsBeside] - median);
  return seen;
}

std::vector<ScanWindow> FindWindows(vtkPoints* points, Eigen::Vector3d& origin, int most)
{
  origin = FirstFinite(points);
  const vtkIdType count = points->GetNumberOfPoints();
  const vtkIdType parts = (count + PointsInPart - 1) / PointsInPart;
  const auto inPart =
    static_cast<std::size_t>(std::max<vtkIdType>(16, most / std::max<vtkIdType>(parts, 1)));
  std::vector<std::vector<ScanWindow>> found(parts);
  const auto look = [&](vtkIdType part) {
    const vtkIdType begin = part * PointsInPart, end = std::min(count, begin + PointsInPart);
    found[part] = WindowsOf(ReadPart(points, origin, begin, end), inPart);
  };
  for (const bool isFirst : { true, false })
  {
    vtkSMPTools::For(0, parts, 1, [&](vtkIdType part, vtkIdType end) {
      for (; part < end; ++part)
      {
        if ((part % PartsPerProbe == 0) == isFirst)
        {
          look(part);
        }
      }
    });
    if (std::none_of(found.begin(), found.end(), HasJumps))
    {
      return {};
    }
  }
  std::vector<ScanWindow> windows;
  for (const std::vector<ScanWindow>& part : found)
  {
    windows.insert(windows.end(), part.begin(), part.end());
  }
  return windows;
}
}
