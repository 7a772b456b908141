// SPDX-License-Identifier: BSD-3-Clause
#include "SplatList.h"

#include <algorithm>

namespace SurfelSplatting
{
namespace
{
constexpr std::size_t ChunkSize = 4096;

/// Up to ChunkSize surfels: from a place in one run on, over the next ones.
struct Chunk
{
  std::size_t Run, Skip;
  std::size_t Size = 0;
};

std::vector<Chunk> MakeChunks(const std::vector<NodeRun>& runs)
{
  std::vector<Chunk> chunks;
  for (std::size_t r = 0; r < runs.size(); ++r)
  {
    for (std::size_t skip = 0; skip < runs[r].Count;)
    {
      if (chunks.empty() || chunks.back().Size == ChunkSize)
      {
        chunks.push_back({ r, skip });
      }
      const std::size_t take =
        std::min<std::size_t>(ChunkSize - chunks.back().Size, runs[r].Count - skip);
      chunks.back().Size += take;
      skip += take;
    }
  }
  return chunks;
}

/// Every chunk of surfels fills a part of the list, whatever thread it runs on.
class Setup
{
public:
  Setup(const SplatContext& context, const SurfelCloud& cloud, const std::vector<NodeRun>& runs,
    SplatList& list)
    : Context(context)
    , Gaussian(context.Settings.Cutoff)
    , Cloud(context.Camera, cloud)
    , Runs(runs)
    , List(list)
  {
  }

  void Fill(const Chunk& chunk, SplatList::Part& part) const
  {
    std::size_t gradients = part.Begin;
    std::size_t skip = chunk.Skip, left = chunk.Size;
    for (std::size_t r = chunk.Run; left > 0; ++r)
    {
      const NodeRun& run = this->Runs[r];
      const std::size_t take = std::min<std::size_t>(left, run.Count - skip);
      for (std::size_t i = 0; i < take; ++i)
      {
        this->Add(run.Begin + skip + i, static_cast<int>(run.Level), part, gradients);
      }
      left -= take;
      skip = 0;
    }
  }

private:
  void Add(std::size_t surfel, int level, SplatList::Part& part, std::size_t& gradients) const
  {
    SplatRecord record;
    const SplatStatus status =
      MakeSplat(this->Context, this->Gaussian, this->Cloud, surfel, level, record);
    part.Invalid += status == SplatStatus::Invalid ? 1 : 0;
    if (status != SplatStatus::Visible)
    {
      return;
    }
    if (record.S.Gradient != NoGradient)
    {
      record.S.Gradient = static_cast<std::int32_t>(gradients);
      this->List.Gradients[gradients++] = record.Gradient;
    }
    this->List.Splats[part.Begin + part.Count] = record.S;
    this->List.Boxes[part.Begin + part.Count] = record.Box;
    if (this->List.HasSlopes)
    {
      this->List.Slopes[part.Begin + part.Count] = record.Slope;
    }
    this->List.Levels[part.Begin + part.Count] = static_cast<unsigned char>(record.GridLevel);
    part.Levels |= 1u << record.GridLevel;
    ++part.Count;
    part.Blurred += record.Blurred ? 1 : 0;
    if (record.GridLevel > 0)
    {
      part.LargestCoarseColor =
        std::max({ part.LargestCoarseColor, record.S.Red, record.S.Green, record.S.Blue });
    }
  }

  const SplatContext& Context;
  TruncatedGaussian Gaussian;
  PlacedCloud Cloud;
  const std::vector<NodeRun>& Runs;
  SplatList& List;
};
}

void SplatList::Clear(bool sectors)
{
  this->HasSlopes = sectors;
  this->Slopes.Clear();
  this->Parts.clear();
  this->Splats.Clear();
  this->Boxes.Clear();
  this->Gradients.Clear();
  this->Levels.Clear();
}

void SplatList::Resize(std::size_t size)
{
  this->Splats.Resize(size);
  this->Boxes.Resize(size);
  this->Gradients.Resize(size);
  this->Slopes.Resize(this->HasSlopes ? size : 0);
  this->Levels.Resize(size);
}

void SplatList::Add(const Splat& splat, const PixelBox& box)
{
  const std::size_t i = this->Splats.Size();
  this->Resize(i + 1);
  this->Levels[i] = 0;
  this->Splats[i] = splat;
  this->Boxes[i] = box;
  this->Parts.push_back({ i, 1, 0, 0, 0.0f, 1 });
}

std::uint64_t SplatList::NumberOfSplats() const
{
  std::uint64_t count = 0;
  for (const Part& part : this->Parts)
  {
    count += part.Count;
  }
  return count;
}

std::uint64_t SplatList::NumberOfBlurredSplats() const
{
  std::uint64_t count = 0;
  for (const Part& part : this->Parts)
  {
    count += part.Blurred;
  }
  return count;
}

float SplatList::LargestCoarseColor() const
{
  float largest = 0.0f;
  for (const Part& part : this->Parts)
  {
    largest = std::max(largest, part.LargestCoarseColor);
  }
  return largest;
}

unsigned int SplatList::LevelsInUse() const
{
  unsigned int levels = 0;
  for (const Part& part : this->Parts)
  {
    levels |= part.Levels;
  }
  return levels;
}

std::uint64_t SplatList::NumberOfInvalidSurfels() const
{
  std::uint64_t count = 0;
  for (const Part& part : this->Parts)
  {
    count += part.Invalid;
  }
  return count;
}

std::vector<NodeRun> AllSurfels(const SurfelCloud& cloud)
{
  constexpr std::size_t largest = std::size_t{ 1 } << 31;
  std::vector<NodeRun> runs;
  for (std::size_t begin = 0; begin < cloud.NumberOfSurfels; begin += largest)
  {
    runs.push_back(
      { begin, static_cast<std::uint32_t>(std::min(largest, cloud.NumberOfSurfels - begin)), 0 });
  }
  return runs;
}

void AppendSplats(const SplatContext& context, const SurfelCloud& cloud,
  const std::vector<NodeRun>& runs, const Executor& executor, SplatList& list)
{
  const std::vector<Chunk> chunks = MakeChunks(runs);
  const std::size_t first = list.Splats.Size(), firstPart = list.Parts.size();
  const std::size_t size = first + chunks.size() * ChunkSize;
  list.Resize(size);
  for (std::size_t i = 0; i < chunks.size(); ++i)
  {
    list.Parts.push_back({ first + i * ChunkSize });
  }
  const Setup setup(context, cloud, runs, list);
  executor.For(chunks.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
    {
      setup.Fill(chunks[i], list.Parts[firstPart + i]);
    }
  });
}
}
