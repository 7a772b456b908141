// SPDX-License-Identifier: BSD-3-Clause
/**
 * What a .ply or .pcd file is and announces, checked before its data are read: pcl_io trusts
 * headers and reserves, or reads past, what a damaged one says.
 */
#pragma once

#include "Filters/Readers/FieldCloud.h"

#include <cstdint>
#include <istream>
#include <string>
#include <vector>

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
 * The format, never Unknown. Throws std::runtime_error that says what is wrong with the file or its
 * header, or that it is too short for the points that it announces.
 */
Format CheckFile(const std::string& path);

/// A .pcd file's, sound in itself.
struct PCDHeader
{
  std::uint32_t Width = 0, Height = 1;
  std::vector<Field> Fields; ///< offsets as in a point
  std::size_t PointStep = 0; ///< bytes of a point
  std::string Data;          ///< ascii, binary or binary_compressed
  double Viewpoint[3] = { 0.0, 0.0, 0.0 };
};

/// Leaves the file where the data begins. Throws as CheckFile does.
PCDHeader ReadPCDHeader(std::istream& file);
}
