// SPDX-License-Identifier: BSD-3-Clause
#include "TileBinning.h"

#include <algorithm>
#include <cstring>

namespace SurfelSplatting
{
namespace
{
/// Chunks of the list's parts that count and write on their own; few, since each keeps a counter
/// per tile.
constexpr std::size_t NumberOfChunks = 16;

/// Calls function(tile, splat) for every tile that a chunk's splats touch.
template <typename Function>
void ForEachPair(
  const SplatList& list, int level, std::size_t chunk, int tilesX, Function&& function)
{
  const std::size_t n = list.Parts.size();
  const std::size_t last = n * (chunk + 1) / NumberOfChunks;
  for (std::size_t p = n * chunk / NumberOfChunks; p < last; ++p)
  {
    const SplatList::Part& part = list.Parts[p];
    if ((part.Levels >> level & 1) == 0)
    {
      continue;
    }
    for (std::size_t i = part.Begin; i < part.Begin + part.Count; ++i)
    {
      if (list.Levels[i] != level)
      {
        continue;
      }
      const TileRange range(list.Boxes[i]);
      for (int ty = range.Y0; ty <= range.Y1; ++ty)
      {
        for (int tx = range.X0; tx <= range.X1; ++tx)
        {
          function(static_cast<std::size_t>(ty) * tilesX + tx, static_cast<std::uint32_t>(i));
        }
      }
    }
  }
}
}

void BinSplats(
  const SplatList& list, int level, int width, int height, const Executor& executor, TileBins& bins)
{
  bins.TilesX = (width + TileSize - 1) / TileSize;
  bins.TilesY = (height + TileSize - 1) / TileSize;
  const std::size_t tiles = bins.NumberOfTiles();

  std::vector<std::uint64_t>& cursors = bins.Cursors; // [chunk][tile]
  cursors.assign(NumberOfChunks * tiles, 0);
  executor.For(NumberOfChunks, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t chunk = begin; chunk < end; ++chunk)
    {
      std::uint64_t* counts = cursors.data() + chunk * tiles;
      ForEachPair(
        list, level, chunk, bins.TilesX, [&](std::size_t tile, std::uint32_t) { ++counts[tile]; });
    }
  });

  bins.Offsets.assign(tiles + 1, 0);
  std::uint64_t total = 0;
  for (std::size_t tile = 0; tile < tiles; ++tile)
  {
    bins.Offsets[tile] = total;
    for (std::size_t chunk = 0; chunk < NumberOfChunks; ++chunk)
    {
      const std::uint64_t count = cursors[chunk * tiles + tile];
      cursors[chunk * tiles + tile] = total;
      total += count;
    }
  }
  bins.Offsets[tiles] = total;

  bins.Indices.resize(total);
  executor.For(NumberOfChunks, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t chunk = begin; chunk < end; ++chunk)
    {
      std::uint64_t* cursor = cursors.data() + chunk * tiles;
      ForEachPair(list, level, chunk, bins.TilesX,
        [&](std::size_t tile, std::uint32_t splat) { bins.Indices[cursor[tile]++] = splat; });
    }
  });
}

/// By sixteen bits of the depths between the nearest and the farthest one, in two passes of a radix
/// sort; keys that are alike in these, few or all of them, by what is left.
void KeySorter::Sort(std::vector<std::uint64_t>& keys)
{
  constexpr std::size_t few = 32;
  constexpr int bins = 256, depthBit = 32;
  const std::size_t n = keys.size();
  if (n < few)
  {
    std::sort(keys.begin(), keys.end());
    return;
  }
  std::uint64_t least = keys[0], largest = keys[0];
  for (const std::uint64_t key : keys)
  {
    least = std::min(least, key);
    largest = std::max(largest, key);
  }
  const std::uint32_t first = static_cast<std::uint32_t>(least >> depthBit);
  std::uint32_t range = static_cast<std::uint32_t>(largest >> depthBit) - first;
  int shift = 0;
  while (range >> shift > 0xffff)
  {
    ++shift;
  }
  const auto digits = [&](std::uint64_t key) {
    return (static_cast<std::uint32_t>(key >> depthBit) - first) >> shift;
  };
  std::uint32_t counts[2][bins] = {};
  for (const std::uint64_t key : keys)
  {
    const std::uint32_t d = digits(key);
    ++counts[0][d & 255];
    ++counts[1][d >> 8];
  }
  for (std::uint32_t* digit : counts)
  {
    std::uint32_t sum = 0;
    for (int i = 0; i < bins; ++i)
    {
      const std::uint32_t count = digit[i];
      digit[i] = sum;
      sum += count;
    }
  }
  this->Other.resize(n);
  for (const std::uint64_t key : keys)
  {
    this->Other[counts[0][digits(key) & 255]++] = key;
  }
  for (const std::uint64_t key : this->Other)
  {
    keys[counts[1][digits(key) >> 8]++] = key;
  }
  for (std::size_t begin = 0, end = 0; begin < n; begin = end)
  {
    const std::uint32_t d = digits(keys[begin]);
    for (end = begin + 1; end < n && digits(keys[end]) == d;)
    {
      ++end;
    }
    if (end - begin > 1)
    {
      std::sort(keys.data() + begin, keys.data() + end);
    }
  }
}

void SortBins(const SplatList& list, const Executor& executor, TileBins& bins)
{
  executor.For(bins.NumberOfTiles(), 4, [&](std::size_t begin, std::size_t end) {
    const Pool<TileBins::Sorting>::Loan sorting(bins.Sortings);
    std::vector<std::uint64_t>& keys = sorting->Keys;
    for (std::size_t tile = begin; tile < end; ++tile)
    {
      const auto first = bins.Indices.begin() + bins.Offsets[tile];
      const auto last = bins.Indices.begin() + bins.Offsets[tile + 1];
      keys.clear();
      for (auto it = first; it != last; ++it)
      {
        keys.push_back(static_cast<std::uint64_t>(SortableBits(list.Nears[*it])) << 32 | *it);
      }
      sorting->Sorter.Sort(keys);
      std::transform(keys.begin(), keys.end(), first,
        [](std::uint64_t key) { return static_cast<std::uint32_t>(key); });
    }
  });
}
}
