// SPDX-License-Identifier: BSD-3-Clause
/**
 * What the filters after vtkSurfelEstimation demand of their input.
 */
#pragma once

#include <string>

class vtkPolyData;
class vtkPointSet;

namespace SurfelGeometry
{
/// Empty where the input holds surfels (Documentation/DataContract.md), else what is wrong and what
/// to do.
std::string CheckSurfels(vtkPolyData* input);

/// The field array SurfelOrigin, three values in any shape; 0 where there is none.
void ReadOrigin(vtkPointSet* input, double origin[3]);
}
