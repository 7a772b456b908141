// SPDX-License-Identifier: BSD-3-Clause
// Cuts along many directions at once against one after the other.
#include "Filters/Orientation/HeightCuts.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <random>
#include <vector>

using namespace SurfelGeometry;

namespace
{
Split CutSimply(const PlatePoints& points, const Vector3& direction)
{
  std::vector<double> heights;
  for (int k = 0; k < points.Count; ++k)
  {
    heights.push_back(Dot(points.At[k], direction));
  }
  std::sort(heights.begin(), heights.end());
  const auto variance = [&heights](int first, int last) { // times their number
    double sum = 0.0, squares = 0.0;
    for (int k = first; k < last; ++k)
    {
      sum += heights[k];
      squares += heights[k] * heights[k];
    }
    return squares - sum * sum / (last - first);
  };
  const auto mean = [&heights](int first, int last) {
    double sum = 0.0;
    std::for_each(heights.data() + first, heights.data() + last, [&](double h) { sum += h; });
    return sum / (last - first);
  };
  Split best;
  for (int k = MinOnSheet; k <= points.Count - MinOnSheet; ++k)
  {
    const double within = (variance(0, k) + variance(k, points.Count)) / points.Count;
    if (within < best.Within)
    {
      best = { within, mean(k, points.Count) - mean(0, k), 0.5 * (heights[k - 1] + heights[k]) };
    }
  }
  return best;
}

Vector3 RandomVector(std::mt19937& random)
{
  std::normal_distribution<double> normal;
  const double x = normal(random), y = normal(random);
  return { x, y, normal(random) };
}
}

TEST_CASE("Any number of points and directions")
{
  std::mt19937 random(1);
  for (int count = 2 * MinOnSheet; count <= KeptNeighbors + 1; ++count)
  {
    PlatePoints points;
    points.Count = count;
    std::generate_n(points.At.begin() + 1, count - 1, [&] { return RandomVector(random); });
    for (int lanes = 1; lanes <= CutLanes; ++lanes)
    {
      std::vector<Vector3> directions(static_cast<std::size_t>(lanes));
      std::generate(directions.begin(), directions.end(), [&] { return RandomVector(random); });
      std::vector<Split> splits(directions.size());
      CutHeights(points, directions.data(), lanes, splits.data());
      for (int l = 0; l < lanes; ++l)
      {
        const Split simple = CutSimply(points, directions[l]);
        CHECK(splits[l].Within == doctest::Approx(simple.Within).epsilon(1e-9));
        CHECK(splits[l].Gap == doctest::Approx(simple.Gap).epsilon(1e-9));
        CHECK(splits[l].Limit == doctest::Approx(simple.Limit).epsilon(1e-9));
      }
    }
  }
}

TEST_CASE("Points on two planes")
{
  PlatePoints points;
  points.Count = 10;
  for (int k = 0; k < points.Count; ++k)
  {
    points.At[k] = { 0.3 * k, 0.1 * k * k, k % 2 == 0 ? 0.0 : 2.0 };
  }
  const Vector3 up{ 0.0, 0.0, 1.0 };
  Split split;
  CutHeights(points, &up, 1, &split);
  CHECK(split.Within == 0.0);
  CHECK(split.Gap == 2.0);
  CHECK(split.Limit == 1.0);
}
