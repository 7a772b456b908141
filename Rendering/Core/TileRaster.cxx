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

std::uint64_t TileRaster::Render(
  const SplatList& list, const TileBins& bins, std::size_t tile, const Frame& frame)
{
  const int tileX = static_cast<int>(tile % bins.TilesX) * TileSize;
  const int tileY = static_cast<int>(tile / bins.TilesX) * TileSize;
  this->Clear(tileX, tileY, frame);
  std::uint64_t fragments = 0;
  for (std::uint64_t i = bins.Offsets[tile]; i < bins.Offsets[tile + 1]; ++i)
  {
    const std::uint32_t splat = bins.Indices[i];
    fragments += this->AddSplat(list.Splats[splat], list.Boxes[splat]);
  }
  this->CloseAll();
  this->Store(tileX, tileY, frame);
  return fragments;
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
    Set(b.Transmittance, 1.0f);
    Set(b.Limit, Infinity);
    const int y = tileY + i / BlocksPerRow;
    const int x = tileX + i % BlocksPerRow * LaneCount;
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

std::uint64_t TileRaster::AddSplat(const Splat& s, const PixelBox& box)
{
  const int rowBegin = std::max(0, box.Y0 - this->OriginY);
  const int rowEnd = std::min(TileSize, box.Y1 - this->OriginY);
  const float x = s.X - static_cast<float>(this->OriginX);
  const float y = s.Y - static_cast<float>(this->OriginY);
  return Kernel.AddSplat(this->Blocks, s, rowBegin, rowEnd, x, y, this->Support,
    { this->Sink ? &TileRaster::SendToSink : nullptr, this });
}

void TileRaster::SendToSink(
  void* self, const PixelBlock& block, int index, const LaneMask& lanes)
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
  Kernel.CloseAll(this->Blocks);
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
