// SPDX-License-Identifier: BSD-3-Clause
/**
 * Reads points that are lines of text, as in .pcd and .ply files of ascii.
 */
#pragma once

#include "Filters/Readers/Points/FieldCloud.h"

#include <cstddef>
#include <istream>

namespace PointCloud
{
/**
 * Fills the data of a cloud that has all else. A point is a line; empty lines are skipped. Throws
 * std::runtime_error that names the line that is no point.
 * @param headerLines above the points, for the message
 */
void ReadTextPoints(std::istream& file, std::size_t headerLines, FieldCloud& cloud);
}
