// SPDX-License-Identifier: BSD-3-Clause
/**
 * Copies of points that are not at the very place of the first one: two files of one scan of which
 * one has fewer digits, the strongest and the last return of each pulse. Such pairs leave the
 * spacing, the planes and the kernels of a surface to chance, so that it has holes.
 */
#pragma once

#include "Filters/Common/StageProgress.h"

#include <vector>

class vtkDataArray;

namespace SurfelGeometry
{
struct CleaningProblem;

/// Finds copies if the cloud has more of them than chance. Collective, if several processes clean
/// the cloud.
/// @param normals of the input, or null: points that turn their backs to each other are two sides
/// @param copies  [n] 1 for all but the first of each
/// Returns false if stopped.
bool FindNearCopies(const CleaningProblem& problem, vtkDataArray* normals,
  const StageProgress& progress, std::vector<unsigned char>& copies);
}
