// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Raster/GaussianRun.h"

#include <algorithm>
#include <cmath>

namespace SurfelSplatting
{
void GaussianRun::Begin(const RasterTarget& target, const PixelTile& tile, float cell,
  const PictureSize& part, bool doubts)
{
  this->Cell = cell;
  this->Grid = { static_cast<int>(std::lround(static_cast<float>(TileSize) / cell)), part.Width,
    part.Height, doubts };
  target.BeginRun(tile, this->Grid, this->State, this->Start);
}

// The set-up has grown a Gaussian's box by a cell, for tiles whose border has cells in it: unless
// the box ends at that of the tile, a cell less is in the support.

int GaussianRun::FirstCell(int pixel) const
{
  return pixel > 0 ? (pixel * this->Grid.Intervals + TileSize - 1) / TileSize + 1 : 0;
}

int GaussianRun::EndCell(int pixel, int size) const
{
  const int n = this->Grid.Intervals;
  return pixel < size ? pixel * n / TileSize : n + 1;
}

std::uint64_t GaussianRun::Add(const RasterTarget& target, const Splat& splat,
  const LensFootprint& lens, const TilePlace& place, const RasterSettings& settings)
{
  const float cell = this->Cell, perCell = 1.0f / cell;
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
    this->EndCell(pixels.X1, this->Grid.Width), this->EndCell(pixels.Y1, this->Grid.Height) };
  const TilePlace inCells{ span, place.X * perCell + 0.5f, place.Y * perCell + 0.5f };
  RasterSettings own = settings;
  own.HasLayers = false;
  return target.AddGaussian(
    this->State, s, &footprint, inCells, own, { nullptr, nullptr, nullptr });
}

void GaussianRun::LargestThrough(float (&behind)[BlocksPerTile]) const
{
  const int n = this->Grid.Intervals;
  float through[MostRunIntervals + 1][MostRunIntervals + 1];
  for (int j = 0; j <= n; ++j)
  {
    for (int i = 0; i <= n; ++i)
    {
      const int block = BlockOfPixel(i, j), l = LaneOfPixel(i, j);
      through[j][i] =
        this->State.Finished[block].Transmittance[l] / this->Start.Before[block].Transmittance[l];
    }
  }
  const auto begin = [n](int pixel) { return pixel * n / TileSize; };
  const auto last = [n](int pixel) {
    return ((pixel + BlockSize) * n + TileSize - 1) / TileSize; // at most n
  };
  for (int block = 0; block < BlocksPerTile; ++block)
  {
    const int x = block % BlocksPerRow * BlockSize, y = block / BlocksPerRow * BlockSize;
    float largest = 0.0f;
    for (int j = begin(y); j <= last(y); ++j)
    {
      for (int i = begin(x); i <= last(x); ++i)
      {
        largest = std::max(largest, through[j][i]);
      }
    }
    behind[block] = largest;
  }
}

void GaussianRun::End(const RasterTarget& target, PixelTile& tile)
{
  target.AddRun(tile, this->State, this->Start, this->Grid);
  this->Cell = 0.0f;
}
}
