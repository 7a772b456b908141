// SPDX-License-Identifier: BSD-3-Clause
/**
 * One orientation for the points of all ranks: which side of a component is its outside cannot be
 * told by a part of it.
 *
 * Every rank fits the points of its region; rank 0 gets their fits and neighbours, and orients all
 * of them as one process would (OrientConsistently), in the same order. All the rest of the
 * estimation is shared out.
 */
#pragma once

#include "Filters/Orientation/Orientation.h"

#include "Core/Base/Ranks.h"

#include <vector>

namespace SurfelGeometry
{
class PartitionedCloud;

/// Memory that rank 0 takes for a point of the whole cloud, as long as it orients.
constexpr double OrientationBytesPerPoint = 400.0;

class SharedOrientation
{
public:
  /// Both must outlive this.
  SharedOrientation(SurfelSplatting::Ranks& ranks, const PartitionedCloud& cloud)
    : Group(ranks)
    , Dealt(cloud)
  {
  }

  /// Of the dealt points.
  const double* Origin() const;

  /// Collective: whether all ranks say so.
  bool All(bool mine) { return this->Group.All(mine); }

  /**
   * Collective. OrientConsistently for the points that were dealt to this rank.
   * @param cloud of the dealt points: its input ids are theirs
   * @param settings the viewpoint relative to the dealt cloud's origin
   */
  bool Orient(const LocalCloud& cloud, const NeighborGraph& graph,
    const OrientationSettings& settings, const StageProgress& monitor, std::vector<PlaneFit>& fits,
    Sidedness& sides);

private:
  std::vector<SurfelSplatting::Message> OrientAll(std::vector<SurfelSplatting::Message> messages,
    const OrientationSettings& settings, const StageProgress& monitor) const;

  SurfelSplatting::Ranks& Group;
  const PartitionedCloud& Dealt;
};
}
