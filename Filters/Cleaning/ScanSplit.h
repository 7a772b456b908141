// SPDX-License-Identifier: BSD-3-Clause
/**
 * Where the second of two scans begins in a cloud. Where their sheets lie over one another, the
 * order of the points tells which sheet is whose, because scans are appended. At samples a quadric
 * through the neighbours has points above and below; the id that explains these sides best, by the
 * mean squared correlation, is where the second scan begins.
 */
#pragma once

#include "Filters/Common/IdType.h"

#include <vector>

namespace SurfelGeometry
{
struct CleaningProblem;
struct SampledColors;

struct ScanSplit
{
  vtkIdType First = 0;    // of the second scan, by LocalCloud::SampleId
  double Explained = 0.0; // mean squared correlation of side and scan, 0 to 1; at random 1/64
};

/// Collective, if several processes clean the cloud.
/// @param samples of this process
/// @param running false: this process was stopped
/// @param split explains nothing where surfaces are clean, or their sheets differ in colour
/// Returns false if a process was stopped.
bool FindScanSplit(const CleaningProblem& problem, const std::vector<int>& samples,
  const SampledColors& colors, bool running, ScanSplit& split);
}
