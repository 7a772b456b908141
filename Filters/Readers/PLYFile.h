// SPDX-License-Identifier: BSD-3-Clause
/**
 * Reads the vertices of .ply files with pcl_io. Only with SURFELSPLATTING_READ_WITH_PCL.
 */
#pragma once

#include "Filters/Readers/FieldCloud.h"

#include <string>

namespace PointCloud
{
/// Reads a file that CheckFile has accepted. Throws std::runtime_error if it is damaged.
FieldCloud ReadPLY(const std::string& path);
}
