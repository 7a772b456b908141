// SPDX-License-Identifier: BSD-3-Clause
/**
 * Reorders the point arrays of surfels like the leaves of a hierarchy.
 */
#pragma once

#include "Core/Base/Executor.h"
#include "Core/Hierarchy/KdTreeOrder.h"

class vtkPolyData;

namespace SurfelGeometry
{
/// Passes all point arrays in the order of the leaves; active attributes stay active.
void PassLeafAttributes(vtkPolyData* input, const SurfelSplatting::KdTreeOrder& order,
  const SurfelSplatting::Executor& executor, vtkPolyData* output);
}
