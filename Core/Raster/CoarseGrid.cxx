// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Raster/CoarseGrid.h"

#include "Core/Base/Executor.h"
#include "Core/Raster/TwoSurfaces.h"
#include "Core/Splats/SplatList.h"

#include <algorithm>
#include <array>
#include <numeric>
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
  const TileSet& Drawn;
};

/// Pixels of the picture under the tent of cell (x, y) of a level.
PixelBox BoxOfTent(int x, int y, const Level& level)
{
  const int d = 1 << level.Number;
  const PictureSize& picture = level.Drawn.Picture;
  const auto within = [](int pixel, int size) { return std::clamp(pixel, 0, size); };
  return { within((x - 1) * d, picture.Width), within((y - 1) * d, picture.Height),
    within((x + 1) * d, picture.Width), within((y + 1) * d, picture.Height) };
}

/// Turns a level's layers into tents of the picture.
class TentSink : public CellSink
{
public:
  explicit TentSink(const Level& level)
    : Grid(level)
    , CellSize(static_cast<float>(1 << level.Number))
  {
  }

  TileTents* To = nullptr;

  void Receive(const CellLayers& layers) override
  {
    for (unsigned int left = layers.Lanes; left != 0; left &= left - 1)
    {
      const int lane = __builtin_ctz(left);
      const int x = layers.X + lane % BlockSize, y = layers.Y + lane / BlockSize;
      const PixelBox box = BoxOfTent(x, y, this->Grid);
      if (!IsEmpty(box) && this->Grid.Drawn.Touch(box))
      {
        // Written where it stays: a copy would wait for each of its fields.
        Tent& t = this->To->Add();
        t.Box = box;
        t.X = static_cast<float>(x) * this->CellSize;
        t.Y = static_cast<float>(y) * this->CellSize;
        t.InverseCell = 1.0f / this->CellSize;
        this->Add(
          layers, lane, t, static_cast<std::uint32_t>(y % TileSize * TileSize + x % TileSize));
      }
    }
  }

private:
  /// @param t has its place, and is the last one
  void Add(const CellLayers& layers, int lane, Tent& t, std::uint32_t cell)
  {
    const CellLayer layer{ layers.Tile.Open[layers.Block], layers.Tile.Coarse[layers.Block], lane };
    SetMeans(layers.Tents, lane, t);
    t.Weight = layer.Open.Weight[lane];
    t.Near = layers.Tents.Near[lane];
    t.Far = layers.Tents.Far[lane];
    t.Depth = layers.Tents.Depth[lane];
    this->SetPlace(cell, t.Near);
    if ((layers.Tents.MayBeTwo >> lane & 1) == 0)
    {
      return;
    }
    const LayerDepths depths = DepthsOf(layer);
    TwoNormals surfaces;
    LayerPart parts[2];
    if (!SplitLayer(depths, { t.Weight, t.Depth, t.Near, t.Far }, surfaces, parts))
    {
      return;
    }
    const Tent all = t;
    Tent back = t;
    SplitColors(layer, depths, surfaces, t, back);
    SplitPoints(layer, depths, surfaces, all, t, back);
    this->Place(t, parts[0], cell);
    this->Place(this->To->Add() = back, parts[1], cell);
  }

  /// Where the last tent belongs.
  void SetPlace(std::uint32_t cell, float near)
  {
    this->To->Places[this->To->Places.Size() - 1] = { cell, near };
  }

  void Place(Tent& t, const LayerPart& part, std::uint32_t cell)
  {
    t.Weight = part.Weight;
    t.Depth = part.Depth;
    t.Near = part.Near;
    t.Far = part.Far;
    this->SetPlace(cell, part.Near);
  }

  /// A layer of a cell.
  struct CellLayer
  {
    const OpenLayers& Open;
    const CoarseLayers& Coarse;
    int Lane;
  };

  static LayerDepths DepthsOf(const CellLayer& layer)
  {
    const CoarseLayers& c = layer.Coarse;
    const int l = layer.Lane;
    const float weight = layer.Open.Weight[l], first = layer.Open.Depth[l];
    return { weight, c.Near[l] + first / weight, first, c.SquaredDepth[l], c.CubedDepth[l],
      c.FourthDepth[l], c.HalfRange[l] / weight };
  }

