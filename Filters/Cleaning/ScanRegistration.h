// SPDX-License-Identifier: BSD-3-Clause
/**
 * Two scans of one thing in one cloud, the second a little beside the first (ScanSplit.h). The
 * second one then moves rigidly to the first, by Gauss and Newton's method on the distances along
 * the normals (Chen and Medioni 1992, "Object modelling by registration of multiple range images")
 * and on the differences of the shades (Park, Zhou, Koltun 2017, "Colored point cloud registration
 * revisited").
 *
 * The two sides of a leaf or of a wall in two scans must not be taken for one surface. So the
 * second scan moves only if the colours are the same, if the normals or the colours tell about
 * motions in all directions, and if nothing but the first scan's own noise is left: thickness
 * differs in direction, which no rigid motion explains.
 */
#pragma once

#include "Filters/Cleaning/ScanDistance.h"
#include "Filters/Common/IdType.h"
#include "Filters/Common/StageProgress.h"

#include <optional>
#include <vector>

class vtkPointSet;

namespace SurfelGeometry
{
struct CleaningProblem;

/// Collective, if several processes clean the cloud.
/// @param input has the colours of the cloud's points
/// @param motion of the second scan; empty if there is none, or none that fits
/// Returns false if stopped.
bool FindSecondScan(const CleaningProblem& problem, vtkPointSet* input,
  const StageProgress& progress, std::optional<ScanMotion>& motion);

/// Points of the second scan, after its motion, that are where a point of the first one is.
/// @param twins [n] 1 for these
/// Returns false if stopped.
bool FindTwins(const CleaningProblem& problem, vtkIdType first, const StageProgress& progress,
  std::vector<unsigned char>& twins);
}
