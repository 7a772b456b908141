// SPDX-License-Identifier: BSD-3-Clause
// The neighbour search against the distances to all points: in the cloud's order, where a query
// starts from the last one's reach, and in no order; with ties, far from the origin and tiny.
#include "Filters/Neighbors/NeighborSearch.h"
#include "SurfelTesting.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <set>
#include <vector>

using namespace SurfelTesting;
using SurfelGeometry::Neighbors;
using SurfelGeometry::NeighborSearch;

namespace
{
float SquaredDistance(const std::vector<float>& p, int i, int j)
{
  float sum = 0.0f;
  for (int c = 0; c < 3; ++c)
  {
    const float d = p[3 * i + c] - p[3 * j + c];
    sum += d * d;
  }
  return sum;
}

/// Sorted squared distances from point i to all other points within a reach.
std::vector<float> AllDistances(const std::vector<float>& p, int i, float squaredReach)
{
  std::vector<float> all;
  for (int j = 0; j < static_cast<int>(p.size() / 3); ++j)
  {
    const float d = SquaredDistance(p, i, j);
    if (j != i && d < squaredReach)
    {
      all.push_back(d);
    }
  }
  std::sort(all.begin(), all.end());
  return all;
}

void CheckAnswer(
  const std::vector<float>& p, int i, size_t limit, float squaredReach, const Neighbors& found)
{
  std::vector<float> expected = AllDistances(p, i, squaredReach);
  expected.resize(std::min(expected.size(), limit));
  CHECK(found.Ids.size() == expected.size());
  CHECK(found.SquaredDistances.size() == expected.size());
  CHECK(std::set<int>(found.Ids.begin(), found.Ids.end()).size() == found.Ids.size());
  for (size_t k = 0; k < std::min(found.Ids.size(), expected.size()); ++k)
  {
    CHECK(found.Ids[k] != i);
    CHECK(found.SquaredDistances[k] == SquaredDistance(p, i, found.Ids[k]));
    // The tree's distances to its cells are rounded: a tie may go either way.
    CHECK(std::abs(found.SquaredDistances[k] - expected[k]) <= 1e-5f * expected[k]);
    CHECK((k == 0 || found.SquaredDistances[k] > found.SquaredDistances[k - 1] ||
      found.Ids[k] > found.Ids[k - 1]));
  }
}

void TestCloud(const std::vector<float>& p)
{
  const int count = static_cast<int>(p.size() / 3);
  const NeighborSearch tree(p.data(), count);
  CHECK(tree.Size() == count);
  std::mt19937 random(1);
  std::uniform_int_distribution<int> anywhere(0, count - 1);
  Neighbors reused;
  for (int i = 0; i < count; ++i)
  {
    const int wanted = 1 + i % 40; // more than the last time, and fewer
    tree.FindNearest(i, wanted, reused);
    CheckAnswer(p, i, wanted, INFINITY, reused);
    const int j = anywhere(random);
    tree.FindNearest(j, 24, reused);
    CheckAnswer(p, j, 24, INFINITY, reused);
    if (reused.Count() > 8)
    {
      const float reach = reused.SquaredDistances[8];
      tree.FindWithin(j, std::sqrt(reach), 5, reused);
      CHECK(reused.Count() <= 5);
    }
  }
}

std::vector<float> RandomCloud(int count, float scale, float shift)
{
  std::mt19937 random(2);
  std::normal_distribution<float> normal;
  std::vector<float> p(3 * count);
  for (float& x : p)
  {
    x = shift + scale * normal(random);
  }
  return p;
}

std::vector<float> Grid(int side)
{
  std::vector<float> p;
  for (int i = 0; i < side * side; ++i)
  {
    p.insert(p.end(), { float(i % side), float(i / side), 0.0f });
  }
  return p;
}
}

namespace
{
/// Queries of the points in their order, some of which share one search of the tree: their answers
/// are those of queries that know of no other.
void TestOrder(const std::vector<float>& p, int wanted)
{
  const int count = static_cast<int>(p.size() / 3);
  const NeighborSearch tree(p.data(), count);
  Neighbors inOrder;
  for (int i = 0; i < count; ++i)
  {
    Neighbors alone;
    tree.FindNearest(i, wanted, inOrder);
    tree.FindNearest(i, wanted, alone);
    CHECK(inOrder.Ids == alone.Ids);
    CHECK(inOrder.SquaredDistances == alone.SquaredDistances);
  }
}

/// Along a spiral; its spacing changes by 1000 at once, and then many points are at one place.
std::vector<float> Spiral(int count)
{
  std::vector<float> p;
  for (int i = 0; i < count; ++i)
  {
    const float step = i < count / 2 ? 1.0f : 0.001f;
    const float r = step * std::sqrt(float(i)), angle = 2.4f * float(i);
    p.insert(p.end(), { r * std::cos(angle), r * std::sin(angle), 0.1f * float(i % 7) * step });
  }
  p.insert(p.end(), 3 * 40, 0.25f);
  return p;
}
}

