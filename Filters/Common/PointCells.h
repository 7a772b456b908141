// SPDX-License-Identifier: BSD-3-Clause
/**
 * One cell with all points of a cloud, which VTK's own mappers need to show them.
 */
#pragma once

#include "vtkSmartPointer.h"
#include "vtkType.h"

class vtkCellArray;

namespace SurfelGeometry
{
/// A polyvertex of points 0 to count - 1, with indices of 32 bits where they suffice; no cell where
/// count is 0.
vtkSmartPointer<vtkCellArray> MakePointCell(vtkIdType count);
}
