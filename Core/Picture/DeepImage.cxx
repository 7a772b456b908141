// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Picture/DeepImage.h"

#include "Core/Base/Tiles.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace SurfelSplatting
{
namespace
{
/// Joins the visible parts of a pixel's layers, sorted by depth, over all cells and appends them as
/// tidy samples: each is divided by the mean transmittance before it.
/// @param share of one cell in the picture
void AppendTidy(
  const DeepSample* begin, const DeepSample* end, float share, std::vector<DeepSample>& samples)
{
  double before = 1.0;
  for (const DeepSample* s = begin; s != end && before >= DeepImage::MinTransmittance;)
  {
    DeepSample sum{ 0.0f, 0.0f, 0.0f, 0.0f, s->Depth, s->Depth };
    for (; s != end && s->Depth == sum.Depth; ++s)
    {
      sum.Red += s->Red;
      sum.Green += s->Green;
      sum.Blue += s->Blue;
      sum.Alpha += s->Alpha;
      sum.Back = std::max(sum.Back, s->Back);
    }
    const auto scale = static_cast<float>(share / before);
    const float alpha = std::min(1.0f, scale * sum.Alpha);
    if (alpha > 0.0f)
    {
      samples.push_back(
        { scale * sum.Red, scale * sum.Green, scale * sum.Blue, alpha, sum.Depth, sum.Back });
      before *= 1.0 - static_cast<double>(alpha);
    }
  }
}
}

void DeepImage::Begin(int width, int height, bool hasExtents)
{
  this->HasExtents = hasExtents;
  this->Columns = width;
  this->Rows = height;
  this->Cells = 0;
  this->Last.resize(static_cast<std::size_t>(width) * height);
  this->Tiles.clear();
  this->Tiles.resize(NumberOfTiles({ width, height }));
  this->Ends.clear();
  this->All.clear();
}

void DeepImage::BeginTile(const PixelBox& tile)
{
  for (int y = tile.Y0; y < tile.Y1; ++y)
  {
    const std::size_t row = static_cast<std::size_t>(y) * this->Columns;
    std::fill_n(
      this->Last.begin() + static_cast<std::ptrdiff_t>(row + tile.X0), tile.X1 - tile.X0, 0u);
  }
}

/// Whether a layer becomes a part of the sample in front of it.
bool DeepImage::Joins(const VisibleLayer& layer, const Part& part)
{
  if (layer.Spread > 0.0f || part.Spread > 0.0f)
  {
    // Of a surface the spread is 0.
    const float spread = std::min(layer.Spread, part.Spread);
    const bool isFaint = layer.Alpha + part.Visible.Alpha <= MostAlpha;
    const float reach = (isFaint ? ReachOfSample : ReachOfGaussian) * spread;
    return spread > 0.0f && layer.Depth - part.Visible.Depth <= reach;
  }
  return std::min(layer.Alpha, part.Visible.Alpha) < MinAlpha;
}

void DeepImage::Receive(int x, int y, const VisibleLayer& received)
{
  VisibleLayer layer = received;
  layer.Spread = this->HasExtents ? layer.Spread : 0.0f;
  Parts& parts = this->Tiles[TileOf(x, y, this->Columns)];
  std::uint32_t& last = this->Last[PixelIndex(x, y, this->Columns)];
  if (last > 0 && Joins(layer, parts[last - 1]))
  {
    Part& part = parts[last - 1];
    DeepSample& s = part.Visible;
    const float share = layer.Alpha / (s.Alpha + layer.Alpha);
    s.Red += layer.Red;
    s.Green += layer.Green;
    s.Blue += layer.Blue;
    s.Alpha += layer.Alpha;
    if (part.Spread > 0.0f)
    {
      part.Spread = std::min(part.Spread, layer.Spread);
      s.Back = std::max(s.Back, layer.Depth);
      return;
    }
    s.Depth += share * (layer.Depth - s.Depth);
    s.Back = s.Depth;
    return;
  }
  const auto pixel = static_cast<std::uint32_t>(y % TileSize * TileSize + x % TileSize);
  parts.push_back({ pixel, layer.Spread,
    { layer.Red, layer.Green, layer.Blue, layer.Alpha, layer.Depth, layer.Depth } });
  last = static_cast<std::uint32_t>(parts.size());
}

/// Gives the samples of media in a pixel, which are sorted by the depths of their first Gaussians,
/// the extents of what these stand for: a cell that is homogeneous has the length of two
/// deviations. Where they overlap, they end midway; surfaces stay where they are.
void DeepImage::ExtendMedia(Part* begin, Part* end)
{
  for (Part* b = begin; b != end; ++b)
  {
    const float first = b->Visible.Depth;
    b->Visible.Depth -= b->Spread;
    b->Visible.Back += b->Spread;
    if (b == begin)
    {
      continue;
    }
    DeepSample &front = b[-1].Visible, &back = b->Visible;
    if (front.Back < back.Depth || (b[-1].Spread <= 0.0f && b->Spread <= 0.0f))
    {
      continue;
    }
    if (b->Spread <= 0.0f)
    {
      front.Back = std::max(front.Depth, back.Depth);
      continue;
    }
    const float border = b[-1].Spread > 0.0f
      ? 0.5f * (front.Back - b[-1].Spread + back.Depth + b->Spread)
      : front.Depth;
    front.Back = std::min(std::max(front.Depth, border), first);
    // Behind it, since samples of one depth would become one, but not behind its first Gaussian.
    back.Depth =
      std::min(first, std::nextafter(front.Back, std::numeric_limits<float>::infinity()));
    back.Back = std::max(back.Back, back.Depth);
  }
}

/// Makes the samples of a tile, row by row of its pixels, and writes the number of each pixel's
/// into Ends.
void DeepImage::FinishTile(std::size_t tile, std::vector<DeepSample>& samples)
{
  Parts& parts = this->Tiles[tile];
  std::sort(parts.begin(), parts.end(), [](const Part& a, const Part& b) {
    return a.Pixel != b.Pixel ? a.Pixel < b.Pixel : a.Visible.Depth < b.Visible.Depth;
  });
  const PixelBox box = BoxOfTile(tile, { this->Columns, this->Rows });
  std::vector<DeepSample> pixel;
  for (std::size_t begin = 0, end = 0; begin < parts.size(); begin = end)
  {
    pixel.clear();
    end = begin;
    while (end < parts.size() && parts[end].Pixel == parts[begin].Pixel)
    {
      ++end;
    }
    ExtendMedia(parts.data() + begin, parts.data() + end);
    for (std::size_t i = begin; i < end; ++i)
    {
      pixel.push_back(parts[i].Visible);
    }
    const std::size_t before = samples.size();
    AppendTidy(
      pixel.data(), pixel.data() + pixel.size(), 1.0f / static_cast<float>(this->Cells), samples);
    const int x = box.X0 + static_cast<int>(parts[begin].Pixel) % TileSize;
    const int y = box.Y0 + static_cast<int>(parts[begin].Pixel) / TileSize;
    this->Ends[PixelIndex(x, y, this->Columns) + 1] = samples.size() - before;
  }
  Parts().swap(parts);
}

void DeepImage::Finish(const Executor& executor)
{
  this->Ends.assign(this->Last.size() + 1, 0);
  std::vector<std::vector<DeepSample>> tiles(this->Tiles.size());
  executor.For(tiles.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t tile = begin; tile < end; ++tile)
    {
      this->FinishTile(tile, tiles[tile]);
    }
  });
  for (std::size_t p = 1; p < this->Ends.size(); ++p)
  {
    this->Ends[p] += this->Ends[p - 1];
  }
  this->All.resize(this->Ends.back());
  executor.For(tiles.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t tile = begin; tile < end; ++tile)
    {
      const PixelBox box = BoxOfTile(tile, { this->Columns, this->Rows });
      const DeepSample* from = tiles[tile].data();
      for (int y = box.Y0; y < box.Y1; ++y)
      {
        const std::size_t row = static_cast<std::size_t>(y) * this->Columns;
        const std::uint64_t first = this->Ends[row + box.X0];
        const std::uint64_t last = this->Ends[row + box.X1];
        std::copy_n(from, last - first, this->All.begin() + static_cast<std::ptrdiff_t>(first));
        from += last - first;
      }
    }
  });
}
}
