// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Picture/DoubtfulTiles.h"

#include "Core/Base/Tiles.h"

#include <algorithm>

namespace SurfelSplatting
{
namespace
{
/// The weight rises from 0 to 1 over so many pixels.
constexpr float Rise = 8.0f;

/// Distance of a pixel's centre from the border to the neighbour at -1, 0 or 1 tiles; 0 to none.
float DistanceTo(int side, int inTile)
{
  const float x = static_cast<float>(inTile) + 0.5f;
  return side < 0 ? x : side > 0 ? static_cast<float>(TileSize) - x : 0.0f;
}

/// Weight of the mean at a pixel of a doubtful tile, [0, 1]: at a border that of the lighter tile.
/// @param tiles weights of the tile and its neighbours, [row][column]
float WeightOfMean(const std::array<std::array<float, 3>, 3>& tiles, int x, int y)
{
  float least = 1.0f;
  for (int j = -1; j <= 1; ++j)
  {
    const float across = DistanceTo(j, y % TileSize);
    for (int i = -1; i <= 1; ++i)
    {
      const float distance = std::max(DistanceTo(i, x % TileSize), across);
      const float risen = std::min(distance / Rise, 1.0f), weight = tiles[j + 1][i + 1];
      least = std::min(least, weight + (1.0f - weight) * risen);
    }
  }
  return least;
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
  std::vector<float> own(doubts.size());
  std::transform(doubts.begin(), doubts.end(), own.begin(), [largest](float doubt) {
    return std::clamp((doubt / largest - 1.0f) / (FullDoubt - 1.0f), 0.0f, 1.0f);
  });
  this->Weights = own;
  this->Flags.resize(doubts.size());
  for (std::size_t tile = 0; tile < own.size(); ++tile)
  {
    const int column = static_cast<int>(tile) % this->Columns;
    const int row = static_cast<int>(tile) / this->Columns;
    std::array<float, 4> beside{};
    beside[0] = column > 0 ? own[tile - 1] : 0.0f;
    beside[1] = column + 1 < this->Columns ? own[tile + 1] : 0.0f;
    beside[2] = row > 0 ? own[tile - this->Columns] : 0.0f;
    beside[3] = row + 1 < this->Rows ? own[tile + this->Columns] : 0.0f;
    std::sort(beside.begin(), beside.end());
    this->Weights[tile] = std::max(own[tile], beside[1]);
    this->Flags[tile] = this->Weights[tile] > 0.0f ? 1 : 0;
  }
}

bool DoubtfulTiles::IsEmpty() const
{
  return !this->Flags.empty() &&
    std::none_of(
      this->Flags.begin(), this->Flags.end(), [](unsigned char flag) { return flag != 0; });
}

/// Tiles beyond the picture are as those in it.
float DoubtfulTiles::WeightAt(int column, int row) const
{
  const int x = std::min(std::max(column, 0), this->Columns - 1);
  const int y = std::min(std::max(row, 0), this->Rows - 1);
  return this->Weights[PixelIndex(x, y, this->Columns)];
}

DoubtfulTiles::Neighbors DoubtfulTiles::NeighborsOf(std::size_t tile) const
{
  const int column = static_cast<int>(tile) % this->Columns;
  const int row = static_cast<int>(tile) / this->Columns;
  Neighbors weights;
  for (int j = 0; j < 3; ++j)
  {
    for (int i = 0; i < 3; ++i)
    {
      weights[j][i] = this->WeightAt(column + i - 1, row + j - 1);
    }
  }
  return weights;
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
      const Neighbors tiles = this->NeighborsOf(tile);
      float lightest = 1.0f;
      for (const auto& row : tiles)
      {
        lightest = std::min({ lightest, row[0], row[1], row[2] });
      }
      ForPixels(tile, { picture.Width, picture.Height }, [&](int x, int y, std::size_t p) {
        MixPixel(mean, picture, p, lightest < 1.0f ? WeightOfMean(tiles, x, y) : 1.0f);
      });
    }
  });
}
}
