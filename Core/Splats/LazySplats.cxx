// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Splats/LazySplats.h"

#include "Core/Splats/CentralSplats.h"

#include <algorithm>
#include <chrono>
#include <limits>
#include <thread>

namespace SurfelSplatting
{
void LazySplats::Clear(const SplatContext& context)
{
  this->Context = context;
  this->Context.CoarseGrids = false;
  this->NumberOfClouds = 0;
  this->HasGuards = false;
  this->List.Clear(context.HasLens());
  this->List.SharedGradients = context.Central ? &context.Central->AllGradients() : nullptr;
  this->Runs.clear();
}

void LazySplats::Add(const SurfelCloud& cloud, const CutRanges& runs)
{
  if (this->NumberOfClouds == this->Makers.size())
  {
    this->Makers.push_back(std::make_unique<SplatMaker>());
  }
  SplatMaker& maker = *this->Makers[this->NumberOfClouds++];
  maker.Set(this->Context, cloud);
  this->HasGuards = this->HasGuards || cloud.Guard;
  for (const CutRange* run = runs.Begin; run != runs.End; ++run)
  {
    this->Runs.push_back({ &maker, *run });
  }
}

/// Runs of equal depth stay in the order of the clouds and their leaves.
void LazySplats::SortRuns()
{
  this->Order.clear();
  for (std::size_t r = 0; r < this->Runs.size(); ++r)
  {
    this->Order.push_back(
      static_cast<std::uint64_t>(SortableBits(this->Runs[r].Chosen.Near)) << 32 | r);
  }
  this->Sorter.Sort(this->Order);
  if (this->NumberOfStates < this->Runs.size())
  {
    this->NumberOfStates = this->Runs.size();
    this->States = std::make_unique<std::atomic<unsigned char>[]>(this->NumberOfStates);
  }
  std::size_t splats = 0;
  for (std::size_t r = 0; r < this->Runs.size(); ++r)
  {
    this->Runs[r].Part.Begin = splats;
    splats += this->Runs[r].Chosen.Count;
    this->States[r].store(NotStarted, std::memory_order_relaxed);
  }
  this->List.Resize(splats);
}

void LazySplats::Bin(const PictureSize& size)
{
  this->SortRuns();
  const int tilesX = TileCount(size.Width);
  const std::size_t tiles = static_cast<std::size_t>(tilesX) * TileCount(size.Height);
  this->Offsets.assign(tiles + 1, 0);
  const auto forPairs = [&](auto&& function) {
    for (const std::uint64_t key : this->Order)
    {
      const auto run = static_cast<std::uint32_t>(key);
      const PixelBox& box = this->Runs[run].Chosen.Box;
      if (!SurfelSplatting::IsEmpty(box))
      {
        ForTiles(box, tilesX, [&](std::size_t tile) { function(tile, run); });
      }
    }
  };
  forPairs([&](std::size_t tile, std::uint32_t) { ++this->Offsets[tile + 1]; });
  for (std::size_t tile = 0; tile < tiles; ++tile)
  {
    this->Offsets[tile + 1] += this->Offsets[tile];
  }
  this->TileRuns.resize(this->Offsets[tiles]);
  this->Cursors.assign(this->Offsets.begin(), this->Offsets.end() - 1);
  forPairs(
    [&](std::size_t tile, std::uint32_t run) { this->TileRuns[this->Cursors[tile]++] = run; });
}

void LazySplats::Prefetch(std::uint32_t run) const
{
  const Run& r = this->Runs[run];
  if (this->States[run].load(std::memory_order_relaxed) == NotStarted)
  {
    r.Maker->Prefetch(r.Chosen);
    return;
  }
  // A run has about 16 splats: a cache line of depths, four of boxes.
  constexpr std::size_t boxesPerLine = 64 / sizeof(PixelBox);
  __builtin_prefetch(&this->List.Nears[r.Part.Begin]);
  for (std::size_t i = 0; i < r.Chosen.Count; i += boxesPerLine)
  {
    __builtin_prefetch(&this->List.Boxes[r.Part.Begin + i]);
  }
}

void LazySplats::Announce(const std::uint32_t* run, const std::uint32_t* end) const
{
  constexpr std::ptrdiff_t ahead = 64; // about a tile's splats
  if (!this->HasGuards)
  {
    return;
  }
  for (const std::uint32_t* next = run; next != run + std::min(ahead, end - run); ++next)
  {
    if (this->States[*next].load(std::memory_order_relaxed) == NotStarted)
    {
      this->Runs[*next].Maker->Announce(this->Runs[*next].Chosen);
    }
  }
}

const SplatList::Part& LazySplats::Get(std::uint32_t run)
{
  std::atomic<unsigned char>& state = this->States[run];
  unsigned char seen = state.load(std::memory_order_acquire);
  if (seen == NotStarted &&
    state.compare_exchange_strong(seen, InProgress, std::memory_order_acquire))
  {
    try
    {
      this->Make(this->Runs[run]);
    }
    catch (...)
    {
      state.store(Ready, std::memory_order_release); // without splats; others must not wait forever
      throw;
    }
    state.store(Ready, std::memory_order_release);
  }
  // If another thread is making it now, that takes a few microseconds.
  while (state.load(std::memory_order_acquire) != Ready)
  {
    std::this_thread::yield();
  }
  return this->Runs[run].Part;
}

PixelBox LazySplats::Union(const SplatList::Part& part) const
{
  constexpr int most = std::numeric_limits<int>::max();
  PixelBox all{ most, most, 0, 0 };
  for (std::size_t i = part.Begin; i < part.Begin + part.Count; ++i)
  {
    const PixelBox& box = this->List.Boxes[i];
    all = { std::min(all.X0, box.X0), std::min(all.Y0, box.Y0), std::max(all.X1, box.X1),
      std::max(all.Y1, box.Y1) };
  }
  return all;
}

void LazySplats::Make(Run& run)
{
  const auto start = std::chrono::steady_clock::now();
  SplatOutput output = this->List.OutputAt(run.Part.Begin);
  run.Maker->Make(run.Chosen, output);
  run.Part.Take(output);
  run.Box = this->Union(run.Part);
  run.Seconds = std::chrono::duration<float>(std::chrono::steady_clock::now() - start).count();
}

LazySplats::Counts LazySplats::Count() const
{
  Counts counts;
  for (std::size_t r = 0; r < this->Runs.size(); ++r)
  {
    const Run& run = this->Runs[r];
    counts.Splats += run.Part.Count;
    counts.Invalid += run.Part.Invalid;
    counts.Blurred += run.Part.Blurred;
    counts.Seconds += run.Seconds;
    counts.Hidden +=
      this->States[r].load(std::memory_order_relaxed) == Ready ? 0 : run.Chosen.Count;
  }
  return counts;
}
}
