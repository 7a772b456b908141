// SPDX-License-Identifier: BSD-3-Clause
/**
 * Arrays of surfels in the order of a hierarchy's leaves.
 */
#pragma once

#include "Core/Base/Executor.h"
#include "Core/Hierarchy/KdTreeOrder.h"

class vtkPolyData;

namespace SurfelGeometry
{
/// Passes all point arrays on, in the order of the leaves, as the attributes that they were.
void PassLeafAttributes(vtkPolyData* input, const SurfelSplatting::KdTreeOrder& order,
  const SurfelSplatting::Executor& executor, vtkPolyData* output);
}
