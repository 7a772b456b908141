// SPDX-License-Identifier: BSD-3-Clause
/**
 * Keys of depth and index in exact order, however the depths are spread.
 */
#include "TestScene.h"

#include "Core/Raster/TileBinning.h"
#include "Testing/Shared/Check.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <vector>

using namespace SurfelSplatting;

namespace
{
void TestSorter(std::size_t size, const char* what, const std::function<float(std::size_t)>& depth)
{
  std::vector<std::uint64_t> keys(size);
  for (std::size_t i = 0; i < size; ++i)
  {
    keys[i] = KeyOf(depth(i), static_cast<std::uint32_t>(i * 7919 % size));
  }
  std::vector<std::uint64_t> expected = keys;
  std::sort(expected.begin(), expected.end());
  KeySorter sorter;
  sorter.Sort(keys.data(), keys.size());
  if (keys != expected)
  {
    std::printf("%zu keys, %s:\n", size, what);
  }
  CHECK(keys == expected);
}

TEST_CASE("Order of tiles")
{
  for (const PictureSize tiles : { PictureSize{ 1, 1 }, { 2, 2 }, { 5, 1 }, { 3, 4 }, { 7, 5 } })
  {
    const TileOrder order(tiles.Width, tiles.Height);
    const std::size_t count = static_cast<std::size_t>(tiles.Width) * tiles.Height;
    CHECK(order.Size() % TileOrder::PieceSize == 0);
    std::vector<int> taken(count + 1);
    for (std::size_t place = 0; place < order.Size(); ++place)
    {
      CHECK(order[place] <= count);
      ++taken[std::min(order[place], count)];
    }
    taken.pop_back(); // places without a tile
    CHECK(std::all_of(taken.begin(), taken.end(), [](int times) { return times == 1; }));
  }
}

TEST_CASE("Order of floats")
{
  const float infinity = std::numeric_limits<float>::infinity();
  const float ascending[] = { -infinity, -1e30f, -1.0f, -1e-40f, 0.0f, 1e-40f, 1.0f,
    std::nextafter(1.0f, 2.0f), 1e30f, infinity };
  for (std::size_t i = 1; i < std::size(ascending); ++i)
  {
    CHECK(SortableBits(ascending[i - 1]) < SortableBits(ascending[i]));
  }
}
}

TEST_CASE("Order of keys")
{
  Random random(1);
  for (const std::size_t size : { 0, 1, 2, 31, 32, 33, 500, 20000 })
  {
    TestSorter(size, "uniform", [&](std::size_t) { return random.Uniform(1.0, 3.0); });
    TestSorter(size, "all alike", [](std::size_t) { return 2.0f; });
    TestSorter(size, "two surfaces", [&](std::size_t i) {
      return (i % 2 == 0 ? 1.0 : 1e6) * (1.0 + 1e-6 * random.Uniform(0.0, 1.0));
    });
    TestSorter(size, "one far away",
      [&](std::size_t i) { return i == 0 ? 1e30f : 1.0f + 1e-6f * static_cast<float>(i % 97); });
    TestSorter(size, "both signs, all magnitudes", [&](std::size_t i) {
      return (i % 3 == 0 ? -1.0 : 1.0) * std::pow(10.0, random.Uniform(-37.0, 37.0));
    });
    TestSorter(size, "descending", [](std::size_t i) { return -static_cast<float>(i); });
  }
}
