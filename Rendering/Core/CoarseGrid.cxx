// SPDX-License-Identifier: BSD-3-Clause
#include "CoarseGrid.h"

#include "ABuffer.h"
#include "Executor.h"
#include "ResamplingKernel.h"
#include "SplatList.h"
#include "TileBinning.h"
#include "TileRaster.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

namespace SurfelSplatting
{
namespace
{
/// Turns a level's layers into tents of the picture.
class TentSink : public LayerSink
{
public:
  TentSink(int level, int width, int height, int sector)
    : Cell(static_cast<float>(1 << level))
    , Sector(static_cast<float>(sector))
    , Width(width)
    , Height(height)
  {
  }

  std::vector<Splat>* Splats = nullptr;
  std::vector<PixelBox>* Boxes = nullptr;

  void Receive(int x, int y, const Layer& layer) override
  {
    if (!(layer.Weight > 0.0f))
    {
      return;
    }
    Splat s;
    s.X = (static_cast<float>(x) - 0.5f) * this->Cell;
    s.Y = (static_cast<float>(y) - 0.5f) * this->Cell;
    const PixelBox box{ First(s.X - this->Cell, this->Width), First(s.Y - this->Cell, this->Height),
      First(s.X + this->Cell, this->Width), First(s.Y + this->Cell, this->Height) };
    if (IsEmpty(box))
    {
      return;
    }
    const float opaque = layer.Opacity > 0.0f ? 1.0f / layer.Opacity : 0.0f;
    s.A = 1.0f / this->Cell;
    s.K = this->Sector;
    s.B = layer.Depth / layer.Weight;
    s.Weight = layer.Weight;
    s.Near = layer.Near;
    s.Far = layer.Far;
    s.Gradient = NoGradient;
    s.DepthX = s.DepthY = 0.0f;
    s.Red = layer.Red * opaque;
    s.Green = layer.Green * opaque;
    s.Blue = layer.Blue * opaque;
    s.Opacity = layer.Opacity / layer.Weight;
    s.Shape = static_cast<float>(TentShape);
    this->Splats->push_back(s);
    this->Boxes->push_back(box);
  }

private:
  static int First(float x, int size)
  {
    return static_cast<int>(
      std::min(std::max(std::ceil(x - 0.5f), 0.0f), static_cast<float>(size)));
  }

  float Cell, Sector;
  int Width, Height;
};

struct PictureSize
{
  int Width, Height; ///< px
};

/// What the tiles of a level have given, tile by tile.
struct TileTents
{
  std::vector<Splat> Splats;
  std::vector<PixelBox> Boxes;
  std::uint64_t Fragments = 0;
};

/// Rasters the tiles of a level.
/// @param sector of the lens, or WholeLens
std::vector<TileTents> RasterLevel(const SplatList& list, const TileBins& bins, int level,
  const Frame& grid, int sector, const PictureSize& picture, const RasterSettings& settings,
  const Executor& executor)
{
  std::vector<TileTents> tiles(bins.NumberOfTiles());
  executor.For(tiles.size(), 1, [&](std::size_t begin, std::size_t end) {
    TentSink sink(level, picture.Width, picture.Height, sector);
    const auto raster = std::make_unique<TileRaster>(settings, nullptr, &sink, false, sector);
    for (std::size_t tile = begin; tile < end; ++tile)
    {
      sink.Splats = &tiles[tile].Splats;
      sink.Boxes = &tiles[tile].Boxes;
      tiles[tile].Fragments = raster->Render(list, bins, tile, grid).Fragments;
    }
  });
  return tiles;
}

void Append(const std::vector<TileTents>& tiles, const Executor& executor, SplatList& list)
{
  std::size_t size = list.Splats.Size();
  const std::size_t firstPart = list.Parts.size();
  for (const TileTents& tile : tiles)
  {
    SplatList::Part part;
    part.Begin = size;
    part.Count = tile.Splats.size();
    part.Levels = 1;
    list.Parts.push_back(part);
    size += part.Count;
  }
  list.Resize(size);
  executor.For(tiles.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
    {
      const std::size_t first = list.Parts[firstPart + i].Begin;
      std::copy(tiles[i].Splats.begin(), tiles[i].Splats.end(), list.Splats.Data() + first);
      std::copy(tiles[i].Boxes.begin(), tiles[i].Boxes.end(), list.Boxes.Data() + first);
      std::fill_n(list.Levels.Data() + first, tiles[i].Splats.size(), 0);
      if (list.HasSlopes)
      {
        std::fill_n(list.Slopes.Data() + first, tiles[i].Splats.size(), LensSlope{});
      }
    }
  });
}
}

int CoarseLevel(double smallestVariance)
{
  const double cells = std::sqrt(smallestVariance) / CoarseCellsPerDeviation;
  int level = 0;
  while (level < HighestCoarseLevel && cells >= static_cast<double>(2 << level))
  {
    ++level;
  }
  return level < LowestCoarseLevel ? 0 : level;
}

std::uint64_t ResolveCoarseLevels(
  SplatList& list, int width, int height, const RasterSettings& settings, const Executor& executor)
{
  std::uint64_t fragments = 0;
  const unsigned int levels = list.LevelsInUse();
  for (int level = HighestCoarseLevel; level >= LowestCoarseLevel; --level)
  {
    if ((levels >> level & 1) == 0)
    {
      continue;
    }
    const Frame grid{ CoarseSize(width, level), CoarseSize(height, level), nullptr, nullptr };
    TileBins bins;
    BinSplats(list, level, grid.Width, grid.Height, executor, bins);
    SortBins(list, executor, bins);
    for (int sector = list.HasSlopes ? 0 : WholeLens; sector <= WholeLens; ++sector)
    {
      const std::vector<TileTents> tiles =
        RasterLevel(list, bins, level, grid, sector, { width, height }, settings, executor);
      for (const TileTents& tile : tiles)
      {
        fragments += tile.Fragments;
      }
      Append(tiles, executor, list);
    }
  }
  return fragments;
}
}
