// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Raster/CoarseGrid.h"

#include "Core/Base/Executor.h"
#include "Core/Lens/LensSectors.h"
#include "Core/Raster/ABuffer.h"
#include "Core/Splats/SplatList.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace SurfelSplatting
{
namespace
{
/// A level that is drawn.
struct Level
{
  int Number;
  Frame Grid;
  PictureSize Picture;
};

/// Turns a level's layers into tents of the picture.
class TentSink : public LayerSink
{
public:
  explicit TentSink(const Level& level)
    : Cell(static_cast<float>(1 << level.Number))
    , Picture(level.Picture)
  {
  }

  std::vector<Tent>* Tents = nullptr;

  void Receive(int x, int y, const Layer& layer, float) override
  {
    if (!(layer.Weight > 0.0f))
    {
      return;
    }
    Tent t;
    t.X = static_cast<float>(x) * this->Cell;
    t.Y = static_cast<float>(y) * this->Cell;
    t.Box = { First(t.X - this->Cell, this->Picture.Width),
      First(t.Y - this->Cell, this->Picture.Height), First(t.X + this->Cell, this->Picture.Width),
      First(t.Y + this->Cell, this->Picture.Height) };
    if (IsEmpty(t.Box))
    {
      return;
    }
    const float opaque = layer.Opacity > 0.0f ? 1.0f / layer.Opacity : 0.0f;
    t.InverseCell = 1.0f / this->Cell;
    t.Weight = layer.Weight;
    t.Depth = layer.Depth / layer.Weight;
    t.Near = layer.Near;
    t.Far = layer.Far;
    t.Red = layer.Red * opaque;
    t.Green = layer.Green * opaque;
    t.Blue = layer.Blue * opaque;
    t.Opacity = layer.Opacity / layer.Weight;
    t.PointX = layer.PointX * opaque;
    t.PointY = layer.PointY * opaque;
    const float c[3] = { t.Red, t.Green, t.Blue };
    for (int i = 0; i < 3; ++i)
    {
      t.ColorX[i] = layer.ColorX[i] * opaque - c[i] * t.PointX;
      t.ColorY[i] = layer.ColorY[i] * opaque - c[i] * t.PointY;
    }
    t.XX = layer.XX * opaque - t.PointX * t.PointX;
    t.XY = layer.XY * opaque - t.PointX * t.PointY;
    t.YY = layer.YY * opaque - t.PointY * t.PointY;
    if (SP[8] != 0.0f)
    {
      const float mean = t.Depth - layer.Near;
      const float half = layer.HalfRange / layer.Weight + SP[8] * std::sqrt(std::max(layer.Spread / layer.Weight - mean * mean, 0.0f));
      t.Near = t.Depth - half;
      t.Far = t.Depth + half;
    }
    this->Tents->push_back(t);
  }

private:
  /// First pixel whose centre is not before x.
  static int First(float x, int size)
  {
    return static_cast<int>(
      std::min(std::max(std::ceil(x - 0.5f), 0.0f), static_cast<float>(size)));
  }

  float Cell; // px
  PictureSize Picture;
};

/// Draws the tiles of a level.
void DrawLevel(const SplatList& list, const Level& level, const RasterSettings& settings,
  const Executor& executor, Pool<TileRaster>& rasters, CoarseWork& work)
{
  const std::size_t count = work.Bins.NumberOfTiles();
  work.Tiles.resize(std::max(count, work.Tiles.size()));
  executor.For(count, 1, [&](std::size_t begin, std::size_t end) {
    TentSink sink(level);
    const Pool<TileRaster>::Loan raster(rasters);
    raster->Set(settings, nullptr, &sink, false);
    for (std::size_t tile = begin; tile < end; ++tile)
    {
      TileTents& tents = work.Tiles[tile];
      tents.Tents.clear();
      sink.Tents = &tents.Tents;
      tents.Fragments = raster->Render(list, work.Bins, tile, level.Grid).Fragments;
    }
  });
}

/// Appends a level's tents; returns the number of its fragments.
std::uint64_t Append(CoarseWork& work, const Executor& executor, Buffer<Tent>& tents)
{
  const std::size_t count = work.Bins.NumberOfTiles();
  std::size_t size = tents.Size();
  std::uint64_t fragments = 0;
  for (std::size_t i = 0; i < count; ++i)
  {
    TileTents& tile = work.Tiles[i];
    tile.First = size;
    size += tile.Tents.size();
    fragments += tile.Fragments;
  }
  tents.Resize(size);
  executor.For(count, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
    {
      const TileTents& tile = work.Tiles[i];
      std::copy(tile.Tents.begin(), tile.Tents.end(), tents.Data() + tile.First);
    }
  });
  return fragments;
}
}

std::uint64_t ResolveCoarseLevels(SplatList& list, const PictureSize& size,
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
    const PictureSize grid{ CoarseSize(size.Width, 1 << level),
      CoarseSize(size.Height, 1 << level) };
    BinSplats(list, level, grid, executor, work.Bins);
    SortBins(list, executor, work.Bins);
    const Frame frame{ grid.Width, grid.Height, nullptr, nullptr };
    RasterSettings coarse = settings;
    coarse.Collect = true;
    DrawLevel(list, { level, frame, size }, coarse, executor, rasters, work);
    fragments += Append(work, executor, list.Tents);
  }
  return fragments;
}
}
