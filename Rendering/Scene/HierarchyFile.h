// SPDX-License-Identifier: BSD-3-Clause
/**
 * Writes a hierarchy, and what frames compute of it, as a file of arrays (Core/Files/ArrayFile.h).
 * Internal to the module.
 */
#pragma once

#include "Core/Base/Executor.h"

#include <cstdint>
#include <string>
#include <vector>

class vtkPolyData;

namespace SurfelSplatting
{
/// Number of surfels above which Arrays::Samples are some of them (Core/Surfels/SurfelSamples.h).
constexpr int SampleCount = 100000;

/// Names of the point and field arrays that files do not hold: no numbers, names that are too long,
/// or not one tuple per point.
std::vector<std::string> ArraysLeftOut(vtkPolyData* input);

/**
 * Writes a file. Of surfels without a hierarchy, makes one, in the file itself: besides the input,
 * which may be mapped, it takes 40 bytes of memory for each surfel.
 * @param input surfels or a hierarchy (Documentation/DataContract.md)
 * @return number of surfels that were left out since their values are not finite
 * @throw std::runtime_error that says what is wrong with the input or the disk
 */
std::uint64_t WriteHierarchy(vtkPolyData* input, const std::string& path, const Executor& executor);
}
