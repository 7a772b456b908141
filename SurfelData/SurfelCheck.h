// SPDX-License-Identifier: BSD-3-Clause
/**
 * Checks the point arrays of surfels (Documentation/DataContract.md).
 */
#pragma once

#include <string>

class vtkPolyData;

namespace SurfelSplatting
{
/// Returns an empty string if the point arrays are as the data contract says, otherwise what is
/// wrong and what to do. @param surfels may be null
std::string CheckSurfels(vtkPolyData* surfels);
}
