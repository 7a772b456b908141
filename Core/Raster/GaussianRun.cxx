// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Raster/GaussianRun.h"

#include <algorithm>
#include <cstring>

namespace SurfelSplatting
{
namespace
{
/// Cells that let less through begin with this.
constexpr float LeastStart = 1.0f / 64.0f;

int BlockOfPixel(int x, int y)
{
  return y / BlockSize * BlocksPerRow + x / BlockSize;
}

int LaneOfPixel(int x, int y)
{
  return y % BlockSize * BlockSize + x % BlockSize;
}

/// Sums over the pixels of a cell.
struct CellSums
{
  float Through = 0.0f, X = 0.0f, Y = 0.0f;
  int Pixels = 0;
};

CellSums SumPixels(const PixelTile& tile, int i, int j, int cell)
{
  CellSums sums;
  const int x0 = std::max(0, i * cell - cell / 2), x1 = std::min(TileSize, i * cell + cell / 2);
  const int y0 = std::max(0, j * cell - cell / 2), y1 = std::min(TileSize, j * cell + cell / 2);
  for (int y = y0; y < y1; ++y)
  {
    for (int x = x0; x < x1; ++x)
    {
      const FinishedLayers& done = tile.Finished[BlockOfPixel(x, y)];
      const int l = LaneOfPixel(x, y);
      sums.Through += done.Transmittance[l];
      sums.X += done.ThroughX[l];
      sums.Y += done.ThroughY[l];
    }
  }
  sums.Pixels = (x1 - x0) * (y1 - y0);
  return sums;
}
}

void GaussianRun::Begin(const PixelTile& tile, int cell)
{
  this->Cell = cell;
  const int cells = TileSize / cell + 1, blocks = (cells + BlockSize - 1) / BlockSize;
  this->State.Opaque = ~std::uint64_t{ 0 };
  this->State.Tilted = 0;
  for (int b = 0; b < blocks * blocks; ++b)
  {
    const int block = b / blocks * BlocksPerRow + b % blocks;
    std::memset(static_cast<void*>(&this->State.Open[block]), 0, sizeof(OpenLayers));
    std::memset(static_cast<void*>(&this->State.Lens[block]), 0, sizeof(LensLayers));
    FinishedLayers& done = this->State.Finished[block];
    std::memset(static_cast<void*>(&done), 0, sizeof(FinishedLayers));
    std::fill_n(done.OccluderDepth, PixelsPerBlock, 1e30f);
    bool open = false, tilted = false;
    for (int l = 0; l < PixelsPerBlock; ++l)
    {
      const int i = b % blocks * BlockSize + l % BlockSize,
                j = b / blocks * BlockSize + l / BlockSize;
      if (i >= cells || j >= cells)
      {
        continue;
      }
      const CellSums sums = SumPixels(tile, i, j, cell);
      const float mean = sums.Through / static_cast<float>(sums.Pixels);
      const float start = std::max(mean, LeastStart);
      const float scale = sums.Through > 0.0f ? start / sums.Through : 0.0f;
      done.Transmittance[l] = start;
      done.ThroughX[l] = scale * sums.X;
      done.ThroughY[l] = scale * sums.Y;
      open = open || mean > MinTransmittance;
      tilted = tilted || sums.X != 0.0f || sums.Y != 0.0f;
    }
    this->Start.Before[block] = done;
    this->State.Opaque &= ~(static_cast<std::uint64_t>(open ? 1 : 0) << block);
    this->State.Tilted |= static_cast<std::uint64_t>(tilted ? 1 : 0) << block;
  }
}

std::uint64_t GaussianRun::Add(const RasterTarget& target, const SplatData& splat,
  const TilePlace& place, const RasterSettings& settings)
{
  const float cell = static_cast<float>(this->Cell), perCell = 1.0f / cell;
  Splat s = splat.Body;
  s.A *= cell * cell;
  s.B *= cell * cell;
  LensFootprint lens = *splat.Footprint;
  lens.PerPixel *= perCell;
  const int cells = TileSize / this->Cell + 1;
  const auto first = [&](int pixel) { return (pixel + this->Cell - 1) / this->Cell; };
  const PixelBox span{ first(place.Span.X0), first(place.Span.Y0),
    std::min(cells, place.Span.X1 / this->Cell + 1),
    std::min(cells, place.Span.Y1 / this->Cell + 1) };
  const TilePlace inCells{ span, place.X * perCell + 0.5f, place.Y * perCell + 0.5f };
  RasterSettings own = settings;
  own.Doubts = own.HasLayers = false;
  return target.AddGaussian(
    this->State, { s, nullptr, &lens }, inCells, own, { nullptr, nullptr, nullptr });
}

void GaussianRun::End(const RasterTarget& target, PixelTile& tile)
{
  target.AddRun(tile, this->State, this->Start, this->Cell);
  this->Cell = 0;
}
}
