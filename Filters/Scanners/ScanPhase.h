// SPDX-License-Identifier: BSD-3-Clause
/**
 * Where points of a scan are missing at random, its jumps are multiples of the unit of the steps
 * beside them, seen from the scanner. Which multiples is unknown, so this has many maxima: they are
 * looked at one after another, along one axis at a time.
 */
#pragma once

#include "Filters/Scanners/ScanSteps.h"

#include <Eigen/Core>

#include <vector>

namespace SurfelGeometry
{
/// Moves a place along an axis to where most jumps are multiples; false if they are so nowhere.
/// @param axis  0: along which the place is known least by how far jumps are off their lines; 2:
/// best
/// @param reach how far at most
bool FindPhase(
  const std::vector<const ScanWindow*>& jumps, int axis, double reach, Eigen::Vector3d& place);
}