  static void SetMeans(const CellTents& from, int l, Tent& t)
  {
    t.Red = from.Red[l];
    t.Green = from.Green[l];
    t.Blue = from.Blue[l];
    t.Opacity = from.Opacity[l];
    t.PointX = from.PointX[l];
    t.PointY = from.PointY[l];
    t.RedX = from.RedX[l];
    t.RedY = from.RedY[l];
    t.GreenX = from.GreenX[l];
    t.GreenY = from.GreenY[l];
    t.BlueX = from.BlueX[l];
    t.BlueY = from.BlueY[l];
    t.XX = from.XX[l];
    t.XY = from.XY[l];
    t.YY = from.YY[l];
  }

  /// @param front,back have the layer's colours and opacity
  static void SplitColors(const CellLayer& layer, const LayerDepths& depths,
    const TwoNormals& surfaces, Tent& front, Tent& back)
  {
    const int l = layer.Lane;
    const float inverse = 1.0f / depths.Weight, mean = depths.First * inverse;
    const auto split = [&](const float* sums, const float* products) {
      const float value = sums[l] * inverse;
      return SplitMean(value, products[l] * inverse - value * mean, surfaces);
    };
    const OpenLayers& open = layer.Open;
    const CoarseLayers& c = layer.Coarse;
    const PartMeans opacity = split(open.Opacity, c.OpacityDepth);
    const float perFront = opacity.Front > 0.0f ? 1.0f / opacity.Front : 0.0f;
    const float perBack = opacity.Back > 0.0f ? 1.0f / opacity.Back : 0.0f;
    front.Opacity = std::min(opacity.Front, 1.0f);
    back.Opacity = std::min(opacity.Back, 1.0f);
    const auto color = [&](const float* sums, const float* products, float Tent::*to) {
      const PartMeans both = split(sums, products); // premultiplied
      front.*to = both.Front * perFront;
      back.*to = both.Back * perBack;
    };
    color(open.Red, c.RedDepth, &Tent::Red);
    color(open.Green, c.GreenDepth, &Tent::Green);
    color(open.Blue, c.BlueDepth, &Tent::Blue);
  }

  /// Surfaces beside one another, each before its own part of the lens, must not seem to cover one
  /// another. Both get the covariances that are left of the layer's.
  /// @param whole the layer @param front,back have their own colours and opacities
  static void SplitPoints(const CellLayer& layer, const LayerDepths& depths,
    const TwoNormals& surfaces, const Tent& whole, Tent& front, Tent& back)
  {
    const int l = layer.Lane;
    const float inverse = 1.0f / depths.Weight, mean = depths.First * inverse;
    const auto covariance = [&](float point, const float* products) {
      return products[l] * inverse - point * mean;
    };
    const PartPoints points = SplitPoint(depths, whole.PointX, whole.PointY,
      covariance(whole.PointX, layer.Coarse.PointDepthX),
      covariance(whole.PointY, layer.Coarse.PointDepthY), surfaces);
    front.PointX = points.FrontX;
    front.PointY = points.FrontY;
    back.PointX = points.BackX;
    back.PointY = points.BackY;
    const float inFront = surfaces.FrontWeight * front.Opacity;
    const float inBack = (1.0f - surfaces.FrontWeight) * back.Opacity;
    const float share = inFront / std::max(inFront + inBack, 1e-30f);
    const auto leave = [&](float Tent::*to, float Tent::*value, float Tent::*point) {
      const auto product = [&](const Tent& t) { return t.*value * (t.*point); };
      const float ofMeans = share * product(front) + (1.0f - share) * product(back);
      front.*to = back.*to = whole.*to + product(whole) - ofMeans;
    };
    leave(&Tent::RedX, &Tent::Red, &Tent::PointX);
    leave(&Tent::RedY, &Tent::Red, &Tent::PointY);
    leave(&Tent::GreenX, &Tent::Green, &Tent::PointX);
    leave(&Tent::GreenY, &Tent::Green, &Tent::PointY);
    leave(&Tent::BlueX, &Tent::Blue, &Tent::PointX);
    leave(&Tent::BlueY, &Tent::Blue, &Tent::PointY);
    leave(&Tent::XX, &Tent::PointX, &Tent::PointX);
    leave(&Tent::XY, &Tent::PointX, &Tent::PointY);
    leave(&Tent::YY, &Tent::PointY, &Tent::PointY);
  }

