// SPDX-License-Identifier: BSD-3-Clause
/**
 * Samples of a cloud: how many, how evenly, and the same ones in any order.
 */

#include "Core/Surfels/RoundSurfels.h"
#include "Core/Surfels/SurfelSamples.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <random>
#include <vector>

using namespace SurfelSplatting;

namespace
{
using Points = std::vector<std::array<float, 3>>;

/// A terrain over a lattice, whose coordinates have few bits.
Points Terrain(int side)
{
  Points points;
  for (int i = 0; i < side * side; ++i)
  {
    const auto x = static_cast<float>(i % side), y = static_cast<float>(i / side);
    points.push_back({ x / 8.0f, y / 8.0f, 0.5f * static_cast<float>(i % 7) });
  }
  return points;
}

std::vector<std::size_t> SamplesOf(const Points& points, std::size_t most)
{
  const std::vector<std::array<float, 3>> normals(points.size(), { 0.0f, 0.0f, 1.0f });
  const RoundSurfels surfels(points.size(), points[0].data(), normals[0].data(), 0.1);
  return ChooseSamples(surfels.Cloud(), most);
}

Points Chosen(const Points& points, std::size_t most)
{
  Points chosen;
  for (const std::size_t i : SamplesOf(points, most))
  {
    chosen.push_back(points[i]);
  }
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}
}

TEST_CASE("The same samples in any order")
{
  Points points = Terrain(300);
  const Points samples = Chosen(points, 4000);
  CHECK(samples.size() == NumberOfSamples(points.size(), 4000));
  CHECK(samples.size() == (90000 + 21) / 22);
  std::shuffle(points.begin(), points.end(), std::mt19937(3));
  CHECK(Chosen(points, 4000) == samples);
}

TEST_CASE("Every part of a cloud has its share")
{
  const Points points = Terrain(300);
  std::vector<int> counts(36); // of squares of 50 by 50 points, of which 2500 / 22.5 are chosen
  for (const std::array<float, 3>& p : Chosen(points, 4000))
  {
    ++counts[static_cast<int>(8 * p[0]) / 50 + 6 * (static_cast<int>(8 * p[1]) / 50)];
  }
  const auto [least, most] = std::minmax_element(counts.begin(), counts.end());
  CHECK(*least > 70); // 4 standard deviations of a random choice
  CHECK(*most < 155);
}

TEST_CASE("Few surfels, and surfels at one place")
{
  const Points few = Terrain(10);
  CHECK(SamplesOf(few, 51).size() == 100);
  CHECK(SamplesOf(few, 100).back() == 99);
  const std::vector<std::size_t> samples = SamplesOf(Points(1000, { 1.0f, 2.0f, 3.0f }), 10);
  REQUIRE(samples.size() == 10);
  CHECK(samples[3] == 300);
}
