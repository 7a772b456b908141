// SPDX-License-Identifier: BSD-3-Clause
/**
 * Decodes the data of .pcd files: ascii, binary and binary_compressed.
 *
 * pcl_io's decoder is not used: it brings another VTK along, which neither ParaView nor PyVista can
 * have.
 */
#pragma once

#include "Filters/Readers/Points/FieldCloud.h"

#include <istream>

namespace PointCloud
{
struct PCDHeader;

/**
 * Reads the points after a header that CheckFile has accepted. Throws std::runtime_error that says
 * what is wrong with them.
 */
FieldCloud DecodePCD(std::istream& file, const PCDHeader& header);
}
