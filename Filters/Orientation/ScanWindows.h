// SPDX-License-Identifier: BSD-3-Clause
/**
 * Windows of consecutive points of a scan, and what they tell of the place of the scanner. A
 * scanner measures in steps of nearly the same angle, also where the surface ends and what is
 * behind it begins: seen from the scanner, and only from there, a jump in space is a step like its
 * neighbours. (Ours. Noise of the range does not matter: it is along the line of sight.)
 */
#pragma once

#include <Eigen/Core>

#include "vtkType.h"

#include <array>
#include <vector>

class vtkPoints;

namespace SurfelGeometry
{
/// So many steps on either side of the one in the middle.
constexpr int StepsBeside = 6;
constexpr int StepsInWindow = 2 * StepsBeside + 1;

struct ScanWindow
{
  std::array<Eigen::Vector3d, StepsInWindow + 1> Points; ///< relative to a common origin
  vtkIdType Middle = 0;                                  ///< id of the point before the middle step
  bool Jumps = false; ///< the step in the middle is ten times as long as those beside it

  const Eigen::Vector3d& Before() const { return this->Points[StepsBeside]; }
  const Eigen::Vector3d& Behind() const { return this->Points[StepsBeside + 1]; }
};

/// What the steps of a window are, seen from a place: differences of the directions to its points.
struct SeenSteps
{
  std::array<double, StepsInWindow> Off; ///< distance from their median over its length
  Eigen::Vector3d MiddleOff;             ///< the same of the step in the middle, as a vector
  bool IsValid = false;                  ///< the median is not 0

  /// Whether three quarters of the steps are off by less than a part of their median.
  bool AreRegular(double part) const;

  /// Whether that holds, and for the step in the middle as well.
  bool Agree(double part) const;
};

SeenSteps SeenFrom(const Eigen::Vector3d& place, const ScanWindow& window);

/// Windows about jumps, and as many about other steps if there are so many, in the order of the
/// points; none if the points do not jump. Points that are not finite are left out beforehand:
/// scanners leave them where nothing came back.
/// @param origin what all points are relative to: the first finite point
/// @param most   number of windows of each kind, at most about so many
std::vector<ScanWindow> FindWindows(vtkPoints* points, Eigen::Vector3d& origin, int most);
}
