// SPDX-License-Identifier: BSD-3-Clause
/**
 * Reorders the point arrays of surfels like the leaves of a hierarchy.
 */
#pragma once

#include "Core/Base/Executor.h"

#include <cstdint>
#include <vector>

class vtkPolyData;

namespace SurfelGeometry
{
/// Where tuples are from.
using TupleOrder = std::vector<std::uint32_t>;

/// Passes all point arrays in the order of the leaves; active attributes stay active.
/// @param input   with one value for each point in all arrays (WithFittingArrays)
/// @param surfels [leaves] tuples of the arrays of a SurfelOutput
/// @param points  [leaves] tuples of the others
void PassLeafAttributes(vtkPolyData* input, const TupleOrder& surfels, const TupleOrder& points,
  const SurfelSplatting::Executor& executor, vtkPolyData* output);
}
