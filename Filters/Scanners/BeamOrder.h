// SPDX-License-Identifier: BSD-3-Clause
/**
 * Puts points of scanners with several beams, which fire in turn, into an order beam by beam. The
 * next point of a file is on another beam; the next one of the same beam comes a round later, or
 * earlier where other beams miss. (Ours.)
 */
#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <vector>

namespace SurfelGeometry
{
/// The order in which points of a scanner with several beams follow one another on these, one run
/// after another; empty if they are not in turns.
std::vector<std::size_t> OrderByBeams(const std::vector<Eigen::Vector3d>& points);
}
