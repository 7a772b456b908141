// SPDX-License-Identifier: BSD-3-Clause
/**
 * Orients the points of all ranks together: the outside of a component cannot be decided from a
 * part of it.
 *
 * Every rank fits the points of its region. Rank 0 gets all fits and neighbours and orients them as
 * one process would (OrientConsistently), in the same order. Each rank does the rest of the
 * estimation for its region.
 */
#pragma once

#include "Filters/Orientation/Orientation.h"

#include "Core/Base/Ranks.h"

#include <functional>
#include <vector>

namespace SurfelGeometry
{
class PartitionedCloud;

/// Memory that rank 0 takes while it orients, bytes per point of the whole cloud.
constexpr double OrientationBytesPerPoint = 400.0;

class SharedOrientation
{
public:
  /// Both must outlive this.
  SharedOrientation(SurfelSplatting::Ranks& ranks, const PartitionedCloud& cloud)
    : Group(ranks)
    , Partition(cloud)
  {
  }

  /// Origin of the distributed points.
  const double* Origin() const;

  /// Collective: whether the work of each rank succeeds. If one lacks memory for it, all throw.
  bool All(const std::function<bool()>& work);

  /**
   * Collective. OrientConsistently for the points of this rank's region and halo.
   * @param cloud    made from the fetched points: its input ids are their indices
   * @param settings with the viewpoint relative to Origin()
   */
  bool Orient(const LocalCloud& cloud, const NeighborGraph& graph, const OutsideSettings& settings,
    const StageProgress& progress, PlaneFits& fits, OrientationResult& result);

private:
  SurfelSplatting::Message PackRegion(const LocalCloud& cloud, const NeighborGraph& graph,
    const PlaneFits& fits, const std::vector<float>& facings) const;
  std::vector<SurfelSplatting::Message> OrientAll(std::vector<SurfelSplatting::Message> messages,
    const OutsideSettings& settings, const StageProgress& progress) const;

  SurfelSplatting::Ranks& Group;
  const PartitionedCloud& Partition;
};
}