TEST_CASE("Points in their order")
{
  for (const int wanted : { 3, 20, 120 })
  {
    TestOrder(Grid(40), wanted); // ties
    TestOrder(Spiral(2000), wanted);
    TestOrder(RandomCloud(2000, 1.0f, 0.0f), wanted);
  }
  TestOrder(RandomCloud(300, 1e-16f, 0.0f), 20);
  TestOrder(RandomCloud(300, 1e16f, 0.0f), 20);
  TestOrder(RandomCloud(300, 1e-30f, 0.0f), 20);
  TestOrder(RandomCloud(12, 1.0f, 0.0f), 20);
}

/// A cloud of several trees, whose boxes overlap, and one with ties.
TEST_CASE("Large clouds")
{
  for (const std::vector<float>& p : { RandomCloud(300000, 1.0f, 0.0f), Grid(550) })
  {
    const int count = static_cast<int>(p.size() / 3);
    const NeighborSearch tree(p.data(), count);
    Neighbors reused;
    for (int i = 0; i < count; i += count / 40)
    {
      tree.FindNearest(i, 20, reused);
      CheckAnswer(p, i, 20, INFINITY, reused);
      pcl::Indices ids;
      std::vector<float> squared;
      tree.nearestKSearch(pcl::PointXYZ(p[3 * i], p[3 * i + 1], p[3 * i + 2]), 21, ids, squared);
      REQUIRE(ids.size() == 21);
      CHECK(squared[0] == 0.0f);
      CHECK(std::equal(squared.begin() + 1, squared.end(), reused.SquaredDistances.begin()));
      tree.FindWithin(i, 1.001 * std::sqrt(squared[15]), 40, reused);
      CHECK(reused.Count() >= 15);
      CheckAnswer(p, i, 40, 1.002001f * squared[15], reused);
    }
  }
}

TEST_CASE("Nearest points as by brute force")
{
  TestCloud(RandomCloud(600, 1.0f, 0.0f));
  TestCloud(RandomCloud(600, 1.0f, 1000.0f));
  TestCloud(RandomCloud(300, 1e-16f, 0.0f));
  TestCloud(RandomCloud(300, 1e16f, 0.0f));
  TestCloud(RandomCloud(300, 1e-30f, 0.0f)); // all squared distances are 0
  TestCloud(Grid(20));
  for (const int few : { 1, 2, 3, 10 })
  {
    TestCloud(RandomCloud(few, 1.0f, 0.0f));
  }
  CHECK(NeighborSearch(nullptr, 0).Size() == 0);
}

namespace
{
/// PCL's answers: ours with the place itself, wherever it is.
void TestQueriesOfPCL(const std::vector<float>& p)
{
  const int count = static_cast<int>(p.size() / 3);
  const NeighborSearch tree(p.data(), count);
  pcl::Indices ids;
  std::vector<float> squared;
  Neighbors own;
  for (int i = 0; i < count; i += 7)
  {
    const pcl::PointXYZ place(p[3 * i], p[3 * i + 1], p[3 * i + 2]);
    CHECK(tree.nearestKSearch(place, 10, ids, squared) == std::min(10, count));
    tree.FindNearest(i, 9, own);
    CHECK(ids.front() == i);
    CHECK(std::equal(own.Ids.begin(), own.Ids.end(), ids.begin() + 1));
    CHECK(
      std::equal(own.SquaredDistances.begin(), own.SquaredDistances.end(), squared.begin() + 1));
    for (const float reach : { 0.1f, 1.0f, 100.0f })
    {
      const size_t within = 1 + AllDistances(p, i, reach * reach).size();
      const int found = tree.radiusSearch(place, reach, ids, squared);
      CHECK(found == static_cast<int>(within));
      CHECK(ids.size() == within);
      CHECK(std::is_sorted(squared.begin(), squared.end()));
      CHECK(tree.radiusSearch(place, reach, ids, squared, 3) == std::min(3, found));
    }
  }
  CHECK(tree.radiusSearch(pcl::PointXYZ(1e4f, 0.0f, 0.0f), 1.0, ids, squared) == 0);
  CHECK(tree.nearestKSearch(pcl::PointXYZ(1e4f, 0.0f, 0.0f), 1, ids, squared) == 1);
}
}

TEST_CASE("PCL's queries")
{
  TestQueriesOfPCL(RandomCloud(600, 1.0f, 0.0f));
  TestQueriesOfPCL(RandomCloud(5, 1.0f, 0.0f));
  const NeighborSearch none(nullptr, 0);
  pcl::Indices ids;
  std::vector<float> squared;
  CHECK(none.nearestKSearch(pcl::PointXYZ(0.0f, 0.0f, 0.0f), 1, ids, squared) == 0);
  CHECK(none.radiusSearch(pcl::PointXYZ(0.0f, 0.0f, 0.0f), 1.0, ids, squared) == 0);
}