  const Level& Grid;
  float CellSize; // px
};

/// Draws the tiles of a level.
void DrawLevel(const SplatList& list, const Level& level, const RasterSettings& settings,
  const Executor& executor, Pool<TileRaster>& rasters, CoarseWork& work)
{
  const std::size_t count = work.Bins.NumberOfTiles();
  std::vector<TileTents>& tiles = work.Levels[static_cast<std::size_t>(level.Number)];
  tiles.resize(std::max(count, tiles.size()));
  executor.For(count, 1, [&](std::size_t begin, std::size_t end) {
    TentSink sink(level);
    const Pool<TileRaster>::Loan raster(rasters);
    raster->SetCoarse(settings, sink);
    for (std::size_t tile = begin; tile < end; ++tile)
    {
      TileTents& tents = tiles[tile];
      tents.Clear();
      sink.To = &tents;
      tents.Fragments = raster->Render(list, work.Bins, tile, level.Grid).Fragments;
    }
  });
}

/// Lists a tile's tents, cell by cell: their order decides between equal depths, and must not
/// depend on what else was drawn with them. Does not read the tents, which would be fetched twice.
void ListInOrder(const TileTents& tile, const PixelBox& cells, const Level& level, SplatList& list)
{
  std::array<std::uint32_t, TileSize * TileSize + 1> counts{};
  for (std::size_t k = 0; k < tile.Places.Size(); ++k)
  {
    ++counts[tile.Places[k].Cell + 1];
  }
  std::partial_sum(counts.begin(), counts.end(), counts.begin());
  for (std::size_t k = 0; k < tile.Places.Size(); ++k)
  {
    const auto [cell, near] = tile.Places[k];
    const std::size_t i = tile.First + counts[cell]++;
    list.Tents[i] = &tile.Tents[k];
    list.TentBoxes[i] = BoxOfTent(cells.X0 + static_cast<int>(cell % TileSize),
      cells.Y0 + static_cast<int>(cell / TileSize), level);
    list.TentNears[i] = near;
  }
}

/// Appends a level's tents; returns the number of its fragments.
std::uint64_t Append(
  const Level& level, CoarseWork& work, const Executor& executor, SplatList& list)
{
  std::vector<TileTents>& tiles = work.Levels[static_cast<std::size_t>(level.Number)];
  const std::size_t count = work.Bins.NumberOfTiles();
  std::size_t size = list.Tents.Size();
  std::uint64_t fragments = 0;
  for (std::size_t i = 0; i < count; ++i)
  {
    tiles[i].First = size;
    size += tiles[i].Tents.Size();
    fragments += tiles[i].Fragments;
  }
  list.ResizeTents(size);
  const PictureSize grid{ level.Grid.Width, level.Grid.Height };
  executor.For(count, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
    {
      ListInOrder(tiles[i], BoxOfTile(i, grid), level, list);
    }
  });
  return fragments;
}
}

std::uint64_t ResolveCoarseLevels(SplatList& list, const TileSet& drawn,
  const RasterSettings& settings, const Executor& executor, Pool<TileRaster>& rasters,
  CoarseWork& work)
{
  std::uint64_t fragments = 0;
  const unsigned int levels = list.Sum().Levels;
  for (int level = HighestCoarseLevel; level >= LowestCoarseLevel; --level)
  {
    if ((levels >> level & 1) == 0)
    {
      continue;
    }
    const PictureSize grid{ CoarseSize(drawn.Picture.Width, 1 << level),
      CoarseSize(drawn.Picture.Height, 1 << level) };
    BinSplats(list, level, grid, executor, work.Bins);
    SortBins(executor, work.Bins);
    const Level drawing{ level, { grid.Width, grid.Height, nullptr, nullptr }, drawn };
    DrawLevel(list, drawing, settings, executor, rasters, work);
    fragments += Append(drawing, work, executor, list);
  }
  return fragments;
}
}
