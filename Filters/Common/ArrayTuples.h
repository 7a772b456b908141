// SPDX-License-Identifier: BSD-3-Clause
/**
 * Reads arrays of VTK's in files that are compiled without its headers.
 */
#pragma once

#include "Filters/Common/IdType.h"

class vtkDataArray;

namespace SurfelGeometry
{
/// The values of one tuple, as many as the array has components. VTKCalls.cxx has it.
void ReadTuple(vtkDataArray* array, vtkIdType id, double* values);
}
