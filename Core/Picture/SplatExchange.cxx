// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Picture/SplatExchange.h"

#include "Core/Base/Tiles.h"

#include <algorithm>
#include <cstdint>
#include <utility>

namespace SurfelSplatting
{
namespace
{
/// The beginning of a message; splats, boxes, levels, gradients and footprints follow.
struct Header
{
  std::uint64_t Splats, Gradients;
  float LargestCoarseColor, LargestDelay; ///< over all of the sender's splats, sent or not
  unsigned int Levels;
  unsigned char HasFootprints;
};

/// Number of pixels that costs a tile as much as binning and sorting one splat.
constexpr std::uint64_t PixelsPerPair = 64;

/// Rows of the picture that a splat reaches, from its box. Splats on coarse grids become tents,
/// which reach one cell beyond their own (CoarseGrid.h).
RowRange RowsOf(const PixelBox& box, int level, int height)
{
  if (level == 0)
  {
    return { box.Y0, box.Y1 };
  }
  const int cell = 1 << level;
  return { std::max(0, (box.Y0 - 1) * cell), std::min(height, box.Y1 * cell) };
}

/// Estimated work of each row of tiles for the splats of a list.
std::vector<std::uint64_t> CostOfTiles(int width, int height, const SplatList& list)
{
  const auto count = static_cast<std::size_t>(TileCount(height));
  std::vector<std::uint64_t> costs(
    count, PixelsPerPair * static_cast<std::uint64_t>(TileCount(width)));
  for (const SplatList::Part& part : list.Parts)
  {
    for (std::size_t i = part.Begin; i < part.Begin + part.Count; ++i)
    {
      const PixelBox& box = list.Boxes[i];
      const RowRange rows = RowsOf(box, list.Levels[i], height);
      if (IsEmpty(box) || rows.Begin >= rows.End)
      {
        continue;
      }
      const int first = rows.Begin / TileSize, last = (rows.End - 1) / TileSize;
      const auto area =
        static_cast<std::uint64_t>(box.X1 - box.X0) * static_cast<std::uint64_t>(box.Y1 - box.Y0);
      const std::uint64_t cost = area / static_cast<std::uint64_t>(last - first + 1);
      for (int tile = first; tile <= last; ++tile)
      {
        costs[static_cast<std::size_t>(tile)] += cost + PixelsPerPair;
      }
    }
  }
  return costs;
}

/// Half-open range of ranks.
struct RankRange
{
  std::size_t Begin, End;
};

/// Ranks whose bands overlap the rows.
RankRange RanksOf(const RowRange& rows, const std::vector<RowRange>& bands)
{
  RankRange ranks{ 0, bands.size() };
  while (ranks.Begin < ranks.End && bands[ranks.Begin].End <= rows.Begin)
  {
    ++ranks.Begin;
  }
  while (ranks.End > ranks.Begin && bands[ranks.End - 1].Begin >= rows.End)
  {
    --ranks.End;
  }
  return ranks;
}

/// Calls visit(i, ranks) for the splats of a part.
template <typename Visit>
void ForSplats(const SplatList& list, const SplatList::Part& part,
  const std::vector<RowRange>& bands, Visit&& visit)
{
  const int height = bands.back().End;
  for (std::size_t i = part.Begin; i < part.Begin + part.Count; ++i)
  {
    visit(i, RanksOf(RowsOf(list.Boxes[i], list.Levels[i], height), bands));
  }
}

/// Where the arrays of a message begin.
struct Layout
{
  explicit Layout(const Header& header)
    : Boxes(sizeof(Header) + header.Splats * sizeof(Splat))
    , Orders(this->Boxes + header.Splats * sizeof(PixelBox))
    , Levels(this->Orders + header.Splats * sizeof(float))
    , Gradients(this->Levels + header.Splats)
    , Footprints(this->Gradients + header.Gradients * sizeof(SplatGradient))
    , End(this->Footprints + (header.HasFootprints ? header.Splats * sizeof(LensFootprint) : 0))
  {
  }
  std::size_t Boxes, Orders, Levels, Gradients, Footprints, End;
};

template <typename T>
void Write(const T& value, std::size_t base, std::uint64_t i, Message& message)
{
  std::memcpy(message.data() + base + i * sizeof(T), &value, sizeof(T));
}

template <typename T>
void Read(const Message& message, std::size_t base, std::uint64_t begin, std::uint64_t end, T* to)
{
  if (begin < end)
  {
    std::memcpy(
      static_cast<void*>(to), message.data() + base + begin * sizeof(T), (end - begin) * sizeof(T));
  }
}

/// Writes a splat at a position of a message and moves the position on.
void WriteSplat(const SplatList& list, std::size_t i, const Layout& layout,
  SplatExchange::Counts& at, Message& message)
{
  Splat splat = list.Splats[i];
  if (HasGradient(splat))
  {
    Write(list.GradientOf(splat), layout.Gradients, at.Gradients, message);
    splat.Gradient = static_cast<std::int32_t>(at.Gradients++);
  }
  Write(splat, sizeof(Header), at.Splats, message);
  Write(list.Boxes[i], layout.Boxes, at.Splats, message);
  Write(list.Orders[i], layout.Orders, at.Splats, message);
  Write(list.Levels[i], layout.Levels, at.Splats, message);
  if (list.HasFootprints)
  {
    Write(list.Footprints[i], layout.Footprints, at.Splats, message);
  }
  ++at.Splats;
}

Header HeaderOf(const Message& message)
{
  return MessageReader(message).Get<Header>();
}
}

void SplatExchange::ChooseBands(int width, int height, const SplatList& list)
{
  std::vector<std::uint64_t> costs;
  const auto pack = [&] {
    costs = CostOfTiles(width, height, list);
    Message message;
    Put(costs.data(), costs.size(), message);
    std::fill(costs.begin(), costs.end(), 0);
    this->Bands.reserve(static_cast<std::size_t>(this->Group.Size()));
    return message;
  };
  std::uint64_t total = 0;
  for (const Message& other : this->Group.Share(pack))
  {
    MessageReader reader(other);
    for (std::uint64_t& cost : costs)
    {
      const auto more = reader.Get<std::uint64_t>();
      cost += more;
      total += more;
    }
  }
  const auto ranks = static_cast<std::uint64_t>(this->Group.Size());
  std::uint64_t sum = 0;
  std::size_t tile = 0;
  for (std::uint64_t rank = 0; rank < ranks; ++rank)
  {
    const int begin = rank == 0 ? 0 : this->Bands.back().End;
    // This rank's share ends in the row of tiles whose middle reaches it.
    while (tile < costs.size() &&
      (rank + 1 == ranks || (sum + costs[tile] / 2) * ranks < total * (rank + 1)))
    {
      sum += costs[tile++];
    }
    this->Bands.push_back({ begin, std::min(height, static_cast<int>(tile) * TileSize) });
  }
}

/// Counts the splats and gradients that each part sends to each rank: [part][rank].
std::vector<SplatExchange::Counts> SplatExchange::CountSplats(
  const Executor& executor, const SplatList& list) const
{
  const std::size_t ranks = this->Bands.size(), parts = list.Parts.size();
  std::vector<Counts> counts(parts * ranks);
  executor.For(parts, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t part = begin; part < end; ++part)
    {
      ForSplats(list, list.Parts[part], this->Bands, [&](std::size_t i, const RankRange& to) {
        for (std::size_t rank = to.Begin; rank < to.End; ++rank)
        {
          Counts& count = counts[part * ranks + rank];
          ++count.Splats;
          count.Gradients += HasGradient(list.Splats[i]) ? 1 : 0;
        }
      });
    }
  });
  return counts;
}

