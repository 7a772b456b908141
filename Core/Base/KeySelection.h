// SPDX-License-Identifier: BSD-3-Clause
/**
 * Selection: the key that has a rank among others.
 */
#pragma once

#include "Core/Base/Executor.h"

#include <cstddef>
#include <cstdint>

namespace SurfelSplatting
{
/// The key of this rank (0: the smallest) among distinct ones, whose order changes. Few keys by
/// quickselect, many by all threads with a sample (Floyd and Rivest 1975).
/// @param keys [count], rank < count
std::uint64_t FindKey(
  std::uint64_t* keys, std::size_t count, std::size_t rank, const Executor& executor);
}
