// SPDX-License-Identifier: BSD-3-Clause
#include "TileRaster.h"

#include "ResamplingKernel.h"

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

TileRaster::Counts TileRaster::Render(const SplatList& list, const TileBins& bins, std::size_t tile,
  const Frame& frame, LazySplats* lazy)
{
  this->Place(tile, bins, frame);
  this->InSectors = list.HasSlopes;
  Counts counts = this->RenderLayers(list, bins, tile, lazy);
  if (this->InSectors && !this->Sink && this->NeedsSectors())
  {
    for (int sector = 0; sector < NumberOfSectors; ++sector)
    {
      this->SetSector(sector);
      counts.Fragments += this->RenderLayers(list, bins, tile, lazy).Fragments;
      this->AddToMean(sector == 0);
    }
    this->TakeMean();
    this->SetSector(WholeLens);
  }
  if (frame.Color)
  {
    this->Store(frame);
  }
  return counts;
}

void TileRaster::SetSector(int sector)
{
  this->Settings.Sector = SectorOf(sector);
  this->SectorIndex = static_cast<float>(sector);
}

bool TileRaster::NeedsSectors() const
{
  const float least = this->Settings.LeastConflict;
  Lanes conflict{};
  for (const PixelBlock& b : this->Blocks)
  {
    conflict = conflict > b.Conflict ? conflict : b.Conflict;
  }
  return least == 0.0f || (this->LensSpread >= LeastLensSpread && Any(conflict > least));
}

TileRaster::Counts TileRaster::RenderLayers(
  const SplatList& list, const TileBins& bins, std::size_t tile, LazySplats* lazy)
{
  this->Clear();
  this->Next = bins.Offsets[tile];
  this->Last = bins.Offsets[tile + 1];
  this->Pending.clear();
  this->PendingNext = 0;
  Counts counts;
  const std::uint32_t* run = lazy ? lazy->Begin(tile) : nullptr;
  const std::uint32_t* end = lazy ? lazy->End(tile) : nullptr;
  bool opaque = false;
  while (run != end && !opaque)
  {
    opaque = this->SkipHidden && this->IsOpaque(lazy->Near(*run));
    if (!opaque)
    {
      this->TakeRuns(*lazy, run, end);
      const float complete = run != end ? lazy->Near(*run) : Infinity;
      opaque = this->AddBefore(complete, list, bins, lazy, counts);
    }
  }
  if (!opaque)
  {
    this->AddBefore(Infinity, list, bins, lazy, counts);
  }
  counts.Hidden += this->Last - this->Next + (this->Pending.size() - this->PendingNext);
  this->CloseAll();
  return counts;
}

/// Adds a sector's pixels to the mean.
void TileRaster::AddToMean(bool first)
{
  constexpr float share = 1.0f / NumberOfSectors;
  if (first)
  {
    std::memset(static_cast<void*>(this->Mean), 0, sizeof(this->Mean));
  }
  for (int i = 0; i < BlocksPerTile; ++i)
  {
    const PixelBlock& b = this->Blocks[i];
    MeanBlock& m = this->Mean[i];
    m.Red += share * b.OutRed;
    m.Green += share * b.OutGreen;
    m.Blue += share * b.OutBlue;
    m.Transmittance += share * b.Transmittance;
    // A depth has no mean across a silhouette: that of the first sector which has one.
    m.Depth = m.Depth == 0.0f ? b.OutDepth : m.Depth;
  }
}

void TileRaster::TakeMean()
{
  for (int i = 0; i < BlocksPerTile; ++i)
  {
    PixelBlock& b = this->Blocks[i];
    const MeanBlock& m = this->Mean[i];
    b.OutRed = m.Red;
    b.OutGreen = m.Green;
    b.OutBlue = m.Blue;
    b.Transmittance = m.Transmittance;
    b.OutDepth = m.Transmittance <= 0.5f ? m.Depth : Lanes{};
  }
}

/// Takes the next runs, at least some hundred splats, into the sorted splats that are pending. As
/// many as are pending already: where all begin at one depth, the time to sort stays n log n.
void TileRaster::TakeRuns(LazySplats& lazy, const std::uint32_t*& run, const std::uint32_t* end)
{
  constexpr std::size_t enough = 256;
  this->Pending.erase(
    this->Pending.begin(), this->Pending.begin() + static_cast<std::ptrdiff_t>(this->PendingNext));
  this->PendingNext = 0;
  const std::size_t before = this->Pending.size(), wanted = before + std::max(enough, before);
  const int right = this->OriginX + TileSize, top = this->OriginY + TileSize;
  while (run != end && this->Pending.size() < wanted)
  {
    const SplatList::Part& part = lazy.Get(*run++);
    for (std::size_t i = part.Begin; i < part.Begin + part.Count; ++i)
    {
      const PixelBox& box = lazy.GetBox(i);
      if (box.X0 < right && box.X1 > this->OriginX && box.Y0 < top && box.Y1 > this->OriginY)
      {
        this->Pending.push_back(
          static_cast<std::uint64_t>(SortableBits(lazy.GetSplat(i).Near)) << 32 | i);
      }
    }
  }
  std::sort(this->Pending.begin(), this->Pending.end());
}

