// SPDX-License-Identifier: BSD-3-Clause
/**
 * What a mapper keeps of its hierarchy from frame to frame: the table for choosing detail, and the
 * colours of the nodes. Internal to the module.
 */
#pragma once

#include "DetailTable.h"
#include "Executor.h"
#include "NodeColors.h"
#include "SurfelCloud.h"

#include <vtkType.h>

#include <cstdint>
#include <string>

class vtkPolyData;
class vtkUnsignedCharArray;

namespace SurfelSplatting
{
class SurfelDetailCache
{
public:
  /// Whether the input says that it is a hierarchy.
  static bool IsHierarchy(vtkPolyData* input);

  /// Leaves of a hierarchy, which come first; all points of other surfels.
  static vtkIdType NumberOfLeaves(vtkPolyData* input);

  /**
   * Points the cloud, whose surfel arrays are set, to the hierarchy's table and colours; makes them
   * anew only where the input or its colours have changed. Returns an empty string, or what is
   * wrong with the input and what to do.
   * @param colors of all nodes (those of the leaves are read), or null
   */
  std::string Update(
    vtkPolyData* input, vtkUnsignedCharArray* colors, const Executor& executor, SurfelCloud& cloud);

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
  DetailTable Table;
  NodeColorArrays Colors;
  bool HasColors = false;
  std::uint64_t PreparedSurfels = 0;
};
}
