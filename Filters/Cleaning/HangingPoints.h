// SPDX-License-Identifier: BSD-3-Clause
/**
 * Points that hang before surfaces or between them, each farther from its neighbours than the
 * points of the surfaces beside it are, so that few of its neighbours' planes contain it.
 *
 * Photogrammetry has a halo of such points within a few spacings of surfaces, most of all at
 * outlines, where the images that are compared see different things. Beside surfaces their
 * neighbours are in planes, and they are as near to some of them as to each other: so the median of
 * their neighbours' distances says nothing, but the least does. Only clouds with many such
 * points have halos. (Ours.)
 *
 * Mixed pixels are those of laser scanners: where the beam meets an edge, the measured distance is
 * a mean of those of the edge and of what is behind it. They hang in curtains between both, one per
 * line of the scan, at random depths, and may be nearly as dense as the surfaces. That holds at
 * some ends of twigs and rims of leaves, too. So there the line of sight must be known: beside that
 * of a mixed pixel there is something nearer and something farther, and less at its own depth.
 * (pcl::ShadowPoints removes points whose normal is across the line of sight. That holds for a
 * floor seen at a grazing angle, too.)
 */
#pragma once

#include "Filters/Cleaning/PointSpread.h"
#include "Filters/Common/StageProgress.h"

#include <vector>

class vtkDataArray;

namespace SurfelGeometry
{
struct CleaningProblem;
struct LocalCloud;

/// Whether the plane about a point contains the line of sight, and only its own scanner has seen
/// it: a roof seen at a grazing angle is sparse, too. False if the scanner is not known.
/// @param sparse those of its nearest StrayNeighbors points that are as sparse
/// @param spread of all of them
bool IsCurtain(const LocalCloud& cloud, int i, const std::vector<int>& sparse,
  vtkDataArray* toScanner, const PointSpread& spread);

/// Points that tell whether some are in one plane.
constexpr int CurtainPoints = 13;

/// Whether points are in one plane.
bool IsThin(const PointSpread& spread);

/// Loads a point and those of its neighbours that are as sparse, relative to it, up to
/// CurtainPoints. Returns false if they are too few to tell a plane.
/// @param distances [n] mean distance to the nearest points, as many for each, world units
/// @param neighbors the nearest first
bool LoadAsSparse(const LocalCloud& cloud, int i, const std::vector<float>& distances,
  const Neighbors& neighbors, NearCloud& near);

/// Collective, if several processes clean the cloud.
/// @param distances [n] mean distance to the nearest StrayNeighbors points, world units
/// @param toScanner vectors from the input's points to their scanners; null: none is known
/// @param stray [n] set to 1 for hanging points; what is 1 already is not looked at
/// Returns false if stopped, or not running.
bool FindHangingPoints(const CleaningProblem& problem, bool running,
  const std::vector<float>& distances, vtkDataArray* toScanner, const StageProgress& progress,
  std::vector<unsigned char>& stray);
}
