// SPDX-License-Identifier: BSD-3-Clause
/**
 * Windows of consecutive points of a scan, which tell of the place of the scanner. A scanner
 * measures in steps of nearly the same angle, also where the surface ends and what is behind it
 * begins: seen from the scanner, and only from there, a jump in space is a step like its
 * neighbours. (Ours. Noise of the range does not matter: it is along the line of sight.)
 */
#pragma once

#include "Filters/Common/IdType.h"

#include <Eigen/Core>

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
  /// Of a jump: how many times as far from a scanner the point behind it is as that before it, by
  /// the lengths of the steps on either side across the jump; 0 if these are no way of a scanner.
  double Ratio = 0.0;

  const Eigen::Vector3d& Before() const { return this->Points[StepsBeside]; }
  const Eigen::Vector3d& Behind() const { return this->Points[StepsBeside + 1]; }
};

/// Windows are of points as they are stored, or beam by beam (BeamOrder.h).
enum class PointOrder
{
  AsStored,
  ByBeams
};

/// Windows about jumps, and as many about other steps if there are so many, in the order of the
/// points; none if the points do not jump. Points that are not finite are left out beforehand:
/// scanners leave them where nothing came back.
/// @param origin what all points are relative to: the first finite point
/// @param most   about how many windows there are of each kind, at most; of more than `most` times
///               2000 points four for each 8192
std::vector<ScanWindow> FindWindows(
  vtkPoints* points, PointOrder order, Eigen::Vector3d& origin, int most);
}
