// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Splats/LazySplats.h"

#include "Core/Base/Tiles.h"
#include "Core/Hierarchy/ClusterBounds.h"

#include <algorithm>
#include <chrono>
#include <limits>
#include <thread>

namespace SurfelSplatting
{
namespace
{
/// LazySplats::LittleLight at an error of 1 of the level of detail.
/// - Captures: a wall of random colours behind a curtain is off by 0.8 levels of 255 in the mean at
///   most. A sphere of a million Gaussians has 66 dB or more against all nodes of the cut and takes
///   0.8 of the time of 0.04 for the largest T; 0.1 would take 0.7.
/// - In the blur: against 128 pinholes of the same Gaussians, captures lose 0.05 dB or less; 0.2
///   would save nothing more. What counts for sharp captures, too, would save 2 % and lose up to
///   0.1 dB.
constexpr double OfVolumes = 0.04, OfCaptures = 0.05, InBlur = 0.15;

/// Coarser runs end at this level of a cloud; 0: there are none.
std::uint32_t LevelsWithCoarser(const SurfelCloud& cloud, const CutSettings& cut)
{
  if (!cloud.IsInSpace() || !cloud.Clusters || cut.Rule != CutRule::Moments)
  {
    return 0;
  }
  const int levels = cloud.Clusters->Layout().NumberOfLevels();
  return static_cast<std::uint32_t>(std::max(0, levels - LevelsToAncestors));
}
}

void LazySplats::Clear(const SplatContext& context)
{
  this->Context = context;
  this->Context.CoarseGrids = false;
  this->NumberOfClouds = 0;
  this->HasGuards = false;
  this->List.Clear(context.HasLens());
  this->Runs.clear();
  this->Little = {};
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
  const std::uint32_t levels = LevelsWithCoarser(cloud, this->Context.Cut);
  if (levels > 0)
  {
    // A smaller error asks for finer nodes, and for more of the light.
    const double error = std::min(1.0, this->Context.Cut.Error);
    this->Little = { static_cast<float>(OfVolumes * error),
      static_cast<float>(OfCaptures * error * error), static_cast<float>(InBlur * error * error) };
  }
  for (const CutRange* run = runs.Begin; run != runs.End; ++run)
  {
    // Ancestors of fewer nodes would be those of other runs as well.
    const bool hasCoarser = this->Little.InBlur > 0.0f && run->Level < levels && run->HasAncestors;
    this->Runs.push_back({ &maker, *run, hasCoarser, cloud.Kind == CloudKind::Volume });
  }
}

/// The nodes to be drawn.
CutRange LazySplats::Range(const Wanted& wanted) const
{
  const Run& run = this->Runs[wanted.Run];
  CutRange range = run.Chosen;
  if (wanted.Coarser)
  {
    const HierarchyLayout& layout = run.Maker->Cloud().Clusters->Layout();
    const HierarchyLayout::Range nodes =
      layout.Above(static_cast<int>(range.Level), { range.Begin, range.Count }, LevelsToAncestors);
    range.Begin = nodes.Begin;
    range.Count = static_cast<std::uint32_t>(nodes.Count);
    range.Level += LevelsToAncestors;
    range.FirstLeaf = range.FirstLeaf >> range.Level << range.Level;
    range.Merging = 0.0f;
  }
  return range;
}

/// Runs of equal depth stay in the order of the clouds and their leaves.
void LazySplats::SortRuns()
{
  this->Order.clear();
  for (std::size_t r = 0; r < this->Runs.size(); ++r)
  {
    this->Order.push_back(KeyOf(this->Runs[r].Chosen.Near, static_cast<std::uint32_t>(r)));
  }
  this->Sorter.Sort(this->Order.data(), this->Order.size());
  this->Coarser.assign(this->Little.InBlur > 0.0f ? this->Runs.size() : 0, {});
  const std::size_t states = this->Runs.size() + this->Coarser.size();
  if (this->NumberOfStates < states)
  {
    this->NumberOfStates = states;
    this->States = std::make_unique<std::atomic<unsigned char>[]>(states);
  }
  std::size_t splats = 0;
  for (Run& run : this->Runs)
  {
    run.Own.Part.Begin = splats;
    splats += run.Chosen.Count;
  }
  for (std::uint32_t r = 0; r < this->Coarser.size(); ++r)
  {
    this->Coarser[r].Part.Begin = splats;
    splats += this->Runs[r].HasCoarser ? this->Range({ r, true }).Count : 0;
  }
  for (std::size_t s = 0; s < states; ++s)
  {
    this->States[s].store(NotStarted, std::memory_order_relaxed);
  }
  this->List.Resize(splats);
}

void LazySplats::Bin(const PictureSize& size)
{
  this->SortRuns();
  const int tilesX = TileCount(size.Width);
  const std::size_t tiles = NumberOfTiles(size);
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

void LazySplats::Prefetch(const Wanted& wanted) const
{
  if (this->State(wanted).load(std::memory_order_relaxed) == NotStarted)
  {
    this->Runs[wanted.Run].Maker->Prefetch(this->Range(wanted));
    return;
  }
  // A run has about 16 splats: a cache line of depths, four of boxes.
  constexpr std::size_t boxesPerLine = 64 / sizeof(PixelBox);
  const SplatList::Part& part = this->At(wanted).Part;
  __builtin_prefetch(&this->List.Orders[part.Begin]);
  // Not the part's count, which another thread may be writing. Ancestors fit into a line.
  const std::size_t count = wanted.Coarser ? 1 : this->Runs[wanted.Run].Chosen.Count;
  for (std::size_t i = 0; i < count; i += boxesPerLine)
  {
    __builtin_prefetch(&this->List.Boxes[part.Begin + i]);
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

const SplatList::Part& LazySplats::Get(const Wanted& wanted)
{
  std::atomic<unsigned char>& state = this->State(wanted);
  Made& made = wanted.Coarser ? this->Coarser[wanted.Run] : this->Runs[wanted.Run].Own;
  unsigned char seen = state.load(std::memory_order_acquire);
  if (seen == NotStarted &&
    state.compare_exchange_strong(seen, InProgress, std::memory_order_acquire))
  {
    try
    {
      this->Make(wanted, made);
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
  return made.Part;
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

void LazySplats::Make(const Wanted& wanted, Made& made)
{
  const auto start = std::chrono::steady_clock::now();
  SplatOutput output = this->List.OutputAt(made.Part.Begin);
  this->Runs[wanted.Run].Maker->Make(this->Range(wanted), output);
  made.Part.Take(output);
  made.Box = this->Union(made.Part);
  made.Seconds = std::chrono::duration<float>(std::chrono::steady_clock::now() - start).count();
}

LazySplats::Counts LazySplats::Count() const
{
  Counts counts;
  const auto isReady = [this](const Wanted& wanted) {
    return this->State(wanted).load(std::memory_order_relaxed) == Ready;
  };
  const auto add = [&counts](const Made& made) {
    counts.Splats += made.Part.Count;
    counts.Invalid += made.Part.Invalid;
    counts.Blurred += made.Part.Blurred;
    counts.Seconds += made.Seconds;
  };
  for (std::uint32_t r = 0; r < this->Runs.size(); ++r)
  {
    const Run& run = this->Runs[r];
    add(run.Own);
    const bool isSeen = isReady({ r, false }) || (!this->Coarser.empty() && isReady({ r, true }));
    counts.Hidden += isSeen ? 0 : run.Chosen.Count;
  }
  std::for_each(this->Coarser.begin(), this->Coarser.end(), add);
  return counts;
}
}
