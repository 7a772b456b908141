// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/KeySelection.h"

#include "Core/Base/Pieces.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <vector>

namespace SurfelSplatting
{
namespace
{
constexpr std::size_t PieceSize = 4096;

/// The median of nine keys between the first and the last one.
std::uint64_t MedianOfNine(const std::uint64_t* keys, std::size_t count)
{
  std::uint64_t some[9];
  for (std::size_t i = 0; i < 9; ++i)
  {
    some[i] = keys[i * (count - 1) / 8];
  }
  std::nth_element(some, some + 4, some + 9);
  return some[4];
}

/// Quickselect; no branch depends on single keys, of which half would be predicted wrongly.
std::uint64_t FindAmongFew(std::uint64_t* keys, std::size_t count, std::size_t rank)
{
  constexpr std::size_t few = 32;
  constexpr int mostRounds = 64; // for keys with which the medians are far off
  for (int round = 0; round < mostRounds && count > few; ++round)
  {
    const std::uint64_t pivot = MedianOfNine(keys, count);
    std::size_t below = 0;
    for (std::size_t i = 0; i < count; ++i)
    {
      const std::uint64_t key = keys[i];
      keys[i] = keys[below];
      keys[below] = key;
      below += key < pivot ? 1 : 0;
    }
    if (rank < below)
    {
      count = below;
    }
    else
    {
      keys += below;
      count -= below;
      rank -= below;
    }
  }
  std::nth_element(keys, keys + rank, keys + count);
  return keys[rank];
}

/// Two keys between which the key of a rank is, nearly always.
struct Bracket
{
  std::uint64_t Least = 0, Most = std::numeric_limits<std::uint64_t>::max();

  Bracket(const std::uint64_t* keys, std::size_t count, std::size_t rank)
  {
    // The margin is four standard deviations of a rank in the sample.
    constexpr std::size_t size = 1024, margin = 64;
    std::uint64_t sample[size];
    for (std::size_t i = 0; i < size; ++i)
    {
      sample[i] = keys[i * (count - 1) / (size - 1)];
    }
    std::sort(sample, sample + size);
    const std::size_t place = rank * size / count;
    this->Least = place > margin ? sample[place - margin] : this->Least;
    this->Most = place + margin < size ? sample[place + margin] : this->Most;
  }

  /// The keys between, of `count` up to PieceSize.
  /// @param below number of those below
  std::vector<std::uint64_t> Keep(
    const std::uint64_t* keys, std::size_t count, std::size_t& below) const
  {
    std::uint64_t found[PieceSize];
    std::size_t less = 0, kept = 0;
    for (std::size_t i = 0; i < count; ++i)
    {
      const std::uint64_t key = keys[i];
      found[kept] = key;
      less += key < this->Least ? 1 : 0;
      kept += (key >= this->Least) & (key <= this->Most) ? 1 : 0;
    }
    below = less;
    return std::vector<std::uint64_t>(found, found + kept);
  }
};
}

std::uint64_t FindKey(
  std::uint64_t* keys, std::size_t count, std::size_t rank, const Executor& executor)
{
  if (count <= PieceSize)
  {
    return FindAmongFew(keys, count, rank);
  }
  const Bracket bracket(keys, count, rank);
  std::vector<std::size_t> below(CountPieces(count, PieceSize));
  std::vector<std::vector<std::uint64_t>> between(below.size());
  ForPieces(count, PieceSize, executor, [&](std::size_t p, std::size_t first, std::size_t size) {
    between[p] = bracket.Keep(keys + first, size, below[p]);
  });
  const std::size_t less = std::accumulate(below.begin(), below.end(), std::size_t{ 0 });
  std::vector<std::uint64_t> candidates;
  for (const std::vector<std::uint64_t>& piece : between)
  {
    candidates.insert(candidates.end(), piece.begin(), piece.end());
  }
  return rank >= less && rank < less + candidates.size()
    ? FindAmongFew(candidates.data(), candidates.size(), rank - less)
    : FindAmongFew(keys, count, rank);
}
}
