// SPDX-License-Identifier: BSD-3-Clause
#include "TileRaster.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace SurfelSplatting
{
namespace
{
constexpr float Infinity = std::numeric_limits<float>::infinity();
const RasterKernel Kernel = SelectRasterKernel();
}

TileRaster::Counts TileRaster::Render(
  const SplatList& list, const TileBins& bins, std::size_t tile, const Frame& frame)
{
  // Looking whether all of the tile is opaque costs about as much as a splat.
  constexpr std::uint64_t checkEvery = 64;
  const int tileX = static_cast<int>(tile % bins.TilesX) * TileSize;
  const int tileY = static_cast<int>(tile / bins.TilesX) * TileSize;
  this->Clear(tileX, tileY, frame);
  Counts counts;
  const std::uint64_t first = bins.Offsets[tile], last = bins.Offsets[tile + 1];
  for (std::uint64_t i = first; i < last; ++i)
  {
    const std::uint32_t splat = bins.Indices[i];
    const Splat& s = list.Splats[splat];
    if (this->SkipHidden && (i - first) % checkEvery == checkEvery - 1 &&
      Kernel.IsOpaque(this->Blocks, s.Near))
    {
      counts.Hidden = last - i;
      break;
    }
    counts.Fragments += this->AddSplat(
      s, s.Gradient == NoGradient ? nullptr : &list.Gradients[s.Gradient], list.Boxes[splat]);
  }
  this->CloseAll();
  if (frame.Color)
  {
    this->Store(tileX, tileY, frame);
  }
  return counts;
}

void TileRaster::Clear(int tileX, int tileY, const Frame& frame)
{
  this->OriginX = tileX;
  this->OriginY = tileY;
  this->Width = frame.Width;
  this->Height = frame.Height;
  std::memset(static_cast<void*>(this->Blocks), 0, sizeof(this->Blocks));
  for (int i = 0; i < BlocksPerTile; ++i)
  {
    PixelBlock& b = this->Blocks[i];
    Set(b.Near, Infinity);
    Set(b.Far, -Infinity);
    Set(b.Limit, Infinity);
    const int y = tileY + i / BlocksPerRow;
    const int x = tileX + i % BlocksPerRow * LaneCount;
    for (int l = 0; l < LaneCount; ++l)
    {
      // Pixels beyond the picture are finished from the start.
      b.Transmittance[l] = y < frame.Height && x + l < frame.Width ? 1.0f : 0.0f;
    }
    if (this->DepthLimit && y < frame.Height)
    {
      const float* limit = this->DepthLimit + static_cast<std::size_t>(y) * frame.Width;
      for (int l = 0; l < LaneCount && x + l < frame.Width; ++l)
      {
        b.Limit[l] = limit[x + l];
      }
    }
  }
}

std::uint64_t TileRaster::AddSplat(
  const Splat& s, const SplatGradient* gradient, const PixelBox& box)
{
  const int rowBegin = std::max(0, box.Y0 - this->OriginY);
  const int rowEnd = std::min(TileSize, box.Y1 - this->OriginY);
  const float x = s.X - static_cast<float>(this->OriginX);
  const float y = s.Y - static_cast<float>(this->OriginY);
  return Kernel.AddSplat(this->Blocks, s, gradient, rowBegin, rowEnd, x, y, this->Settings,
    { this->Sink ? &TileRaster::SendToSink : nullptr, this });
}

void TileRaster::SendToSink(void* self, const PixelBlock& block, int index, const LaneMask& lanes)
{
  const auto* raster = static_cast<const TileRaster*>(self);
  const int y = raster->OriginY + index / BlocksPerRow;
  const int x = raster->OriginX + index % BlocksPerRow * LaneCount;
  for (int l = 0; l < LaneCount; ++l)
  {
    const bool inside = x + l < raster->Width && y < raster->Height;
    if (inside && lanes[l] && block.Weight[l] > 0.0f)
    {
      Layer layer;
      layer.Near = block.Near[l];
      layer.Far = block.Far[l];
      layer.Weight = block.Weight[l];
      layer.Opacity = block.Opacity[l];
      layer.Red = block.Red[l];
      layer.Green = block.Green[l];
      layer.Blue = block.Blue[l];
      layer.Depth = block.Depth[l];
      raster->Sink->Receive(x + l, y, layer);
    }
  }
}

void TileRaster::CloseAll()
{
  if (this->Sink)
  {
    for (int i = 0; i < BlocksPerTile; ++i)
    {
      SendToSink(this, this->Blocks[i], i, LaneMask{} - 1);
    }
  }
  Kernel.CloseAll(this->Blocks, this->Settings);
}

void TileRaster::Store(int tileX, int tileY, const Frame& frame) const
{
  const int columns = std::min(TileSize, frame.Width - tileX);
  const int rows = std::min(TileSize, frame.Height - tileY);
  for (int j = 0; j < rows; ++j)
  {
    const std::size_t first = static_cast<std::size_t>(tileY + j) * frame.Width + tileX;
    for (int i = 0; i < columns; ++i)
    {
      const PixelBlock& b = this->Blocks[j * BlocksPerRow + i / LaneCount];
      const int l = i % LaneCount;
      float* rgba = frame.Color + 4 * (first + i);
      rgba[0] = b.OutRed[l];
      rgba[1] = b.OutGreen[l];
      rgba[2] = b.OutBlue[l];
      rgba[3] = 1.0f - b.Transmittance[l];
      frame.Depth[first + i] = b.OutDepth[l];
    }
  }
}
}
