// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Raster/CoarseGrid.h"

#include "Core/Base/Executor.h"
#include "Core/Lens/ResamplingKernel.h"
#include "Core/Raster/ABuffer.h"
#include "Core/Splats/SplatList.h"

#include <algorithm>
#include <cmath>
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

  void Receive(int x, int y, const Layer& layer, float) override
  {
    if (!(layer.Weight > 0.0f))
    {
      return;
    }
    Splat s;
    s.X = static_cast<float>(x) * this->Cell;
    s.Y = static_cast<float>(y) * this->Cell;
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

/// A level that is rastered.
struct Level
{
  int Number;
  Frame Grid;
  int Sector; ///< of the lens, or WholeLens
  PictureSize Picture;
};

/// Rasters the tiles of a level.
void RasterLevel(const SplatList& list, const Level& level, const RasterSettings& settings,
  const Executor& executor, Pool<TileRaster>& rasters, CoarseWork& work)
{
  const std::size_t count = work.Bins.NumberOfTiles();
  work.Tiles.resize(std::max(count, work.Tiles.size()));
  executor.For(count, 1, [&](std::size_t begin, std::size_t end) {
    TentSink sink(level.Number, level.Picture.Width, level.Picture.Height, level.Sector);
    const Pool<TileRaster>::Loan raster(rasters);
    raster->Set(settings, nullptr, &sink, false, level.Sector);
    for (std::size_t tile = begin; tile < end; ++tile)
    {
      TileTents& tents = work.Tiles[tile];
      tents.Splats.clear();
      tents.Boxes.clear();
      sink.Splats = &tents.Splats;
      sink.Boxes = &tents.Boxes;
      tents.Fragments = raster->Render(list, work.Bins, tile, level.Grid).Fragments;
    }
  });
}

/// Appends a level's tents; returns the number of its fragments.
std::uint64_t Append(const CoarseWork& work, const Executor& executor, SplatList& list)
{
  const std::size_t count = work.Bins.NumberOfTiles();
  std::size_t size = list.Splats.Size();
  std::uint64_t fragments = 0;
  const std::size_t firstPart = list.Parts.size();
  for (std::size_t i = 0; i < count; ++i)
  {
    SplatList::Part part;
    part.Begin = size;
    part.Count = work.Tiles[i].Splats.size();
    part.Levels = 1;
    list.Parts.push_back(part);
    size += part.Count;
    fragments += work.Tiles[i].Fragments;
  }
  list.Resize(size);
  executor.For(count, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
    {
      const TileTents& tents = work.Tiles[i];
      const std::size_t first = list.Parts[firstPart + i].Begin;
      std::copy(tents.Splats.begin(), tents.Splats.end(), list.Splats.Data() + first);
      std::copy(tents.Boxes.begin(), tents.Boxes.end(), list.Boxes.Data() + first);
      std::transform(tents.Splats.begin(), tents.Splats.end(), list.Nears.Data() + first,
        [](const Splat& s) { return s.Near; });
      std::fill_n(list.Levels.Data() + first, tents.Splats.size(), 0);
      if (list.HasSlopes)
      {
        std::fill_n(list.Slopes.Data() + first, tents.Splats.size(), LensSlope{});
      }
    }
  });
  return fragments;
}
}

std::uint64_t ResolveCoarseLevels(SplatList& list, int width, int height,
  const RasterSettings& settings, const Executor& executor, Pool<TileRaster>& rasters,
  CoarseWork& work)
{
  std::uint64_t fragments = 0;
  const unsigned int levels = list.LevelsInUse();
  for (int level = HighestCoarseLevel; level >= LowestCoarseLevel; --level)
  {
    if ((levels >> level & 1) == 0)
    {
      continue;
    }
    const Frame grid{ CoarseSize(width, 1 << level), CoarseSize(height, 1 << level), nullptr,
      nullptr };
    BinSplats(list, level, grid.Width, grid.Height, executor, work.Bins);
    SortBins(list, executor, work.Bins);
    for (int sector = list.HasSlopes ? 0 : WholeLens; sector <= WholeLens; ++sector)
    {
      RasterLevel(
        list, { level, grid, sector, { width, height } }, settings, executor, rasters, work);
      fragments += Append(work, executor, list);
    }
  }
  return fragments;
}
}
