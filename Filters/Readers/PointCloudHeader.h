// SPDX-License-Identifier: BSD-3-Clause
/**
 * What a .ply or .pcd file is and announces, checked before pcl_io sees it: pcl_io trusts headers
 * and reserves, or reads past, what a damaged one says.
 */
#pragma once

#include <string>

namespace PointCloud
{
enum class Format
{
  Unknown,
  PLY,
  PCD
};

/**
 * The format by the file's first bytes; Unknown also where it cannot be opened.
 */
Format FindFormat(const std::string& path);

/**
 * Throws std::runtime_error that says what is wrong with the header, or that the file is too
 * short for the points that it announces.
 */
void CheckHeader(const std::string& path, Format format);
}
