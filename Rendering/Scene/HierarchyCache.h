// SPDX-License-Identifier: BSD-3-Clause
/**
 * What a mapper keeps of its hierarchy from frame to frame: the table for choosing detail, and
 * colours and leaf covariances of the nodes. Internal to the module.
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
  /// Whether the input says that it is a hierarchy.
  static bool IsHierarchy(vtkPolyData* input);

  /**
   * Points the cloud, whose surfel arrays are set, to the hierarchy's nodes, table and colours;
   * makes the last two anew only where the input or its colours have changed. Returns an empty
   * string, or what is wrong with the input and what to do.
   * @param colors of all surfels, or null
   * @param paper whether the paper's rule is to choose, which needs more
   */
  std::string Update(vtkPolyData* input, vtkDataArray* colors, bool paper, const Executor& executor,
    SurfelCloud& cloud);

  /// Surfels that tables and colours were made of, in all updates together.
  std::uint64_t NumberOfPreparedSurfels() const { return this->PreparedSurfels; }

private:
  /// An object in a certain state. MTimes are never given twice.
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
  ClusterBounds Table;
  std::vector<NodeColor> Colors;
  std::vector<float> LeafCovariances;
  bool HasColors = false;
  std::uint64_t PreparedSurfels = 0;
};
}
