// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Raster/CoarseGrid.h"

#include "Core/Base/Executor.h"
#include "Core/Raster/TwoSurfaces.h"
#include "Core/Splats/SplatList.h"

#include <algorithm>
#include <array>
#include <cmath>
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

/// Turns a level's layers into tents of the picture.
class TentSink : public CellSink
{
public:
  explicit TentSink(const Level& level)
    : Cell(static_cast<float>(1 << level.Number))
    , Drawn(level.Drawn)
  {
  }

  std::vector<Tent>* Tents = nullptr;

  void Receive(int x, int y, const PixelTile& tile, int block, int lane) override
  {
    Tent t;
    t.X = static_cast<float>(x) * this->Cell;
    t.Y = static_cast<float>(y) * this->Cell;
    t.InverseCell = 1.0f / this->Cell;
    t.Box = { First(t.X - this->Cell, this->Drawn.Picture.Width),
      First(t.Y - this->Cell, this->Drawn.Picture.Height),
      First(t.X + this->Cell, this->Drawn.Picture.Width),
      First(t.Y + this->Cell, this->Drawn.Picture.Height) };
    if (IsEmpty(t.Box) || !this->Drawn.Touch(t.Box))
    {
      return;
    }
    const OpenLayers& open = tile.Open[block];
    const LayerDepths depths = DepthsOf(open, tile.Coarse[block], lane);
    t.Weight = depths.Weight;
    SetColor(open, tile.Lens[block], lane, t);
    SetCovariances(open, tile.Coarse[block], lane, t);
    const LayerPart whole = WholeLayer(depths);
    TwoNormals surfaces;
    LayerPart parts[2];
    if (!SplitLayer(depths, whole, surfaces, parts))
    {
      this->Add(t, whole);
      return;
    }
    // Both have the layer's lens point: own ones take 1 % of a frame and gain no dB.
    Tent back = t;
    SplitColors({ open, tile.Coarse[block], lane }, depths, surfaces, t, back);
    this->Add(t, parts[0]);
    this->Add(back, parts[1]);
  }

private:
  void Add(Tent& t, const LayerPart& part)
  {
    t.Weight = part.Weight;
    t.Depth = part.Depth;
    t.Near = part.Near;
    t.Far = part.Far;
    this->Tents->push_back(t);
  }

  static LayerDepths DepthsOf(const OpenLayers& open, const CoarseLayers& c, int l)
  {
    const float weight = open.Weight[l], first = open.Depth[l];
    return { weight, c.Near[l] + first / weight, first, c.SquaredDepth[l], c.CubedDepth[l],
      c.FourthDepth[l], c.HalfRange[l] / weight };
  }

  static void SetColor(const OpenLayers& open, const LensLayers& lens, int l, Tent& t)
  {
    const float inverse = open.Opacity[l] > 0.0f ? 1.0f / open.Opacity[l] : 0.0f;
    t.Opacity = open.Opacity[l] / t.Weight;
    t.Red = open.Red[l] * inverse;
    t.Green = open.Green[l] * inverse;
    t.Blue = open.Blue[l] * inverse;
    t.PointX = lens.FillX[l] / t.Weight;
    t.PointY = lens.FillY[l] / t.Weight;
  }

  /// A layer of a cell.
  struct CellLayer
  {
    const OpenLayers& Open;
    const CoarseLayers& Coarse;
    int Lane;
  };

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

  static void SetCovariances(const OpenLayers& open, const CoarseLayers& c, int l, Tent& t)
  {
    const float inverse = open.Opacity[l] > 0.0f ? 1.0f / open.Opacity[l] : 0.0f;
    t.RedX = c.RedX[l] * inverse - t.Red * t.PointX;
    t.RedY = c.RedY[l] * inverse - t.Red * t.PointY;
    t.GreenX = c.GreenX[l] * inverse - t.Green * t.PointX;
    t.GreenY = c.GreenY[l] * inverse - t.Green * t.PointY;
    t.BlueX = c.BlueX[l] * inverse - t.Blue * t.PointX;
    t.BlueY = c.BlueY[l] * inverse - t.Blue * t.PointY;
    t.XX = c.XX[l] * inverse - t.PointX * t.PointX;
    t.XY = c.XY[l] * inverse - t.PointX * t.PointY;
    t.YY = c.YY[l] * inverse - t.PointY * t.PointY;
  }

  /// First pixel whose centre is not before x.
  static int First(float x, int size)
  {
    return static_cast<int>(
      std::min(std::max(std::ceil(x - 0.5f), 0.0f), static_cast<float>(size)));
  }

  float Cell; // px
  const TileSet& Drawn;
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
    raster->SetCoarse(settings, sink);
    for (std::size_t tile = begin; tile < end; ++tile)
    {
      TileTents& tents = work.Tiles[tile];
      tents.Tents.clear();
      sink.Tents = &tents.Tents;
      tents.Fragments = raster->Render(list, work.Bins, tile, level.Grid).Fragments;
    }
  });
}

/// The cell of a tent in its tile.
std::size_t CellOf(const Tent& tent)
{
  constexpr unsigned int last = TileSize - 1;
  static_assert((TileSize & last) == 0, "a power of two");
  const auto place = [&](
                       float x) { return static_cast<unsigned int>(x * tent.InverseCell) & last; };
  return TileSize * place(tent.Y) + place(tent.X);
}

/// Copies a tile's tents into the list, cell by cell: their order decides between equal depths, and
/// must not depend on what else was drawn with them.
void CopyInOrder(const TileTents& tile, SplatList& list)
{
  std::array<std::uint32_t, TileSize * TileSize + 1> places{};
  for (const Tent& tent : tile.Tents)
  {
    ++places[CellOf(tent) + 1];
  }
  std::partial_sum(places.begin(), places.end(), places.begin());
  for (const Tent& tent : tile.Tents)
  {
    const std::size_t i = tile.First + places[CellOf(tent)]++;
    list.Tents[i] = tent;
    list.TentBoxes[i] = tent.Box;
    list.TentNears[i] = tent.Near;
  }
}

/// Appends a level's tents; returns the number of its fragments.
std::uint64_t Append(CoarseWork& work, const Executor& executor, SplatList& list)
{
  const std::size_t count = work.Bins.NumberOfTiles();
  std::size_t size = list.Tents.Size();
  std::uint64_t fragments = 0;
  for (std::size_t i = 0; i < count; ++i)
  {
    TileTents& tile = work.Tiles[i];
    tile.First = size;
    size += tile.Tents.size();
    fragments += tile.Fragments;
  }
  list.ResizeTents(size);
  executor.For(count, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
    {
      CopyInOrder(work.Tiles[i], list);
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
  const unsigned int levels = list.LevelsInUse();
  for (int level = HighestCoarseLevel; level >= LowestCoarseLevel; --level)
  {
    if ((levels >> level & 1) == 0)
    {
      continue;
    }
    const PictureSize grid{ CoarseSize(drawn.Picture.Width, 1 << level),
      CoarseSize(drawn.Picture.Height, 1 << level) };
    BinSplats(list, level, grid, executor, work.Bins);
    SortBins(list, executor, work.Bins);
    const Frame frame{ grid.Width, grid.Height, nullptr, nullptr };
    DrawLevel(list, { level, frame, drawn }, settings, executor, rasters, work);
    fragments += Append(work, executor, list);
  }
  return fragments;
}
}
