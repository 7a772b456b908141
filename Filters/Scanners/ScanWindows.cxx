// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Scanners/ScanWindows.h"

#include "Filters/Common/Median.h"
#include "Filters/Common/ParallelFor.h"
#include "Filters/Scanners/BeamOrder.h"

#include <Eigen/Geometry>

#include "vtkPoints.h"

#include <algorithm>
#include <cmath>

namespace SurfelGeometry
{
namespace
{
/// A step is a jump if it is so many times as long as the median of those beside it, and half as
/// many times as long as either of the next ones.
constexpr double JumpFactor = 10.0;

/// Points are looked at in parts, so that a few of them are in memory at a time.
constexpr vtkIdType PointsInPart = 1 << 13;

/// About so many points are looked at first, and the others only if jumps are there. Where nothing
/// jumps in the order in which points are stored, few are of several beams.
constexpr vtkIdType PointsToProbe = 1 << 18, PointsOfBeamsToProbe = 1 << 15;

using Positions = std::vector<Eigen::Vector3d>;

/// The finite points of a part and their ids.
struct Part
{
  Positions Points;
  std::vector<vtkIdType> Ids;
};

Part Reordered(const Part& part, const std::vector<std::size_t>& order)
{
  Part ordered;
  for (const std::size_t i : order)
  {
    ordered.Points.push_back(part.Points[i]);
    ordered.Ids.push_back(part.Ids[i]);
  }
  return ordered;
}

Part ReadPart(vtkPoints* points, const Eigen::Vector3d& origin, vtkIdType begin, vtkIdType end,
  PointOrder order)
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
  return order == PointOrder::ByBeams ? Reordered(part, OrderByBeams(part.Points)) : part;
}

/// Median of steps of a window, by coordinates.
Eigen::Vector3d MedianStep(const ScanWindow& window, int begin)
{
  Eigen::Vector3d median;
  for (int c = 0; c < 3; ++c)
  {
    std::array<double, StepsBeside> steps;
    for (int k = 0; k < StepsBeside; ++k)
    {
      steps[k] = window.Points[begin + k + 1][c] - window.Points[begin + k][c];
    }
    median[c] = Median(steps);
  }
  return median;
}

/// A scanner goes on beyond a jump in the direction it came from, in steps as much longer as what
/// it sees is farther away: 0 where it does not, as between the end of a line and the next one.
double RatioOf(const ScanWindow& window)
{
  const Eigen::Vector3d d = (window.Behind() - window.Before()).normalized();
  const auto across = [&](int begin) -> Eigen::Vector3d {
    const Eigen::Vector3d step = MedianStep(window, begin);
    return step - step.dot(d) * d;
  };
  const Eigen::Vector3d before = across(0), behind = across(StepsBeside + 1);
  const double least = 0.5; // cosine
  return before.dot(behind) > least * before.norm() * behind.norm() ? behind.norm() / before.norm()
                                                                    : 0.0;
}

ScanWindow WindowAt(const Part& part, std::size_t middle, bool jumps)
{
  ScanWindow window;
  std::copy_n(
    part.Points.begin() + (middle - StepsBeside), StepsInWindow + 1, window.Points.begin());
  window.Middle = part.Ids[middle];
  window.Jumps = jumps;
  window.Ratio = jumps ? RatioOf(window) : 0.0;
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
    if (IsJump(steps, k) && RatioOf(WindowAt(part, k, true)) > 0.0)
    {
      jumps.push_back(k);
    }
  }
  Thin(jumps, most);
  const std::size_t whole = end - StepsBeside, count = std::min(most, whole);
  for (std::size_t i = 0; i < count; ++i)
  {
    others.push_back(StepsBeside + i * whole / count);
  }
  std::vector<ScanWindow> windows;
  for (std::size_t i = 0, k = 0; i < jumps.size() || k < others.size();)
  {
    const bool isJump = k == others.size() || (i < jumps.size() && jumps[i] <= others[k]);
    windows.push_back(WindowAt(part, isJump ? jumps[i++] : others[k++], isJump));
  }
  std::stable_sort(windows.begin(), windows.end(),
    [](const ScanWindow& a, const ScanWindow& b) { return a.Middle < b.Middle; });
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

std::vector<ScanWindow> FindWindows(
  vtkPoints* points, PointOrder order, Eigen::Vector3d& origin, int most)
{
  origin = FirstFinite(points);
  const vtkIdType count = points->GetNumberOfPoints();
  const vtkIdType parts = (count + PointsInPart - 1) / PointsInPart;
  const auto inPart =
    static_cast<std::size_t>(std::max<vtkIdType>(4, most / std::max<vtkIdType>(parts, 1)));
  const vtkIdType toProbe = order == PointOrder::ByBeams ? PointsOfBeamsToProbe : PointsToProbe;
  const vtkIdType perProbe = std::max<vtkIdType>(1, count / toProbe);
  std::vector<std::vector<ScanWindow>> found(parts);
  const auto look = [&](vtkIdType part) {
    const vtkIdType begin = part * PointsInPart, end = std::min(count, begin + PointsInPart);
    found[part] = WindowsOf(ReadPart(points, origin, begin, end, order), inPart);
  };
  for (const bool isFirst : { true, false })
  {
    ParallelFor(0, parts, 1, [&](vtkIdType part, vtkIdType end) {
      for (; part < end; ++part)
      {
        if ((part % perProbe == 0) == isFirst)
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
