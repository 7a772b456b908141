// SPDX-License-Identifier: BSD-3-Clause
/**
 * Point arrays of a hierarchy's nodes from those of the surfels.
 */
#pragma once

#include "Executor.h"
#include "HierarchyBuilder.h"

class vtkPointData;

namespace SurfelGeometry
{
/**
 * Passes on all arrays of the input that the output has not: leaves keep their values, in the order
 * of the hierarchy; nodes have the area-weighted means, or the first leaf's value where an array
 * holds identifiers or text.
 * @param areas [nodes] sums of the leaves' areas
 */
void PassNodeAttributes(vtkPointData* input, const SurfelSplatting::LeafOrder& order,
  const float* areas, const SurfelSplatting::Executor& executor, vtkPointData* output);
}
