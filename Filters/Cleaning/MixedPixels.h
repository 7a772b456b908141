// SPDX-License-Identifier: BSD-3-Clause
/**
 * Mixed pixels of laser scanners: where the beam meets an edge, the measured distance is a mean of
 * those of the edge and of what is behind it. Such points hang in curtains between both, one per
 * line of the scan, at random depths: each is farther from its neighbours than the points of the
 * surfaces beside it are, and few of its neighbours' planes contain it. That holds at some ends of
 * twigs and rims of leaves, too. So only points that know their scanner are looked at: beside the
 * line of sight of a mixed pixel there is something nearer and something farther, and less at its
 * own depth. (pcl::ShadowPoints removes points whose normal is across the line of sight. That holds
 * for a floor seen at a grazing angle, too.)
 */
#pragma once

#include "Filters/Common/StageProgress.h"

#include <vector>

class vtkDataArray;

namespace SurfelGeometry
{
struct SearchedCloud;

/// @param distances [n] mean distance to the nearest StrayNeighbors points, world units
/// @param toScanner vectors from the input's points to their scanners; null: none is known
/// @param stray [n] set to 1 for mixed pixels; what is 1 already is not looked at
/// Returns false if stopped.
bool FindMixedPixels(const SearchedCloud& searched, const std::vector<float>& distances,
  vtkDataArray* toScanner, const StageProgress& progress, std::vector<unsigned char>& stray);
}
