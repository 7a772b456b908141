// SPDX-License-Identifier: BSD-3-Clause
/**
 * Surfels of points that are distributed over several ranks: how wide the halo of a region must be,
 * and how the surfels get into each rank's output.
 */
#pragma once

#include "Filters/Partition/PartitionedCloud.h"

#include <functional>

namespace SurfelGeometry
{
/// Whether the neighbourhood of a surfel of this area may reach farther than this distance, world
/// units.
bool MayReachBeyond(double area, double distance);

/// Width of a halo at first, in spacings.
constexpr double HaloSpacings = 16.0;

/// A halo is widened, this many times at most, while more than this share of the surfels may have
/// neighbours beyond it.
constexpr int MaximumWidenings = 3;
constexpr double ToleratedShare = 1e-3;

/**
 * Collective. Lets `work` make surfels of this rank's region, again with a wider halo if that of
 * any rank was too narrow.
 * @param haloWidth initial width, world units
 * @param work      points -> surfels with PartitionedCloud::IdArray; null if it was stopped
 * @return the last surfels; null on all ranks if one was stopped
 */
vtkSmartPointer<vtkPolyData> WorkOnRegion(SurfelSplatting::Ranks& ranks, PartitionedCloud& cloud,
  const std::vector<PartitionedCloud::Array>& arrays, double haloWidth,
  const std::function<vtkSmartPointer<vtkPolyData>(vtkPolyData*)>& work);

/// Collective. Writes the surfels of all regions to the output of the rank that has their points,
/// in the order of its input, with its point data. @return the number of this rank's surfels
vtkIdType WritePartitionedSurfels(SurfelSplatting::Ranks& ranks, PartitionedCloud& cloud,
  vtkPolyData* surfels, vtkPointSet* input, vtkPolyData* output);

/// Collective. The same for the area vectors only, for an output that is a copy of the input;
/// points without a result keep theirs.
void WritePartitionedAreas(SurfelSplatting::Ranks& ranks, PartitionedCloud& cloud,
  vtkPolyData* surfels, vtkPolyData* output);
}
