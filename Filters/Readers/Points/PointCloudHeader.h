// SPDX-License-Identifier: BSD-3-Clause
/**
 * Format and header of a .ply or .pcd file, checked before the data is read: the readers rely on
 * the header, so that a damaged one would make them allocate too much or read past the end.
 */
#pragma once

#include "Filters/Readers/Points/FieldCloud.h"

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
 * The format by the file's first bytes; Unknown also if it cannot be opened.
 */
Format FindFormat(const std::string& path);

/**
 * Returns the format, never Unknown. Throws std::runtime_error if the file cannot be read, its
 * header is damaged, or it is too short for the points in its header.
 */
Format CheckFile(const std::string& path);

/// Header of a .pcd file; its entries agree with each other.
struct PCDHeader
{
  std::uint32_t Width = 0, Height = 1;
  std::vector<Field> Fields; ///< offsets as in a point
  std::size_t PointStep = 0; ///< bytes of a point
  std::string Data;          ///< ascii, binary or binary_compressed
  std::size_t Lines = 0;     ///< up to and with the line DATA
  double Viewpoint[3] = { 0.0, 0.0, 0.0 };
};

/// Reads up to where the data begins. Throws as CheckFile does.
PCDHeader ReadPCDHeader(std::istream& file);

/// An element of a .ply file, such as its vertices.
struct PLYElement
{
  std::string Name;
  std::uint64_t Count = 0;
  std::vector<Field> Fields; ///< numbers of known types; offsets as in binary data of no others
  std::size_t Step = 0;      ///< bytes of these fields
  bool HasLists = false;
  bool HasUnknown = false; ///< properties without known type and name
};

/// Header of a .ply file.
struct PLYHeader
{
  std::string Format; ///< ascii, binary_little_endian or binary_big_endian
  std::vector<PLYElement> Elements;
  std::size_t Lines = 0; ///< up to and with the line end_header

  /// The first element of this name, or nullptr.
  const PLYElement* Find(const std::string& name) const;
};

/// Reads up to where the data begins. Throws as CheckFile does, but not because of the file's size.
PLYHeader ReadPLYHeader(std::istream& file);

/// Throws std::runtime_error if so many points of at least so many bytes do not fit into a file, or
/// into VTK's int dimensions.
void CheckSize(std::uint64_t points, std::uint64_t leastBytes, std::uint64_t fileBytes);
}
