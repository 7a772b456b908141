// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Picture/DoubtfulTiles.h"

#include "Core/Base/Tiles.h"

#include <algorithm>

namespace SurfelSplatting
{
namespace
{
/// The weight rises from 0 to 1 over so many pixels.
constexpr int Rise = 8;

/// Distance of a pixel's centre from the border to the neighbour at -1, 0 or 1 tiles; 0 to none.
float DistanceTo(int side, int inTile)
{
  const float x = static_cast<float>(inTile) + 0.5f;
  return side < 0 ? x : side > 0 ? static_cast<float>(TileSize) - x : 0.0f;
}

/// Weight of the mean at a pixel of a doubtful tile, [0, 1].
/// @param doubtful the tile's neighbours, [row][column]
float WeightOfMean(const std::array<std::array<bool, 3>, 3>& doubtful, int x, int y)
{
  float nearest = Rise;
  for (int j = -1; j <= 1; ++j)
  {
    const float across = DistanceTo(j, y % TileSize);
    for (int i = -1; i <= 1; ++i)
    {
      if (!doubtful[j + 1][i + 1])
      {
        nearest = std::min(nearest, std::max(DistanceTo(i, x % TileSize), across));
      }
    }
  }
  return nearest / Rise;
}

/// @param weight of the mean, > 0
void MixPixel(const Frame& mean, const Frame& picture, std::size_t p, float weight)
{
  for (std::size_t c = 4 * p; c < 4 * p + 4; ++c)
  {
    const float color = picture.Color[c];
    picture.Color[c] = weight < 1.0f ? color + weight * (mean.Color[c] - color) : mean.Color[c];
  }
  picture.Depth[p] = weight > 0.5f ? mean.Depth[p] : picture.Depth[p];
}
}

void DoubtfulTiles::Set(const PictureSize& size, const std::vector<float>& doubts, float largest)
{
  this->Columns = TileCount(size.Width);
  this->Rows = TileCount(size.Height);
  this->Flags.resize(doubts.size());
  std::transform(doubts.begin(), doubts.end(), this->Flags.begin(),
    [largest](float doubt) { return static_cast<unsigned char>(doubt > largest ? 1 : 0); });
  const std::vector<unsigned char> found = this->Flags;
  for (std::size_t tile = 0; tile < found.size(); ++tile)
  {
    const int column = static_cast<int>(tile) % this->Columns;
    const int row = static_cast<int>(tile) / this->Columns;
    int beside = 0;
    for (const int step : { -1, 1 })
    {
      beside += column + step >= 0 && column + step < this->Columns ? found[tile + step] : 0;
      beside += row + step >= 0 && row + step < this->Rows ? found[tile + step * this->Columns] : 0;
    }
    this->Flags[tile] = found[tile] != 0 || beside >= 3 ? 1 : 0;
  }
}

bool DoubtfulTiles::IsEmpty() const
{
  return !this->Flags.empty() &&
    std::none_of(
      this->Flags.begin(), this->Flags.end(), [](unsigned char flag) { return flag != 0; });
}

/// Tiles beyond the picture are as those in it.
bool DoubtfulTiles::IsFlagged(int column, int row) const
{
  const int x = std::min(std::max(column, 0), this->Columns - 1);
  const int y = std::min(std::max(row, 0), this->Rows - 1);
  return this->Flags[static_cast<std::size_t>(y) * this->Columns + x] != 0;
}

DoubtfulTiles::Neighbors DoubtfulTiles::NeighborsOf(std::size_t tile) const
{
  const int column = static_cast<int>(tile) % this->Columns;
  const int row = static_cast<int>(tile) / this->Columns;
  Neighbors flags;
  for (int j = 0; j < 3; ++j)
  {
    for (int i = 0; i < 3; ++i)
    {
      flags[j][i] = this->IsFlagged(column + i - 1, row + j - 1);
    }
  }
  return flags;
}

void DoubtfulTiles::Mix(const Frame& mean, const Frame& picture, const Executor& executor) const
{
  executor.For(this->Flags.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t tile = begin; tile < end; ++tile)
    {
      if (this->Flags[tile] == 0)
      {
        continue;
      }
      const Neighbors doubtful = this->NeighborsOf(tile);
      bool isSurrounded = true;
      for (const auto& row : doubtful)
      {
        isSurrounded = isSurrounded && row[0] && row[1] && row[2];
      }
      ForPixels(tile, { picture.Width, picture.Height }, [&](int x, int y, std::size_t p) {
        MixPixel(mean, picture, p, isSurrounded ? 1.0f : WeightOfMean(doubtful, x, y));
      });
    }
  });
}
}
