// SPDX-License-Identifier: BSD-3-Clause
/**
 * Points of scanners with several beams that fire in turn, beam by beam: what is next to a point in
 * its file is on another beam, what is next on its own comes some points later, fewer where others
 * miss. (Ours.)
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
