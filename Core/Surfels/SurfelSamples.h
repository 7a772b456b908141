// SPDX-License-Identifier: BSD-3-Clause
/**
 * Some surfels of a cloud, for programs that look for a view: the same ones in whatever order the
 * cloud has them. views/samples.py of the Python package chooses the same.
 */
#pragma once

#include "Core/Surfels/SurfelCloud.h"

#include <cstddef>
#include <vector>

namespace SurfelSplatting
{
/// The number of samples of `count` surfels: one of k, where k is count / most rounded down; all of
/// fewer than 2 most.
std::size_t NumberOfSamples(std::size_t count, std::size_t most);

/**
 * The indices of the samples, ascending: those of the surfels with the smallest keys, which are
 * hashed coordinates. Where many surfels are at one place, each k-th instead.
 * @param most at least 1
 */
std::vector<std::size_t> ChooseSamples(const SurfelCloud& cloud, std::size_t most);
}
