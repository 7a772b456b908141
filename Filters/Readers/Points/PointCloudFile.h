// SPDX-License-Identifier: BSD-3-Clause
/**
 * Reads a .pcd or .ply file into an untyped cloud.
 */
#pragma once

#include "Filters/Readers/Points/FieldCloud.h"

#include <string>

namespace PointCloud
{
struct PointCloudFile
{
  FieldCloud Cloud;
  double Viewpoint[3] = { 0.0, 0.0, 0.0 }; ///< of the sensor, in the points' coordinates
  bool HasViewpoint = false;
};

/**
 * Throws std::runtime_error that says what is wrong with the file, or std::bad_alloc.
 */
PointCloudFile ReadPointCloudFile(const std::string& path);
}
