// SPDX-License-Identifier: BSD-3-Clause
/**
 * Data of a hierarchy that a mapper keeps from frame to frame: bounds of its clusters for choosing
 * the level of detail, and colours and leaf covariances of its nodes. Internal to the module.
 */
#pragma once

#include "Core/Base/Executor.h"
#include "Core/Hierarchy/ClusterBounds.h"
#include "Core/Hierarchy/NodeColors.h"
#include "Core/Surfels/SurfelCloud.h"

#include <vtkType.h>

#include <cstdint>
#include <string>
#include <vector>

class vtkPolyData;
class vtkDataArray;

namespace SurfelSplatting
{
class HierarchyCache
{
public:
  /// Whether the input declares that it is a hierarchy (field array Arrays::Leaves).
  static bool IsHierarchy(vtkPolyData* input);

  /**
   * Points the cloud, whose surfel arrays are set, to the hierarchy's nodes, cluster bounds and
   * colours. Computes the last two again only if the input or its colours have changed. Returns an
   * empty string, or what is wrong with the input and what to do.
   * @param colors   of all surfels, or null
   * @param paperCut whether the paper's rule chooses the level of detail; it needs leaf covariances
   */
  std::string Update(vtkPolyData* input, vtkDataArray* colors, bool paperCut,
    const Executor& executor, SurfelCloud& cloud);

  /// Number of surfels whose cluster bounds or colours were computed, in all updates together.
  std::uint64_t NumberOfPreparedSurfels() const { return this->PreparedSurfels; }

private:
  /// An object in a certain state. No MTime is ever given twice.
  struct State
  {
    const void* Object = nullptr;
    vtkMTimeType Time = 0;
    bool operator==(const State& other) const
    {
      return this->Object == other.Object && this->Time == other.Time;
    }
  };

  State InputState, ColorState;
  ClusterBounds Bounds;
  std::vector<NodeColor> Colors;
  std::vector<float> LeafCovariances;
  bool HasColors = false;
  std::uint64_t PreparedSurfels = 0;
};
}
