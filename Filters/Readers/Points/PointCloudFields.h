// SPDX-License-Identifier: BSD-3-Clause
/**
 * Turns the fields of an untyped cloud into points and point arrays; vtkPointCloudReader.h lists
 * which field becomes what.
 */
#pragma once

#include "Filters/Readers/Points/FieldCloud.h"

#include "vtkSmartPointer.h"

class vtkCellArray;
class vtkPolyData;

namespace PointCloud
{
/**
 * Throws std::runtime_error if x, y or z is missing.
 */
void DecodeFields(const FieldCloud& cloud, vtkPolyData* output);

/// One poly-vertex cell of all points, so that an ordinary mapper shows them.
vtkSmartPointer<vtkCellArray> MakeVertices(int count);
}
