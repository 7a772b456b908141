// SPDX-License-Identifier: BSD-3-Clause
/**
 * Turns the fields of an untyped cloud into points and point arrays. What becomes of which
 * field: vtkPointCloudReader.h.
 */
#pragma once

#include "Filters/Readers/PointCloudBlob.h"

class vtkPolyData;

namespace PointCloud
{
/**
 * Throws std::runtime_error where x, y and z are missing.
 */
void DecodeFields(const FieldCloud& cloud, vtkPolyData* output);
}
