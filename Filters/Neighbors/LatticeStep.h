// SPDX-License-Identifier: BSD-3-Clause
/**
 * Recognizes clouds whose points are on a lattice along the axes, such as the centres of voxels in
 * maps of occupancy. A surface between two layers of voxels has points in both.
 */
#pragma once

namespace SurfelGeometry
{
struct LocalCloud;
struct NeighborGraph;

/// The largest of the steps along the three axes of a cloud's lattice, world units; 0 if its points
/// are on none. Lattices that are finer than the spacing count, too.
double LatticeStep(const LocalCloud& cloud, const NeighborGraph& graph);
}
