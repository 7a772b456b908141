// SPDX-License-Identifier: BSD-3-Clause
#include "TileRaster.h"

#include "Multiversion.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace SurfelSplatting
{
namespace
{
constexpr float Infinity = std::numeric_limits<float>::infinity();

/// exp(-x) for x in [0, 80] to 2e-7 relative: 2^n times Cephes' polynomial for 2^f, f in [-1/2, 1/2].
SURFELSPLATTING_INLINE float ExpOfMinus(float x)
{
  const float t = x * -1.44269504f;
  const float shifted = t + 12582912.0f; // 1.5 * 2^23: rounds to the nearest integer in the low bits
  const float f = t - (shifted - 12582912.0f);
  float p = 1.535336188e-4f;
  p = p * f + 1.339887440e-3f;
  p = p * f + 9.618437357e-3f;
  p = p * f + 5.550332471e-2f;
  p = p * f + 2.402264791e-1f;
  p = p * f + 6.931472028e-1f;
  p = p * f + 1.0f;
  std::int32_t bits;
  std::memcpy(&bits, &shifted, sizeof(bits));
  bits = (bits + 127) << 23; // the shift drops the 1.5 * 2^23 part
  float scale;
  std::memcpy(&scale, &bits, sizeof(scale));
  return p * scale;
}

/// Composites the open layers of the marked lanes (close[l] = 1) over what is finished and empties them.
SURFELSPLATTING_INLINE void CloseLayers(PixelBlock& b, const float* close)
{
  for (int l = 0; l < BlockWidth; ++l)
  {
    const float weight = b.Weight[l];
    const float depth = b.Depth[l] / std::max(weight, 1e-30f);
    // A layer behind an opaque prop contributes nothing.
    const float visible = depth <= b.Limit[l] ? close[l] : 0.0f;
    const float scale = visible / std::max(1.0f, weight);
    const float before = b.Transmittance[l];
    const float share = before * scale;
    b.OutRed[l] += share * b.Red[l];
    b.OutGreen[l] += share * b.Green[l];
    b.OutBlue[l] += share * b.Blue[l];
    const float after = std::max(0.0f, before - share * b.Opacity[l]);
    const bool median = before > 0.5f && after <= 0.5f;
    b.OutDepth[l] = median ? depth : b.OutDepth[l];
    b.Transmittance[l] = after;
  }
  for (int l = 0; l < BlockWidth; ++l)
  {
    const bool keep = close[l] == 0.0f;
    b.Near[l] = keep ? b.Near[l] : Infinity;
    b.Far[l] = keep ? b.Far[l] : -Infinity;
    b.Weight[l] = keep ? b.Weight[l] : 0.0f;
    b.Opacity[l] = keep ? b.Opacity[l] : 0.0f;
    b.Red[l] = keep ? b.Red[l] : 0.0f;
    b.Green[l] = keep ? b.Green[l] : 0.0f;
    b.Blue[l] = keep ? b.Blue[l] : 0.0f;
    b.Depth[l] = keep ? b.Depth[l] : 0.0f;
  }
}

/// A splat's constants at one row of a tile.
struct RowSetup
{
  float Offset; ///< u = lane + Offset, so that q = A u^2 + Q0
  float Q0;
  float Depth0; ///< depth at lane 0 of the tile's row
};

/// Weights of eight pixels; returns how many are inside the support.
SURFELSPLATTING_INLINE int EvaluateWeights(
  const Splat& s, const RowSetup& row, int firstLane, float support, float* weight)
{
  int inside = 0;
  for (int l = 0; l < BlockWidth; ++l)
  {
    const float u = static_cast<float>(firstLane + l) + row.Offset;
    const float q = s.A * u * u + row.Q0;
    const float k = s.Weight * ExpOfMinus(0.5f * std::min(q, support));
    weight[l] = q < support ? k : 0.0f;
    inside += q < support ? 1 : 0;
  }
  return inside;
}

/// Marks the lanes whose open layer ends before the splat begins; returns how many.
SURFELSPLATTING_INLINE int FindFinished(
  const PixelBlock& b, const Splat& s, const float* weight, float* close)
{
  int finished = 0;
  for (int l = 0; l < BlockWidth; ++l)
  {
    const bool ends = (weight[l] > 0.0f) & (b.Weight[l] > 0.0f) & (s.Near > b.Far[l]);
    close[l] = ends ? 1.0f : 0.0f;
    finished += ends ? 1 : 0;
  }
  return finished;
}

SURFELSPLATTING_INLINE void Accumulate(
  PixelBlock& b, const Splat& s, const RowSetup& row, int firstLane, const float* weight)
{
  const float red = s.Red * s.Opacity, green = s.Green * s.Opacity, blue = s.Blue * s.Opacity;
  for (int l = 0; l < BlockWidth; ++l)
  {
    const float w = weight[l];
    const float depth = row.Depth0 + s.DepthX * static_cast<float>(firstLane + l);
    b.Near[l] = w > 0.0f ? std::min(b.Near[l], s.Near) : b.Near[l];
    b.Far[l] = w > 0.0f ? std::max(b.Far[l], s.Far) : b.Far[l];
    b.Weight[l] += w;
    b.Opacity[l] += w * s.Opacity;
    b.Red[l] += w * red;
    b.Green[l] += w * green;
    b.Blue[l] += w * blue;
    b.Depth[l] += w * depth;
  }
}

template <typename ToSink>
SURFELSPLATTING_INLINE std::uint64_t RasterSplat(PixelBlock* blocks, const Splat& s, int rowBegin,
  int rowEnd, int laneBegin, int laneEnd, float x, float y, float support, ToSink&& toSink)
{
  std::uint64_t fragments = 0;
  for (int j = rowBegin; j < rowEnd; ++j)
  {
    const float dy = static_cast<float>(j) + 0.5f - y;
    const float q0 = s.B * dy * dy;
    if (!(q0 < support))
    {
      continue;
    }
    // u = dx + K dy with dx = lane + 1/2 - x; the row's span is |u| < sqrt((support - q0) / A).
    const float offset = 0.5f - x + s.K * dy;
    const float half = std::sqrt((support - q0) / s.A);
    const float left = std::min(std::max(-offset - half, static_cast<float>(laneBegin)), 64.0f);
    const float right = std::max(std::min(-offset + half, static_cast<float>(laneEnd - 1)), -1.0f);
    const int blockBegin = static_cast<int>(left) / BlockWidth;
    const int blockEnd = right < 0.0f ? 0 : static_cast<int>(right) / BlockWidth + 1;
    const RowSetup row{ offset, q0, s.Depth + s.DepthX * (0.5f - x) + s.DepthY * dy };
    for (int i = blockBegin; i < blockEnd; ++i)
    {
      PixelBlock& block = blocks[j * BlocksPerRow + i];
      alignas(32) float weight[BlockWidth];
      alignas(32) float close[BlockWidth];
      const int inside = EvaluateWeights(s, row, i * BlockWidth, support, weight);
      if (inside == 0)
      {
        continue;
      }
      fragments += inside;
      if (FindFinished(block, s, weight, close) != 0)
      {
        toSink(block, j * BlocksPerRow + i, close);
        CloseLayers(block, close);
      }
      Accumulate(block, s, row, i * BlockWidth, weight);
    }
  }
  return fragments;
}

SURFELSPLATTING_MULTIVERSION std::uint64_t RasterSplatPlain(PixelBlock* blocks, const Splat& s,
  int rowBegin, int rowEnd, int laneBegin, int laneEnd, float x, float y, float support)
{
  return RasterSplat(blocks, s, rowBegin, rowEnd, laneBegin, laneEnd, x, y, support,
    [](const PixelBlock&, int, const float*) {});
}

SURFELSPLATTING_MULTIVERSION void CloseAllLayers(PixelBlock* blocks)
{
  alignas(32) float close[BlockWidth];
  std::fill_n(close, BlockWidth, 1.0f);
  for (int i = 0; i < BlocksPerTile; ++i)
  {
    CloseLayers(blocks[i], close);
  }
}
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
    std::fill_n(b.Near, BlockWidth, Infinity);
    std::fill_n(b.Far, BlockWidth, -Infinity);
    std::fill_n(b.Transmittance, BlockWidth, 1.0f);
    std::fill_n(b.Limit, BlockWidth, Infinity);
    const int y = tileY + i / BlocksPerRow;
    const int x = tileX + i % BlocksPerRow * BlockWidth;
    if (this->DepthLimit && y < frame.Height)
    {
      const float* limit = this->DepthLimit + static_cast<std::size_t>(y) * frame.Width;
      for (int l = 0; l < BlockWidth && x + l < frame.Width; ++l)
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
  const int laneBegin = std::max(0, box.X0 - this->OriginX);
  const int laneEnd = std::min(TileSize, box.X1 - this->OriginX);
  const float x = s.X - static_cast<float>(this->OriginX);
  const float y = s.Y - static_cast<float>(this->OriginY);
  if (!this->Sink)
  {
    return RasterSplatPlain(
      this->Blocks, s, rowBegin, rowEnd, laneBegin, laneEnd, x, y, this->Support);
  }
  return RasterSplat(this->Blocks, s, rowBegin, rowEnd, laneBegin, laneEnd, x, y, this->Support,
    [this](const PixelBlock& block, int index, const float* close) {
      unsigned int lanes = 0;
      for (int l = 0; l < BlockWidth; ++l)
      {
        lanes |= close[l] != 0.0f ? 1u << l : 0u;
      }
      this->SendToSink(block, index, lanes);
    });
}

void TileRaster::SendToSink(
  const PixelBlock& block, std::size_t index, unsigned int lanes) const
{
  const int y = this->OriginY + static_cast<int>(index) / BlocksPerRow;
  const int x = this->OriginX + static_cast<int>(index) % BlocksPerRow * BlockWidth;
  for (int l = 0; l < BlockWidth; ++l)
  {
    const bool inside = x + l < this->Width && y < this->Height;
    if (inside && (lanes >> l & 1u) && block.Weight[l] > 0.0f)
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
      this->Sink->Receive(x + l, y, layer);
    }
  }
}

void TileRaster::CloseAll()
{
  if (this->Sink)
  {
    for (int i = 0; i < BlocksPerTile; ++i)
    {
      this->SendToSink(this->Blocks[i], i, (1u << BlockWidth) - 1u);
    }
  }
  CloseAllLayers(this->Blocks);
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
      const PixelBlock& b = this->Blocks[j * BlocksPerRow + i / BlockWidth];
      const int l = i % BlockWidth;
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
