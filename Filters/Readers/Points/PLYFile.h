// SPDX-License-Identifier: BSD-3-Clause
/**
 * Reads the vertices and faces of .ply files with PCL's parser. It is in libpcl_io_ply; libpcl_io,
 * which has PCL's reader, would bring another VTK along. Not in the ParaView plugin, since Debian
 * has both in one package.
 */
#pragma once

#include "Filters/Readers/Points/FieldCloud.h"

#include <string>

namespace PointCloud
{
/// Reads a file that CheckFile has accepted. Throws std::runtime_error if it is damaged.
FieldCloud ReadPLY(const std::string& path);
}
