// SPDX-License-Identifier: BSD-3-Clause
/**
 * Makes the cell that VTK's own mappers need to show the points of a cloud.
 */
#pragma once

#include "vtkSmartPointer.h"
#include "vtkType.h"

class vtkCellArray;

namespace SurfelGeometry
{
/// One poly-vertex of the points 0 to count - 1, with 32-bit indices if count allows; no cell if
/// count is 0.
vtkSmartPointer<vtkCellArray> MakePointCell(vtkIdType count);
}
