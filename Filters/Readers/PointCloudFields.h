// SPDX-License-Identifier: BSD-3-Clause
/**
 * Turns the fields of PCL's untyped cloud into points and point arrays. What becomes of which
 * field: vtkPointCloudReader.h.
 */
#pragma once

#include <pcl/PCLPointCloud2.h>

class vtkPolyData;

namespace PointCloud
{
/**
 * Throws std::runtime_error where x, y and z are missing.
 */
void DecodeFields(const pcl::PCLPointCloud2& cloud, vtkPolyData* output);
}
