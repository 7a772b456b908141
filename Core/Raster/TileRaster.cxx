// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Raster/TileRaster.h"

#include "Core/Raster/AncestorChoice.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <iterator>
#include <limits>

namespace SurfelSplatting
{
namespace
{
constexpr float Infinity = std::numeric_limits<float>::infinity();
const RasterTarget Target = SelectRasterTarget();

/// Splats are read in the order of depth, not of memory, so this many are prefetched.
constexpr std::size_t FetchAhead = 16;

/// A tent's place is known only after its pointer has been read.
inline __attribute__((always_inline)) void PrefetchPlace(const SplatList& list, std::size_t i)
{
  if (list.IsTent(i))
  {
    __builtin_prefetch(&list.Tents[i - list.Splats.Size()]);
  }
}

/// GCC 12 treats a function that only prefetches as one without effects, and drops calls of it that
/// are not inlined early.
inline __attribute__((always_inline)) void Prefetch(const SplatList& list, std::size_t i)
{
  if (list.IsTent(i))
  {
    const char* tent = reinterpret_cast<const char*>(&list.TentAt(i));
    __builtin_prefetch(tent);
    __builtin_prefetch(tent + sizeof(Tent) / 2);
    return;
  }
  __builtin_prefetch(&list.Splats[i]);
  __builtin_prefetch(&list.Boxes[i]);
  __builtin_prefetch(list.FootprintOf(i));
}
}

void TileRaster::Set(
  const RasterSettings& settings, const float* occluderDepth, LayerSink* sink, bool skipHidden)
{
  this->Settings = settings;
  this->LargestCoarseColor = settings.LargestColor;
  this->OccluderDepth = occluderDepth;
  this->Sink = sink;
  this->Cells = nullptr;
  this->SkipHidden = skipHidden && !sink;
  this->Settings.ShortCuts = this->SkipHidden;
}

void TileRaster::SetCoarse(const RasterSettings& settings, CellSink& cells)
{
  this->Set(settings, nullptr, nullptr, false);
  this->Settings.Pass = RasterPass::Collect;
  this->Cells = &cells;
}

TileRaster::Counts TileRaster::Render(const SplatList& list, const TileBins& bins, std::size_t tile,
  const Frame& frame, LazySplats* lazy)
{
  const PixelBox box = BoxOfTile(tile, { frame.Width, frame.Height });
  this->OriginX = box.X0;
  this->OriginY = box.Y0;
  this->Width = frame.Width;
  this->Height = frame.Height;
  if (this->Sink)
  {
    this->Sink->BeginTile(box);
  }
  const RasterPass pass = this->Settings.Pass;
  const Counts counts = pass == RasterPass::Layers || pass == RasterPass::Collect
    ? this->RenderLayers(list, bins, tile, lazy)
    : this->RenderNearest(list, bins, tile);
  if (this->Sink)
  {
    this->Sink->EndTile(box);
  }
  if (frame.Color)
  {
    this->Store(frame);
  }
  return counts;
}

TileRaster::Counts TileRaster::RenderLayers(
  const SplatList& list, const TileBins& bins, std::size_t tile, LazySplats* lazy)
{
  this->Next = bins.Offsets[tile];
  this->Last = bins.Offsets[tile + 1];
  this->Pending.clear();
  this->PendingNext = 0;
  this->PendingFar = -Infinity;
  this->Fragments = 0;
  Counts counts;
  const std::uint32_t* run = lazy ? lazy->Begin(tile) : nullptr;
  const std::uint32_t* end = lazy ? lazy->End(tile) : nullptr;
  this->IsEmpty = run == end && this->Next == this->Last;
  if (this->IsEmpty)
  {
    return counts;
  }
  this->Clear();
  // Binned splats in front of the first run are drawn first: they are not hidden if the run is.
  bool opaque = run != end && this->AddBefore(lazy->Near(*run), list, bins, lazy, counts);
  while (run != end && !opaque)
  {
    opaque = this->SkipHidden && this->BecomesOpaque(lazy->Near(*run));
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
  counts.Fragments = this->Fragments;
  counts.Doubt = this->Settings.Doubts ? this->LargestDoubt() : 0.0f;
  return counts;
}

/// The two passes of a plain z-buffer, over splats in any order.
TileRaster::Counts TileRaster::RenderNearest(
  const SplatList& list, const TileBins& bins, std::size_t tile)
{
  this->Fragments = 0;
  this->IsEmpty = false;
  this->Clear();
  for (OpenLayers& open : this->Tile.Open)
  {
    std::fill_n(open.Far, PixelsPerBlock, Infinity);
  }
  for (const RasterPass pass : { RasterPass::Depths, RasterPass::Nearest })
  {
    this->Settings.Pass = pass;
    for (std::uint64_t i = bins.Offsets[tile]; i < bins.Offsets[tile + 1]; ++i)
    {
      this->Add(list, IndexOfKey(bins.Keys[i]));
    }
    this->Flush();
  }
  this->CloseAll();
  Counts counts;
  counts.Fragments = this->Fragments;
  return counts;
}

/// Adds the next runs to the sorted pending splats: at least `enough` splats, and as many as are
/// pending already, so that sorting stays n log n if all begin at the same depth. Stops early at a
/// gap in depth, since splats behind it may be hidden.
void TileRaster::TakeRuns(LazySplats& lazy, const std::uint32_t*& run, const std::uint32_t* end)
{
  constexpr std::size_t enough = 256;
  this->Pending.erase(
    this->Pending.begin(), this->Pending.begin() + static_cast<std::ptrdiff_t>(this->PendingNext));
  this->PendingNext = 0;
  const std::size_t before = this->Pending.size(), wanted = before + std::max(enough, before);
  const int left = this->OriginX, right = left + TileSize;
  const int bottom = this->OriginY, top = bottom + TileSize;
  const SplatList& list = lazy.Splats();
  lazy.Announce(run, end);
  const AncestorChoice choose(lazy, Target, this->Tile, this->Run, this->OriginX, this->OriginY);
  // Those that are prefetched are chosen once.
  LazySplats::Wanted next = choose(*run), afterNext = run + 1 < end ? choose(run[1]) : next;
  std::size_t size = before;
  while (run != end && size < wanted && !(size > 0 && lazy.Near(*run) > this->PendingFar))
  {
    this->PendingFar = std::max(this->PendingFar, lazy.Far(*run));
    const LazySplats::Wanted wanted = next;
    next = afterNext;
    if (run + 2 < end)
    {
      lazy.Prefetch(afterNext = choose(run[2]));
    }
    ++run;
    const SplatList::Part& part = lazy.Get(wanted);
    this->Delay = std::max(this->Delay, part.LargestDelay);
    const PixelBox& all = lazy.Box(wanted);
    if (all.X0 >= right || all.X1 <= left || all.Y0 >= top || all.Y1 <= bottom)
    {
      continue;
    }
    this->Pending.resize(size + part.Count);
    for (std::size_t i = part.Begin; i < part.Begin + part.Count; ++i)
    {
      // Branch-free, because the branch could not be predicted: the next one overwrites it if it is
      // outside.
      const PixelBox& box = list.Boxes[i];
      // Negative if all of the differences are.
      const int inside = (box.X0 - right) & (left - box.X1) & (box.Y0 - top) & (bottom - box.Y1);
      this->Pending[size] = KeyOf(list.Orders[i], static_cast<std::uint32_t>(i));
      size += static_cast<unsigned int>(inside) >> 31;
    }
  }
  this->Pending.resize(size);
  this->Sorter.Sort(this->Pending.data(), this->Pending.size());
}

/// Adds all splats and tents that begin in front of a depth, binned and pending ones merged by near
/// depth; true if the tile becomes opaque before that.
bool TileRaster::AddBefore(
  float depth, const SplatList& list, const TileBins& bins, LazySplats* lazy, Counts& counts)
{
  // Checking whether all of the tile is opaque costs about as much as a splat.
  constexpr std::uint64_t checkEvery = BatchSize;
  const auto nextBinned = [&] {
    return this->Next < this->Last ? DepthOfKey(bins.Keys[this->Next]) : Infinity;
  };
  const auto nextPending = [&] {
    return this->PendingNext < this->Pending.size() ? DepthOfKey(this->Pending[this->PendingNext])
                                                    : Infinity;
  };
  float binned = nextBinned();
  for (std::uint64_t added = 0;; ++added)
  {
    const float pending = nextPending(), near = std::min(binned, pending);
    if (!(near < depth))
    {
      return false;
    }
    const bool checks = this->SkipHidden && added != 0 && added % checkEvery == 0;
    if (checks && this->BecomesOpaque(near))
    {
      return true;
    }
    // Of equal depths, splats come before tents, as in SortBins, whoever made the splats.
    if (binned == pending ? !list.IsTent(IndexOfKey(bins.Keys[this->Next])) : binned < pending)
    {
      const std::uint64_t ahead = std::min(this->Next + FetchAhead, this->Last - 1);
      const std::uint64_t farAhead = std::min(this->Next + 2 * FetchAhead, this->Last - 1);
      PrefetchPlace(list, IndexOfKey(bins.Keys[farAhead]));
      Prefetch(list, IndexOfKey(bins.Keys[ahead]));
      this->Add(list, IndexOfKey(bins.Keys[this->Next++]));
      binned = nextBinned();
    }
    else
    {
      const std::size_t ahead = std::min(this->PendingNext + FetchAhead, this->Pending.size() - 1);
      Prefetch(lazy->Splats(), IndexOfKey(this->Pending[ahead]));
      this->AddSplat(lazy->Splats(), IndexOfKey(this->Pending[this->PendingNext++]));
      ++counts.LazyPairs;
    }
  }
}

/// Pixels of a block that other props hide from a depth on.
unsigned int TileRaster::BehindProps(int block, float near) const
{
  const OpenLayers& open = this->Tile.Open[block];
  const FinishedLayers& done = this->Tile.Finished[block];
  unsigned int bits = 0;
  for (int l = 0; l < PixelsPerBlock; ++l)
  {
    // Unless an open layer could still be joined.
    const bool hidden = done.OccluderDepth[l] < near && open.Weight[l] <= 0.0f;
    bits |= (hidden ? 1u : 0u) << l;
  }
  return bits;
}

/// Whether nothing that begins at or behind a depth can change a pixel of the tile by more than
/// MinTransmittance.
bool TileRaster::IsOpaque(float near) const
{
  constexpr unsigned int all = (1u << PixelsPerBlock) - 1;
  for (int i = 0; i < BlocksPerTile; ++i)
  {
    if ((this->Tile.Opaque >> i & 1) != 0)
    {
      continue;
    }
    unsigned int hidden = Target.HiddenFrom(this->Tile, i, near, this->Settings);
    if (hidden != all && this->OccluderDepth)
    {
      hidden |= this->BehindProps(i, near);
    }
    if (hidden != all)
    {
      return false;
    }
  }
  return true;
}

/// IsOpaque() for what comes from a depth on, after what waits is added: the batch, and the run,
/// which ends if it is opaque itself.
bool TileRaster::BecomesOpaque(float near)
{
  this->Flush();
  if (this->Run.IsOpen())
  {
    if (!this->Run.IsOpaque())
    {
      return false;
    }
    this->EndRun();
  }
  return this->IsOpaque(near - this->Delay);
}

/// The background that shines through the last layers may have any colour.
float TileRaster::LargestDoubt() const
{
  float largest = 0.0f;
  for (int i = 0; i < BlocksPerTile; ++i)
  {
    const DoubtedLayers& doubted = this->Tile.Doubted[i];
    const FinishedLayers& done = this->Tile.Finished[i];
    for (int l = 0; l < PixelsPerBlock; ++l)
    {
      const float drift =
        std::max(std::max(std::abs(doubted.RedDrift[l]), std::abs(doubted.GreenDrift[l])),
          std::abs(doubted.BlueDrift[l]));
      largest =
        std::max(largest, doubted.Doubt[l] + drift + doubted.Width[l] * done.Transmittance[l]);
    }
  }
  return largest;
}

void TileRaster::Clear()
{
  this->Settings.LargestColor = this->LargestCoarseColor;
  this->Delay = this->Settings.LargestDelay;
  const bool collects = this->Settings.Pass == RasterPass::Collect;
  std::memset(static_cast<void*>(this->Tile.Open), 0, sizeof(this->Tile.Open));
  std::memset(static_cast<void*>(this->Tile.Finished), 0, sizeof(this->Tile.Finished));
  if (collects)
  {
    std::memset(static_cast<void*>(this->Tile.Coarse), 0, sizeof(this->Tile.Coarse));
  }
  if (this->Settings.Doubts)
  {
    std::memset(static_cast<void*>(this->Tile.Doubted), 0, sizeof(this->Tile.Doubted));
  }
  this->Tile.Opaque = this->Tile.Dark = this->Tile.Tilted = this->Tile.WithTents = 0;
  this->NearestProp = Infinity;
  this->Run.Drop();
  this->BatchCount = 0;
  this->Settings.HasLayers = false;
  for (int i = 0; i < BlocksPerTile; ++i)
  {
    std::fill_n(this->Tile.Open[i].Far, PixelsPerBlock, NoFar);
    std::fill_n(this->Tile.Lens[i].FillX, PixelsPerBlock, 0.0f);
    std::fill_n(this->Tile.Lens[i].FillY, PixelsPerBlock, 0.0f);
    std::fill_n(this->Tile.Finished[i].Transmittance, PixelsPerBlock, 1.0f);
    std::fill_n(this->Tile.Finished[i].OccluderDepth, PixelsPerBlock, Infinity);
    if (collects)
    {
      std::fill_n(this->Tile.Coarse[i].Near, PixelsPerBlock, Infinity);
    }
  }
  if (this->OccluderDepth || this->OriginX + TileSize > this->Width ||
    this->OriginY + TileSize > this->Height)
  {
    this->ClearPixels();
  }
}

/// Pixels outside of the picture are finished from the start; props hide what is behind them.
void TileRaster::ClearPixels()
{
  for (int i = 0; i < BlocksPerTile; ++i)
  {
    FinishedLayers& done = this->Tile.Finished[i];
    const int x0 = this->BlockX(i), y0 = this->BlockY(i);
    for (int l = 0; l < PixelsPerBlock; ++l)
    {
      const int x = x0 + l % BlockSize, y = y0 + l / BlockSize;
      const bool inside = x < this->Width && y < this->Height;
      done.Transmittance[l] = inside ? 1.0f : 0.0f;
      if (inside && this->OccluderDepth)
      {
        done.OccluderDepth[l] = this->OccluderDepth[PixelIndex(x, y, this->Width)];
        this->NearestProp = std::min(this->NearestProp, done.OccluderDepth[l]);
      }
    }
    const bool outside = x0 >= this->Width || y0 >= this->Height;
    this->Tile.Opaque |= static_cast<std::uint64_t>(outside ? 1 : 0) << i;
  }
}

inline TilePlace TileRaster::PlaceInTile(const PixelBox& box, float x, float y) const
{
  return { { std::max(0, box.X0 - this->OriginX), std::max(0, box.Y0 - this->OriginY),
             std::min(TileSize, box.X1 - this->OriginX),
             std::min(TileSize, box.Y1 - this->OriginY) },
    x - static_cast<float>(this->OriginX), y - static_cast<float>(this->OriginY) };
}

/// Adds a splat or a tent.
void TileRaster::Add(const SplatList& list, std::size_t i)
{
  list.IsTent(i) ? this->AddTent(list.TentAt(i)) : this->AddSplat(list, i);
}

void TileRaster::AddSplat(const SplatList& list, std::size_t i)
{
  const Splat& s = list.Splats[i];
  this->Settings.LargestColor =
    std::max(std::max(this->Settings.LargestColor, s.Red), std::max(s.Green, s.Blue));
  if (s.Gradient == InSpace)
  {
    this->AddGaussian(list, i);
    return;
  }
  const SplatGradient* gradient = s.Gradient == NoGradient ? nullptr : &list.GradientOf(s);
  __builtin_prefetch(gradient); // its place is known only now
  this->AddToBatch({ &s, nullptr, gradient, list.FootprintOf(i),
    this->PlaceInTile(list.Boxes[i], s.X, s.Y), this->Settings.LargestColor });
}

/// Keeps an item until the batch is full.
inline void TileRaster::AddToBatch(const BatchItem& item)
{
  this->EndRun();
  this->Settings.HasLayers = true;
  this->Batch[this->BatchCount++] = item;
  if (this->BatchCount == BatchSize)
  {
    this->Flush();
  }
}

/// Adds the batch.
void TileRaster::Flush()
{
  if (this->BatchCount > 0)
  {
    this->Fragments +=
      Target.AddBatch(this->Tile, this->Batch, this->BatchCount, this->Settings, this->Callbacks());
    this->BatchCount = 0;
  }
}

/// Whether no open layer is left that a Gaussian at a depth could lie in or behind, nor a prop in
/// front of it.
bool TileRaster::MayBeginRun(float depth) const
{
  const auto isEmpty = [](const OpenLayers& open) {
    return std::all_of(
      open.Weight, open.Weight + PixelsPerBlock, [](float w) { return w <= 0.0f; });
  };
  return depth <= this->NearestProp &&
    (!this->Settings.HasLayers ||
      std::all_of(this->Tile.Open, this->Tile.Open + BlocksPerTile, isEmpty));
}

/// Composites the run, if there is one.
void TileRaster::EndRun()
{
  if (this->Run.IsOpen())
  {
    this->Run.End(Target, this->Tile);
  }
}

void TileRaster::AddGaussian(const SplatList& list, std::size_t i)
{
  const Splat& s = list.Splats[i];
  if (this->Settings.Pass != RasterPass::Layers)
  {
    return; // a plain z-buffer, for comparison, has none of them
  }
  this->Flush();
  const LensFootprint* lens = list.FootprintOf(i);
  const TilePlace place = this->PlaceInTile(list.Boxes[i], s.X, s.Y);
  const float cell = s.DepthY;
  if (this->Run.IsOpen() && (this->Run.CellSize() != cell || s.Near > this->NearestProp))
  {
    this->EndRun();
  }
  if (!this->Run.IsOpen() && cell > 1.0f && this->MayBeginRun(s.Near))
  {
    this->Run.Begin(Target, this->Tile, cell,
      { std::min(TileSize, this->Width - this->OriginX),
        std::min(TileSize, this->Height - this->OriginY) },
      this->Settings.Doubts);
  }
  this->Fragments += this->Run.IsOpen()
    ? this->Run.Add(Target, s, *lens, place, this->Settings)
    : Target.AddGaussian(this->Tile, s, lens, place, this->Settings, this->Callbacks());
}

/// LargestColor has the tent's splats already, from the coarse grid.
void TileRaster::AddTent(const Tent& t)
{
  this->AddToBatch({ nullptr, &t, nullptr, nullptr, this->PlaceInTile(t.Box, t.X, t.Y),
    this->Settings.LargestColor });
}

RasterCallbacks TileRaster::Callbacks()
{
  return { this, this->Sink ? &TileRaster::SendToSink : nullptr,
    this->Cells ? &TileRaster::SendCells : nullptr };
}

/// Calls function(x, y, lane) for the chosen lanes of a block that are inside of the picture.
template <class Function>
void TileRaster::ForPixels(int block, unsigned int lanes, Function&& function) const
{
  for (int l = 0; l < PixelsPerBlock; ++l)
  {
    const int x = this->BlockX(block) + l % BlockSize, y = this->BlockY(block) + l / BlockSize;
    if ((lanes >> l & 1) != 0 && x < this->Width && y < this->Height)
    {
      function(x, y, l);
    }
  }
}

void TileRaster::SendCells(
  void* self, const PixelTile& tile, int block, unsigned int lanes, const CellTents& tents)
{
  const auto* raster = static_cast<const TileRaster*>(self);
  unsigned int inside = 0;
  raster->ForPixels(block, lanes, [&](int, int, int l) { inside |= 1u << l; });
  raster->Cells->Receive(
    { tile, block, raster->BlockX(block), raster->BlockY(block), inside, tents });
}

void TileRaster::SendToSink(void* self, const PixelTile& /* tile */, int block, unsigned int lanes,
  const LeakedLayers& leaked)
{
  const auto* raster = static_cast<const TileRaster*>(self);
  raster->ForPixels(block, lanes, [&](int x, int y, int l) {
    if (leaked.Alpha[l] > 0.0f)
    {
      raster->Sink->Receive(x, y,
        { leaked.Red[l], leaked.Green[l], leaked.Blue[l], leaked.Alpha[l], leaked.Depth[l],
          leaked.Coverage[l], leaked.Spread[l] });
    }
  });
}

void TileRaster::CloseAll()
{
  this->Flush();
  this->EndRun();
  Target.CloseAll(this->Tile, this->Settings, this->Callbacks());
  for (int i = 0; this->Sink && i < BlocksPerTile; ++i)
  {
    const float* count = this->Tile.Finished[i].Fragments;
    this->ForPixels(i, ~0u, [&](int x, int y, int l) {
      if (count[l] > 0.0f)
      {
        this->Sink->ReceiveFragments(x, y, count[l]);
      }
    });
  }
}
}