/// Adds all splats that begin before a depth, binned and pending ones by ascending near depth;
/// true if the tile is opaque before that.
bool TileRaster::AddBefore(
  float depth, const SplatList& list, const TileBins& bins, LazySplats* lazy, Counts& counts)
{
  // Looking whether all of the tile is opaque costs about as much as a splat.
  constexpr std::uint64_t checkEvery = 64;
  for (std::uint64_t added = 1;; ++added)
  {
    const Splat* binned =
      this->Next < this->Last ? &list.Splats[bins.Indices[this->Next]] : nullptr;
    const Splat* pending = this->PendingNext < this->Pending.size()
      ? &lazy->GetSplat(static_cast<std::uint32_t>(this->Pending[this->PendingNext]))
      : nullptr;
    const bool takeBinned = binned && (!pending || binned->Near <= pending->Near);
    const Splat* s = takeBinned ? binned : pending;
    if (!s || !(s->Near < depth || depth == Infinity))
    {
      return false;
    }
    if (this->SkipHidden && added % checkEvery == 0 && this->IsOpaque(s->Near))
    {
      return true;
    }
    if (takeBinned)
    {
      const std::uint32_t i = bins.Indices[this->Next++];
      counts.Fragments +=
        this->AddSplat(*s, s->Gradient == NoGradient ? nullptr : &list.Gradients[s->Gradient],
          list.SlopeOf(i), list.Boxes[i]);
    }
    else
    {
      const auto i = static_cast<std::uint32_t>(this->Pending[this->PendingNext++]);
      counts.Fragments +=
        this->AddSplat(*s, lazy->GetGradient(*s), lazy->GetSlope(i), lazy->GetBox(i));
      ++counts.LazyPairs;
    }
  }
}

bool TileRaster::IsOpaque(float near) const
{
  return Kernel.IsOpaque(this->Blocks, near);
}

void TileRaster::Place(std::size_t tile, const TileBins& bins, const Frame& frame)
{
  this->OriginX = static_cast<int>(tile % bins.TilesX) * TileSize;
  this->OriginY = static_cast<int>(tile / bins.TilesX) * TileSize;
  this->Width = frame.Width;
  this->Height = frame.Height;
  this->LensSpread = 0.0f;
}

void TileRaster::Clear()
{
  this->Settings.LargestColor = this->LargestCoarseColor;
  std::memset(static_cast<void*>(this->Blocks), 0, sizeof(this->Blocks));
  for (int i = 0; i < BlocksPerTile; ++i)
  {
    PixelBlock& b = this->Blocks[i];
    Set(b.Near, Infinity);
    Set(b.Far, -Infinity);
    Set(b.Limit, Infinity);
    const int y = this->OriginY + i / BlocksPerRow;
    const int x = this->OriginX + i % BlocksPerRow * LaneCount;
    for (int l = 0; l < LaneCount; ++l)
    {
      // Pixels beyond the picture are finished from the start.
      b.Transmittance[l] = y < this->Height && x + l < this->Width ? 1.0f : 0.0f;
    }
    if (this->DepthLimit && y < this->Height)
    {
      const float* limit = this->DepthLimit + static_cast<std::size_t>(y) * this->Width;
      for (int l = 0; l < LaneCount && x + l < this->Width; ++l)
      {
        b.Limit[l] = limit[x + l];
      }
    }
  }
}

/// How far a splat's fragments are apart on the lens.
void TileRaster::NoteSpread(const Splat& s, const LensSlope* slope)
{
  if (s.Shape == static_cast<float>(TentShape))
  {
    this->LensSpread = 1.0f; // only wide splats are on coarse grids
  }
  else if (slope && slope->Point != 0.0f)
  {
    const float reach = std::sqrt(this->Settings.Support / std::min(s.A, s.B));
    this->LensSpread = std::max(this->LensSpread, std::abs(slope->Point) * reach);
  }
}

std::uint64_t TileRaster::AddSplat(
  const Splat& s, const SplatGradient* gradient, const LensSlope* slope, const PixelBox& box)
{
  const bool tent = s.Shape == static_cast<float>(TentShape);
  if (this->InSectors && this->SectorIndex == WholeLens)
  {
    this->NoteSpread(s, slope);
  }
  if (tent && this->InSectors && s.K != this->SectorIndex)
  {
    return 0; // another sector's
  }
  if (!tent) // those of coarse grids are counted already
  {
    this->Settings.LargestColor = std::max({ this->Settings.LargestColor, s.Red, s.Green, s.Blue });
  }
  const int rowBegin = std::max(0, box.Y0 - this->OriginY);
  const int rowEnd = std::min(TileSize, box.Y1 - this->OriginY);
  const float x = s.X - static_cast<float>(this->OriginX);
  const float y = s.Y - static_cast<float>(this->OriginY);
  return Kernel.AddSplat(this->Blocks, s, gradient, slope, rowBegin, rowEnd, x, y, this->Settings,
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

void TileRaster::Store(const Frame& frame) const
{
  const int tileX = this->OriginX, tileY = this->OriginY;
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
