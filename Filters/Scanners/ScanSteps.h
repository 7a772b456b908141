// SPDX-License-Identifier: BSD-3-Clause
/**
 * What the steps of a window of a scan are like, seen from a place: all alike from the place of the
 * scanner, or multiples of a unit where points are missing at random.
 */
#pragma once

#include "Filters/Scanners/ScanWindows.h"

#include <Eigen/Core>

#include <array>

namespace SurfelGeometry
{
/// What a scanner's steps are: all alike; along one line; or multiples of a unit along one line.
/// That they are along one line is less, and tells where the other two are to be sought.
enum class Steps
{
  Alike,
  Aligned,
  Multiples
};

/// How far the steps of a window are off such steps, seen from a place. Steps are differences of
/// the directions to its points.
struct SeenSteps
{
  std::array<double, StepsInWindow> Off; ///< in medians if alike, means if aligned, or units
  Eigen::Vector3d MiddleOff;             ///< the same of the step in the middle, as a vector
  bool IsValid = false;                  ///< the median is not 0, or there is a unit

  Eigen::Vector3d Along{ 0.0, 0.0, 0.0 }; ///< of multiples: the direction of the line
  double Unit = 0.0;                      ///< of multiples

  /// Whether three quarters of the steps are off by less than a part.
  bool AreRegular(double part) const;

  /// Whether that holds, and for the step in the middle as well.
  bool Agree(double part) const;
};

SeenSteps SeenFrom(const Eigen::Vector3d& place, const ScanWindow& window, Steps are);
}
