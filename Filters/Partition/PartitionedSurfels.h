// SPDX-License-Identifier: BSD-3-Clause
/**
 * Surfels of points that were dealt out to several ranks: how wide a region's border has to be, and
 * the way back into each rank's output.
 */
#pragma once

#include "Filters/Partition/PartitionedCloud.h"

#include <functional>

namespace SurfelGeometry
{
/// Whether a neighbourhood about a surfel of this area may reach farther than this, world units.
bool IsDoubtful(double area, double reach);

/// First width of a border, in spacings.
constexpr double BorderSpacings = 16.0;

/// Borders are widened up to so often, where more than this share of the surfels might reach
/// beyond.
constexpr int MostWidenings = 3;
constexpr double LeastDoubt = 1e-3;

/**
 * Collective. Lets `work` make surfels of this rank's region, and again with a wider border where
 * that of any rank was too narrow.
 * @param margin  of the first border, at least, world units
 * @param work    dealt points -> surfels with PartitionedCloud::IdArray; null where it was stopped
 * @return the last surfels; null on all ranks where one was stopped
 */
vtkSmartPointer<vtkPolyData> WorkOnRegion(SurfelSplatting::Ranks& ranks, PartitionedCloud& cloud,
  const std::vector<PartitionedCloud::Array>& arrays, double margin,
  const std::function<vtkSmartPointer<vtkPolyData>(vtkPolyData*)>& work);

/// Collective. The surfels of each rank's region into the output of the rank whose points they are,
/// in the order of its input, with its point data. @return the number of this rank's surfels
vtkIdType WritePartitionedSurfels(
  PartitionedCloud& cloud, vtkPolyData* surfels, vtkPointSet* input, vtkPolyData* output);

/// Collective. The area vectors of a region's surfels, likewise, for an output that is a copy of
/// the input; points that took no part keep theirs.
void WritePartitionedAreas(PartitionedCloud& cloud, vtkPolyData* surfels, vtkPolyData* output);
}
