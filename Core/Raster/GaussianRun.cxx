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

/// Sums over the pixels of a cell, weighted with T, since nothing is seen behind a closed pixel.
struct CellSums
{
  float Weight = 0.0f, Through = 0.0f, X = 0.0f, Y = 0.0f;
  float Rim = 0.0f, Across = 0.0f, Diagonal = 0.0f;

  float Mean() const { return this->Weight > 0.0f ? this->Through / this->Weight : 0.0f; }
};

/// Pixels up to `reach` from a cell's centre along an axis. A cell outside of the picture has its
/// last pixel.
struct CellPixels
{
  int Begin, End;

  CellPixels(int center, int reach, int size)
    : Begin(std::min(std::max(0, center - reach), size - 1))
    , End(std::max(std::min(size, center + reach), this->Begin + 1))
  {
  }
};

CellSums SumPixels(const PixelTile& tile, const CellPixels& columns, const CellPixels& rows)
{
  CellSums sums;
  for (int y = rows.Begin; y < rows.End; ++y)
  {
    for (int x = columns.Begin; x < columns.End; ++x)
    {
      const FinishedLayers& done = tile.Finished[BlockOfPixel(x, y)];
      const int l = LaneOfPixel(x, y);
      const float weight = done.Transmittance[l];
      sums.Weight += weight;
      sums.Through += weight * done.Transmittance[l];
      sums.X += weight * done.ThroughX[l];
      sums.Y += weight * done.ThroughY[l];
      sums.Rim += weight * done.ThroughRim[l];
      sums.Across += weight * done.ThroughAcross[l];
      sums.Diagonal += weight * done.ThroughDiagonal[l];
    }
  }
  return sums;
}

/// Copies the doubt about a pixel, but not its drifts: a cell has those of the run.
void CopyDoubt(const DoubtedLayers& from, int pixel, DoubtedLayers& to, int cell)
{
  to.Width[cell] = from.Width[pixel];
  to.Variation[cell] = from.Variation[pixel];
  to.Red[cell] = from.Red[pixel];
  to.Green[cell] = from.Green[pixel];
  to.Blue[cell] = from.Blue[pixel];
  to.RedDrift[cell] = to.GreenDrift[cell] = to.BlueDrift[cell] = 0.0f;
}

/// Sums over a cell's own pixels. If these are dark, sums over all that take something over from
/// the cell, since some of them may be open.
CellSums SumCell(const PixelTile& tile, const int (&center)[2], int cell, const int (&size)[2])
{
  constexpr float dark = 0.25f;
  const auto sum = [&](int reach) {
    return SumPixels(tile, { center[0], reach, size[0] }, { center[1], reach, size[1] });
  };
  const CellSums own = sum(cell / 2);
  return own.Mean() < dark ? sum(cell) : own;
}
}

void GaussianRun::Begin(const PixelTile& tile, int cell, int width, int height, bool doubts)
{
  this->Doubts = doubts;
  this->Cell = cell;
  this->Width = width;
  this->Height = height;
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
      const CellSums sums = SumCell(tile, { i * cell, j * cell }, cell, { width, height });
      const float mean = sums.Mean();
      const float start = std::max(mean, LeastStart);
      const float scale = sums.Through > 0.0f ? start / sums.Through : 0.0f;
      done.Transmittance[l] = start;
      done.ThroughX[l] = scale * sums.X;
      done.ThroughY[l] = scale * sums.Y;
      done.ThroughRim[l] = scale * sums.Rim;
      done.ThroughAcross[l] = scale * sums.Across;
      done.ThroughDiagonal[l] = scale * sums.Diagonal;
      open = open || mean > MinTransmittance;
      if (doubts)
      {
        const int x = std::min(i * cell, width - 1), y = std::min(j * cell, height - 1);
        CopyDoubt(
          tile.Doubted[BlockOfPixel(x, y)], LaneOfPixel(x, y), this->State.Doubted[block], l);
      }
      tilted = tilted || sums.X != 0.0f || sums.Y != 0.0f;
    }
    this->Start.Before[block] = done;
    this->State.Opaque &= ~(static_cast<std::uint64_t>(open ? 1 : 0) << block);
    this->State.Tilted |= static_cast<std::uint64_t>(tilted ? 1 : 0) << block;
  }
}

// The set-up has grown a Gaussian's box by a cell, for tiles whose border has cells in it: unless
// the box ends at that of the tile, a cell less is in the support.

int GaussianRun::FirstCell(int pixel) const
{
  return pixel > 0 ? (pixel + this->Cell - 1) / this->Cell + 1 : 0;
}

int GaussianRun::EndCell(int pixel, int size) const
{
  return pixel < size ? pixel / this->Cell : TileSize / this->Cell + 1;
}

std::uint64_t GaussianRun::Add(const RasterTarget& target, const Splat& splat,
  const LensFootprint& lens, const TilePlace& place, const RasterSettings& settings)
{
  const float cell = static_cast<float>(this->Cell), perCell = 1.0f / cell;
  Splat s = splat;
  s.A *= cell * cell;
  s.B *= cell * cell;
  SpaceFootprint scaled = SpaceFootprintOf(lens);
  scaled.Quarter *= perCell;
  for (float* slope :
    { &scaled.RedX, &scaled.GreenX, &scaled.BlueX, &scaled.RedY, &scaled.GreenY, &scaled.BlueY })
  {
    *slope *= cell;
  }
  const LensFootprint footprint = StoredOf(scaled);
  const PixelBox& pixels = place.Span;
  const PixelBox span{ this->FirstCell(pixels.X0), this->FirstCell(pixels.Y0),
    this->EndCell(pixels.X1, this->Width), this->EndCell(pixels.Y1, this->Height) };
  const TilePlace inCells{ span, place.X * perCell + 0.5f, place.Y * perCell + 0.5f };
  RasterSettings own = settings;
  own.HasLayers = false;
  return target.AddGaussian(
    this->State, s, &footprint, inCells, own, { nullptr, nullptr, nullptr });
}

float GaussianRun::LargestThrough() const
{
  const int cells = TileSize / this->Cell + 1, blocks = (cells + BlockSize - 1) / BlockSize;
  float largest = 0.0f;
  for (int b = 0; b < blocks * blocks; ++b)
  {
    const int block = b / blocks * BlocksPerRow + b % blocks;
    const float* now = this->State.Finished[block].Transmittance;
    const float* before = this->Start.Before[block].Transmittance;
    for (int l = 0; l < PixelsPerBlock; ++l)
    {
      largest = std::max(largest, before[l] > 0.0f ? now[l] / before[l] : 0.0f);
    }
  }
  return largest;
}

void GaussianRun::End(const RasterTarget& target, PixelTile& tile)
{
  target.AddRun(tile, this->State, this->Start, this->Cell, this->Doubts);
  this->Cell = 0;
}
}
