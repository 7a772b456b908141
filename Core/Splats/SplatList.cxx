// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Splats/SplatList.h"

#include "Core/Splats/SplatMaker.h"

#include <algorithm>

namespace SurfelSplatting
{
namespace
{
constexpr std::size_t ChunkSize = 4096;

void MakeChunks(const CutRanges& runs, std::vector<SplatList::Chunk>& chunks)
{
  chunks.clear();
  for (const CutRange* run = runs.Begin; run != runs.End; ++run)
  {
    for (std::size_t skip = 0; skip < run->Count;)
    {
      if (chunks.empty() || chunks.back().Size == ChunkSize)
      {
        chunks.push_back({ run, skip });
      }
      const std::size_t take =
        std::min<std::size_t>(ChunkSize - chunks.back().Size, run->Count - skip);
      chunks.back().Size += take;
      skip += take;
    }
  }
}

/// What is fetched of a run before it is its turn: all of a node's that the cut has chosen. Of
/// longer ones the processor fetches the rest by itself.
CutRange BeginningOf(const CutRange& run)
{
  constexpr std::uint32_t most = 64;
  CutRange beginning = run;
  beginning.Count = std::min(run.Count, most);
  return beginning;
}

/// Fills the chunk's part of the list; the result does not depend on the thread.
void Fill(
  const SplatMaker& maker, const SplatList::Chunk& chunk, SplatList& list, SplatList::Part& part)
{
  SplatOutput output = list.OutputAt(part.Begin);
  std::size_t skip = chunk.Skip, left = chunk.Size;
  for (const CutRange* run = chunk.Run; left > 0; ++run)
  {
    const std::size_t take = std::min<std::size_t>(left, run->Count - skip);
    left -= take;
    if (left > 0)
    {
      maker.Prefetch(BeginningOf(run[1]));
    }
    maker.Make(*run, skip, take, output);
    skip = 0;
  }
  part.Take(output);
}
}

void SplatList::Clear(bool footprints)
{
  this->HasFootprints = footprints;
  this->Footprints.Clear();
  this->Parts.clear();
  this->Splats.Clear();
  this->Boxes.Clear();
  this->Orders.Clear();
  this->Gradients.Clear();
  this->Levels.Clear();
  this->ResizeTents(0);
}

void SplatList::Resize(std::size_t size)
{
  this->Splats.Resize(size);
  this->Boxes.Resize(size);
  this->Orders.Resize(size);
  this->Gradients.Resize(size);
  this->Footprints.Resize(this->HasFootprints ? size : 0);
  this->Levels.Resize(size);
}

void SplatList::ResizeTents(std::size_t size)
{
  this->Tents.Resize(size);
  this->TentBoxes.Resize(size);
  this->TentNears.Resize(size);
}

SplatOutput SplatList::OutputAt(std::size_t begin)
{
  SplatOutput output;
  output.Splats = &this->Splats[begin];
  output.Boxes = &this->Boxes[begin];
  output.Orders = &this->Orders[begin];
  output.Footprints = this->HasFootprints ? &this->Footprints[begin] : nullptr;
  output.GridLevels = &this->Levels[begin];
  output.Gradients = this->Gradients.Data();
  output.FirstGradient = begin;
  return output;
}

void SplatList::Part::Take(const SplatOutput& output)
{
  this->Count = output.Count;
  this->Invalid = output.Invalid;
  this->Blurred = output.Blurred;
  this->LargestCoarseColor = output.LargestCoarseColor;
  this->LargestDelay = output.LargestDelay;
  this->Levels = output.Levels;
}

void SplatList::Add(const Splat& splat, const PixelBox& box)
{
  const std::size_t i = this->Splats.Size();
  this->Resize(i + 1);
  this->Levels[i] = 0;
  this->Splats[i] = splat;
  this->Boxes[i] = box;
  this->Orders[i] = splat.Near;
  this->Parts.push_back({ i, 1, 0, 0, 0.0f, 1 });
}

SplatList::Part SplatList::Sum() const
{
  Part sum{ 0 };
  for (const Part& part : this->Parts)
  {
    sum.Count += part.Count;
    sum.Invalid += part.Invalid;
    sum.Blurred += part.Blurred;
    sum.LargestCoarseColor = std::max(sum.LargestCoarseColor, part.LargestCoarseColor);
    sum.LargestDelay = std::max(sum.LargestDelay, part.LargestDelay);
    sum.Levels |= part.Levels;
  }
  return sum;
}

void AllSurfels(const SurfelCloud& cloud, std::vector<CutRange>& runs)
{
  constexpr std::size_t largest = std::size_t{ 1 } << 31;
  runs.clear();
  for (std::size_t begin = 0; begin < cloud.NumberOfSurfels; begin += largest)
  {
    runs.push_back(
      { begin, static_cast<std::uint32_t>(std::min(largest, cloud.NumberOfSurfels - begin)), 0 });
  }
}

void AppendSplats(
  const SplatMaker& maker, const CutRanges& runs, const Executor& executor, SplatList& list)
{
  for (const CutRange* run = runs.Begin; run != runs.End; ++run)
  {
    maker.Announce(*run);
  }
  MakeChunks(runs, list.Chunks);
  const std::size_t count = list.Chunks.size();
  const std::size_t first = list.Splats.Size(), firstPart = list.Parts.size();
  list.Resize(first + count * ChunkSize);
  for (std::size_t i = 0; i < count; ++i)
  {
    list.Parts.push_back({ first + i * ChunkSize });
  }
  executor.For(count, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
    {
      Fill(maker, list.Chunks[i], list, list.Parts[firstPart + i]);
    }
  });
}
}