std::vector<Message> SplatExchange::Pack(const Executor& executor, const SplatList& list) const
{
  const std::size_t ranks = this->Bands.size(), parts = list.Parts.size();
  std::vector<Counts> counts = this->CountSplats(executor, list); // later: where each part's begin
  std::vector<Message> messages(ranks);
  std::vector<Header> headers(ranks);
  const SplatList::Part all = list.Sum();
  for (std::size_t rank = 0; rank < ranks; ++rank)
  {
    Counts sum;
    for (std::size_t part = 0; part < parts; ++part)
    {
      const Counts count = counts[part * ranks + rank];
      counts[part * ranks + rank] = sum;
      sum.Splats += count.Splats;
      sum.Gradients += count.Gradients;
    }
    headers[rank] = { sum.Splats, sum.Gradients, all.LargestCoarseColor, all.LargestDelay,
      all.Levels, static_cast<unsigned char>(list.HasFootprints ? 1 : 0) };
    messages[rank].resize(Layout(headers[rank]).End);
    Write(headers[rank], 0, 0, messages[rank]);
  }
  executor.For(parts, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t part = begin; part < end; ++part)
    {
      ForSplats(list, list.Parts[part], this->Bands, [&](std::size_t i, const RankRange& to) {
        for (std::size_t rank = to.Begin; rank < to.End; ++rank)
        {
          WriteSplat(list, i, Layout(headers[rank]), counts[part * ranks + rank], messages[rank]);
        }
      });
    }
  });
  return messages;
}

