// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Raster/TileBinning.h"

#include <algorithm>

namespace SurfelSplatting
{
namespace
{
/// Chunks of the list that are counted and written independently; few, since each has a counter per
/// tile.
constexpr std::size_t NumberOfChunks = 16;

/// A chunk's share of `size` parts or tents, [Begin, End).
struct Share
{
  std::size_t Begin, End;
  Share(std::size_t chunk, std::size_t size)
    : Begin(size * chunk / NumberOfChunks)
    , End(size * (chunk + 1) / NumberOfChunks)
  {
  }
};

/// Calls function(tile, near depth, index) for every tile that a chunk's splats and tents touch.
template <typename Function>
void ForEachPair(
  const SplatList& list, int level, std::size_t chunk, int tilesX, Function&& function)
{
  const Share parts(chunk, list.Parts.size());
  for (std::size_t p = parts.Begin; p < parts.End; ++p)
  {
    const SplatList::Part& part = list.Parts[p];
    if ((part.Levels >> level & 1) == 0)
    {
      continue;
    }
    for (std::size_t i = part.Begin; i < part.Begin + part.Count; ++i)
    {
      if (list.Levels[i] == level)
      {
        ForTiles(list.Boxes[i], tilesX,
          [&](std::size_t tile) { function(tile, list.Orders[i], static_cast<std::uint32_t>(i)); });
      }
    }
  }
  const Share tents(chunk, level == 0 ? list.Tents.Size() : 0);
  for (std::size_t t = tents.Begin; t < tents.End; ++t)
  {
    ForTiles(list.TentBoxes[t], tilesX, [&](std::size_t tile) {
      function(tile, list.TentNears[t], static_cast<std::uint32_t>(list.Splats.Size() + t));
    });
  }
}
}

void BinSplats(const SplatList& list, int level, const PictureSize& size, const Executor& executor,
  TileBins& bins)
{
  bins.TilesX = TileCount(size.Width);
  bins.TilesY = TileCount(size.Height);
  const std::size_t tiles = bins.NumberOfTiles();

  std::vector<std::uint64_t>& cursors = bins.Cursors; // [chunk][tile]
  cursors.assign(NumberOfChunks * tiles, 0);
  executor.For(NumberOfChunks, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t chunk = begin; chunk < end; ++chunk)
    {
      std::uint64_t* counts = cursors.data() + chunk * tiles;
      ForEachPair(list, level, chunk, bins.TilesX,
        [&](std::size_t tile, float, std::uint32_t) { ++counts[tile]; });
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

  bins.Keys.resize(total);
  executor.For(NumberOfChunks, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t chunk = begin; chunk < end; ++chunk)
    {
      std::uint64_t* cursor = cursors.data() + chunk * tiles;
      ForEachPair(
        list, level, chunk, bins.TilesX, [&](std::size_t tile, float near, std::uint32_t index) {
          bins.Keys[cursor[tile]++] = KeyOf(near, index);
        });
    }
  });
}

void SortBins(const Executor& executor, TileBins& bins)
{
  executor.For(bins.NumberOfTiles(), 4, [&](std::size_t begin, std::size_t end) {
    const Pool<KeySorter>::Loan sorter(bins.Sorters);
    for (std::size_t tile = begin; tile < end; ++tile)
    {
      const std::uint64_t first = bins.Offsets[tile];
      sorter->Sort(bins.Keys.data() + first, bins.Offsets[tile + 1] - first);
    }
  });
}
}
