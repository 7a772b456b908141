// SPDX-License-Identifier: BSD-3-Clause
/**
 * Points that belong to no surface: dust, reflections, birds, halos and mixed pixels
 * (HangingPoints.h).
 *
 * The measure is that of pcl::StatisticalOutlierRemoval (Rusu et al. 2008, "Towards 3D point cloud
 * based object maps"): the mean distance of a point to its nearest neighbours. PCL compares it with
 * the mean of the whole cloud plus some standard deviations. That bound removes the sparse half of
 * a scan whose density changes, and 5 % of stray points move it beyond themselves. Here a point is
 * compared with its own neighbours; only points that have no surface about them are compared with
 * the median of the cloud, and with the nearest surfaces.
 */
#pragma once

#include "Filters/Common/StageProgress.h"

#include <vector>

class vtkDataArray;

namespace SurfelGeometry
{
struct CleaningProblem;

/// Collective, if several processes clean the cloud.
/// @param toScanner vectors from the input's points to their scanners; null: none is known
/// @param stray [n] 1 for stray points
/// Returns false if stopped.
bool FindStrayPoints(const CleaningProblem& problem, vtkDataArray* toScanner,
  const StageProgress& progress, std::vector<unsigned char>& stray);
}