void SplatExchange::Unpack(
  const std::vector<Message>& messages, const Executor& executor, SplatList& list)
{
  const bool footprints = list.HasFootprints;
  list.Clear(footprints);
  std::size_t size = 0;
  for (const Message& message : messages)
  {
    const Header header = HeaderOf(message);
    SplatList::Part part{ size, static_cast<std::size_t>(header.Splats) };
    part.LargestCoarseColor = header.LargestCoarseColor;
    part.LargestDelay = header.LargestDelay;
    part.Levels = header.Levels;
    list.Parts.push_back(part);
    size += part.Count;
  }
  list.Resize(size);
  const RowRange rows = this->Rows();
  for (std::size_t sender = 0; sender < messages.size(); ++sender)
  {
    const Message& message = messages[sender];
    const Header header = HeaderOf(message);
    const Layout layout(header);
    const std::size_t first = list.Parts[sender].Begin;
    // Gradients begin at the same index as the splats: there are at most as many.
    Read(message, layout.Gradients, 0, header.Gradients, list.Gradients.Data() + first);
    executor.For(header.Splats, 1 << 14, [&](std::size_t begin, std::size_t end) {
      Read(message, sizeof(Header), begin, end, list.Splats.Data() + first + begin);
      Read(message, layout.Boxes, begin, end, list.Boxes.Data() + first + begin);
      Read(message, layout.Orders, begin, end, list.Orders.Data() + first + begin);
      Read(message, layout.Levels, begin, end, list.Levels.Data() + first + begin);
      if (footprints)
      {
        Read(message, layout.Footprints, begin, end, list.Footprints.Data() + first + begin);
      }
      for (std::size_t i = first + begin; i < first + end; ++i)
      {
        Splat& splat = list.Splats[i];
        splat.Gradient += HasGradient(splat) ? static_cast<std::int32_t>(first) : 0;
        if (list.Levels[i] == 0)
        {
          PixelBox& box = list.Boxes[i]; // other ranks draw the other rows
          box.Y0 = std::max(box.Y0, rows.Begin);
          box.Y1 = std::min(box.Y1, rows.End);
        }
      }
    });
  }
}

void SplatExchange::Exchange(int width, int height, const Executor& executor, SplatList& list)
{
  if (this->Bands.empty())
  {
    this->ChooseBands(width, height, list);
  }
  std::vector<Message> messages;
  this->Group.DoOwn([&] { messages = this->Pack(executor, list); });
  messages = this->Group.Exchange(std::move(messages));
  this->Group.DoOwn([&] { this->Unpack(messages, executor, list); });
}

void SplatExchange::ShareLargest(std::vector<float>& values) const
{
  const auto pack = [&] {
    Message own;
    Put(values.data(), values.size(), own);
    return own;
  };
  for (const Message& message : this->Group.Share(pack))
  {
    MessageReader reader(message);
    for (float& value : values)
    {
      value = std::max(value, reader.Get<float>());
    }
  }
}

void SplatExchange::Collect(const Frame& frame)
{
  const auto width = static_cast<std::size_t>(frame.Width);
  const RowRange own = this->Rows();
  const auto pack = [&] {
    Message message;
    if (!this->Group.IsRoot() && own.Begin < own.End)
    {
      const std::size_t first = width * static_cast<std::size_t>(own.Begin);
      const std::size_t count = width * static_cast<std::size_t>(own.End - own.Begin);
      Put(frame.Color + 4 * first, 4 * count, message);
      Put(frame.Depth + first, count, message);
    }
    return message;
  };
  const std::vector<Message> messages = this->Group.ToRoot(pack);
  for (std::size_t rank = 1; rank < messages.size(); ++rank)
  {
    const RowRange& rows = this->Bands[rank];
    const std::size_t first = width * static_cast<std::size_t>(rows.Begin);
    const std::size_t count = width * static_cast<std::size_t>(rows.End - rows.Begin);
    MessageReader reader(messages[rank]);
    reader.Get(frame.Color + 4 * first, 4 * count);
    reader.Get(frame.Depth + first, count);
  }
}
}
