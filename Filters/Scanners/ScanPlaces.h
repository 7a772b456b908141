// SPDX-License-Identifier: BSD-3-Clause
/**
 * The places of scanners, of windows of their points (ScanWindows.h): where the lines of jumps
 * meet, and steps are what a scanner makes.
 */
#pragma once

#include "Filters/Scanners/ScanSteps.h"

#include <Eigen/Core>

#include <vector>

namespace SurfelGeometry
{
/// Steps are off by less than this part of a step if they agree with a place.
constexpr double TightSteps = 0.3;

struct ScanPlace
{
  Eigen::Vector3d Place;
  Steps Are; ///< of its scanner: alike, or multiples
};

/// The places of all scanners, none if there are no such places.
/// @param size of most points: far returns would make all places one
std::vector<ScanPlace> FindPlaces(const std::vector<ScanWindow>& windows, double size);
}
