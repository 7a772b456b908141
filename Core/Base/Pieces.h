// SPDX-License-Identifier: BSD-3-Clause
/**
 * Cuts a range into pieces that do not depend on the number of threads, so that neither do sums
 * over them.
 */
#pragma once

#include "Core/Base/Executor.h"

#include <algorithm>
#include <cstddef>

namespace SurfelSplatting
{
constexpr std::size_t CountPieces(std::size_t count, std::size_t size)
{
  return (count + size - 1) / size;
}

/// Calls visit(piece, first, number of elements) for the pieces of `size` of [0, count), in
/// parallel.
template <typename Visit>
void ForPieces(std::size_t count, std::size_t size, const Executor& executor, const Visit& visit)
{
  executor.For(CountPieces(count, size), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t piece = begin; piece < end; ++piece)
    {
      visit(piece, piece * size, std::min(size, count - piece * size));
    }
  });
}
}
