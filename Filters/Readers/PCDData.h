// SPDX-License-Identifier: BSD-3-Clause
/**
 * The data of a .pcd file without PCL: where pcl_io cannot be linked, since it brings another VTK
 * along, as in ParaView.
 */
#pragma once

#include "Filters/Readers/FieldCloud.h"

#include <istream>

namespace PointCloud
{
struct PCDHeader;

/**
 * Reads the points after a header that CheckFile has found sound. Throws std::runtime_error that
 * says what is wrong with them.
 */
FieldCloud ReadPCDData(std::istream& file, const PCDHeader& header);
}
