// SPDX-License-Identifier: BSD-3-Clause
/**
 * The hierarchy: every node's values against sums over its leaves, coverage from all sides at every
 * level, degenerate clouds, and the same at any number of threads.
 */
#include "Core/Base/KeySelection.h"
#include "Core/Base/ThreadExecutor.h"
#include "Core/Hierarchy/KdTreeOrder.h"
#include "Core/Hierarchy/NodeCheck.h"
#include "Core/Surfels/NodeMoments.h"
#include "Core/Surfels/NodePacking.h"
#include "TestScene.h"
#include "Testing/Shared/Check.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

using namespace SurfelSplatting;

namespace
{
TEST_CASE("Layout")
{
  CHECK(HierarchyLayout(0, 0).NumberOfNodes() == 0);
  CHECK(HierarchyLayout(0, 0).NumberOfLevels() == 0);
  CHECK(HierarchyLayout(1, 0).NumberOfNodes() == 1);
  CHECK(HierarchyLayout(1, 0).NumberOfLevels() == 1);
  CHECK(HierarchyLayout(0, 3).NumberOfNodes() == 3 + 2 + 1);
  const HierarchyLayout layout(5, 2);
  // Leaves 1 to 4 of the first tree lie below its nodes 0 to 2 of level 1; both of the second one
  // below its only node.
  CHECK(layout.Above(0, { 1, 4 }, 1).Begin == layout.Begin(1, HierarchyLayout::OneSided));
  CHECK(layout.Above(0, { 1, 4 }, 1).Count == 3);
  CHECK(layout.Above(0, { 1, 4 }, 0).Begin == 1);
  CHECK(layout.Above(0, { 5, 2 }, 1).Begin == layout.Begin(1, HierarchyLayout::TwoSided));
  CHECK(layout.Above(0, { 5, 2 }, 2).Count == 1);
  CHECK(layout.Above(1, { layout.Begin(1, HierarchyLayout::OneSided) + 2, 1 }, 1).Begin ==
    layout.Begin(2, HierarchyLayout::OneSided) + 1);
  CHECK(layout.NumberOfLevels() == 4);
  CHECK(layout.NumberOfLeaves() == 7);
  CHECK(layout.Count(1, 0) == 3);
  CHECK(layout.Count(1, 1) == 1);
  CHECK(layout.Begin(1, 1) == 10);
  CHECK(layout.RootLevel(0) == 3);
  CHECK(layout.RootLevel(1) == 1);
  CHECK(layout.Begin(3, 0) == 7 + 4 + 3);
  // All of them: 7 + 4 + 3 + 2 (a tree's only node is repeated up to the other's root).
  CHECK(layout.NumberOfNodes() == 16);
  for (std::uint64_t n : { 63u, 64u, 65u, 1000u, 4097u })
  {
    CHECK(HierarchyLayout(n, 0).NumberOfNodes() < 2 * n + 40);
    CHECK(HierarchyLayout(n, 0).Count(HierarchyLayout(n, 0).RootLevel(0), 0) == 1);
  }
}

/// Against a sort: keys in any order, sorted ones, large ones that fall, and ones of which those at
/// the places of the sample are the smallest, so that it misleads.
TEST_CASE("Selection")
{
  Random random(7);
  for (const std::size_t count : { 1, 2, 33, 4096, 4097, 100000 })
  {
    for (int kind = 0; kind < 4; ++kind)
    {
      std::vector<std::uint64_t> keys(count);
      for (std::size_t i = 0; i < count; ++i)
      {
        const auto any = static_cast<std::uint64_t>(random.Uniform(0.0, 4e9)) << 32;
        keys[i] = kind == 0 ? any | i : kind == 2 ? ~std::uint64_t{ 0 } - i : 1024 + i;
      }
      for (std::size_t k = 0; kind == 3 && k < 1024; ++k)
      {
        keys[k * (count - 1) / 1023] = k;
      }
      std::vector<std::uint64_t> sorted = keys;
      std::sort(sorted.begin(), sorted.end());
      for (const std::size_t rank : { std::size_t{ 0 }, count / 3, count / 2, count - 1 })
      {
        std::vector<std::uint64_t> some = keys;
        CHECK(FindKey(some.data(), count, rank, SerialExecutor()) == sorted[rank]);
      }
    }
  }
}

/// So many that all threads divide the first ranges: surfels on a line are in its order.
TEST_CASE("Many on a line")
{
  constexpr std::size_t count = 700000;
  Random random(8);
  std::vector<float> positions(3 * count, 0.0f), covariances(6 * count, 1e-6f),
    areas(3 * count, 0.0f);
  for (std::size_t i = 0; i < count; ++i)
  {
    positions[3 * i] = static_cast<float>(random.Uniform(-1.0, 1.0));
    areas[3 * i + 2] = 1e-6f;
  }
  SurfelCloud cloud;
  cloud.NumberOfSurfels = count;
  cloud.PositionsFloat = positions.data();
  cloud.Covariances = covariances.data();
  cloud.AreaVectors = areas.data();
  const KdTreeOrder order = MakeKdTreeOrder(cloud, SerialExecutor());
  CHECK(MakeKdTreeOrder(cloud, ThreadExecutor(3)).Surfels == order.Surfels);
  CHECK(order.Surfels.size() == count);
  std::vector<char> seen(count, 0);
  std::size_t falls = 0;
  for (std::size_t i = 0; i < order.Surfels.size(); ++i)
  {
    seen[order.Surfels[i]] = 1;
    falls += i > 0 && positions[3 * order.Surfels[i]] + 1e-6f < positions[3 * order.Surfels[i - 1]]
      ? 1
      : 0; // 1e-6: the leaves are relative to the first one
  }
  CHECK(falls == 0);
  CHECK(std::count(seen.begin(), seen.end(), char{ 1 }) == static_cast<std::ptrdiff_t>(count));
}

/// A bumpy ball, one-sided, and a two-sided sheet whose normals point either way.
TestCloud BallAndSheet(int count, Random& random)
{
  TestCloud cloud;
  for (int i = 0; i < count; ++i)
  {
    TestSurfel s;
    s.Normal = random.Direction();
    const double r = 1.0 + 0.05 * std::sin(9.0 * s.Normal[0]) * std::sin(9.0 * s.Normal[1]);
    for (int c = 0; c < 3; ++c)
    {
      s.Position[c] = r * s.Normal[c];
    }
    s.Area = 12.57 / count * random.Uniform(0.5, 1.5);
    s.SigmaU = 0.5 * std::sqrt(s.Area);
    s.SigmaV = 0.4 * std::sqrt(s.Area);
    s.Color = { { static_cast<float>(random.Uniform(0, 1)),
      static_cast<float>(0.5 + 0.5 * s.Normal[1]), 0.3f, 1.0f } };
    s.Opacity = static_cast<float>(random.Uniform(0.3, 1.0));
    s.Overlap = random.Integer(0, 255);
    cloud.Add(s);
    s.TwoSided = true;
    s.Position = { random.Uniform(-2, 2), random.Uniform(-2, 2), 2.0 };
    s.Normal = { 0.0, 0.0, random.Integer(0, 1) ? 1.0 : -1.0 };
    cloud.Add(s);
  }
  return cloud;
}

struct LeafSums
{
  double Area = 0, Opacity = 0, Overlap = 0, Mass = 0, Seen = 0;
  Vector3 AreaVector{ 0, 0, 0 }, Position{ 0, 0, 0 };
  double Color[3] = { 0, 0, 0 };
};

/// Sums over leaves in double.
LeafSums SumLeaves(const SurfelCloud& tree, std::size_t first, std::size_t last, bool twoSided)
{
  LeafSums sums;
  for (std::size_t i = first; i < last; ++i)
  {
    const Vector3 vector = tree.AreaVector(i), p = tree.Position(i);
    const double a = Norm(vector);
    const double sign = twoSided && Dot(vector, sums.AreaVector) < 0.0 ? -1.0 : 1.0;
    const std::array<double, 4> color = tree.Color(i);
    sums.Area += a;
    sums.Opacity += a * tree.OwnOpacity(i);
    sums.Overlap += a * tree.OverlapOf(i);
    const double seen = a * color[3] * (1.0 - tree.OverlapOf(i));
    sums.Mass += a * color[3];
    sums.Seen += seen;
    for (int c = 0; c < 3; ++c)
    {
      sums.AreaVector[c] += sign * vector[c];
      sums.Position[c] += a * p[c];
      sums.Color[c] += seen * color[c];
    }
  }
  return sums;
}

/// What is stored with 16 bits, in its unit.
constexpr double Packed = 1.01 * 0.5 / PackedOne;

double LargestElement(const Symmetric3& s)
{
  return std::max({ std::abs(s.XX), std::abs(s.YY), std::abs(s.ZZ), std::abs(s.XY), std::abs(s.YZ),
    std::abs(s.XZ) });
}

/// Mean covariance of the leaves below a node.
Symmetric3 LeafCovariance(const SurfelCloud& tree, std::size_t node)
{
  const float* s = tree.LeafCovariances + 6 * (node - tree.NumberOfSurfels);
  return { s[0], s[1], s[2], s[3], s[4], s[5] };
}

void CheckCovariance(const Symmetric3& stored, const Symmetric3& expected, double tolerance)
{
  const Symmetric3 d = Mix(stored, 1.0, expected, -1.0);
  CHECK_NEAR(LargestElement(d) / expected.Trace(), 0.0, tolerance);
}

/// Bounds, covariances and the first moment of colour of a node, against its leaves.
void CheckSpread(const SurfelCloud& tree, std::size_t node, std::size_t first, std::size_t last,
  const LeafSums& sums, bool twoSided)
{
  const Vector3 p = tree.Position(node), axis = tree.AreaVector(node);
  double cosine = 1.0, farthest = 0.0;
  Symmetric3 covariance{}, leaves{};
  double gradient[3][3] = {};
  for (std::size_t i = first; i < last; ++i)
  {
    const Vector3 q = tree.Position(i), a = tree.AreaVector(i);
    const Vector3 d{ q[0] - p[0], q[1] - p[1], q[2] - p[2] };
    farthest = std::max(farthest, Norm(d));
    cosine = std::min(cosine, Dot(a, axis) / (Norm(a) * Norm(axis)));
    const double share = Norm(a) / sums.Area;
    leaves = Mix(leaves, 1.0, tree.Covariance(i), share);
    AddOuterProduct(covariance, d, share);
    const std::array<double, 4> color = tree.Color(i);
    const double seen = Norm(a) * color[3] * (1.0 - tree.OverlapOf(i));
    for (int c = 0; c < 3; ++c)
    {
      for (int x = 0; x < 3; ++x)
      {
        gradient[c][x] += seen / sums.Seen * (color[c] - sums.Color[c] / sums.Seen) * q[x];
      }
    }
  }
  covariance = Mix(covariance, 1.0, leaves, 1.0);
  CHECK(farthest <= tree.Node(node).Bound);
  const double cone = ConeOf(tree.Node(node));
  CHECK((twoSided ? cone == -1.0 : cosine >= cone));
  CheckCovariance(tree.Covariance(node), covariance, 8.0 * Packed);
  CheckCovariance(LeafCovariance(tree, node), leaves, 1e-6);
  const ColorMoments colors = UnpackColor(tree.NodeColors[node - tree.NumberOfSurfels]);
  for (int c = 0; c < 3; ++c)
  {
    for (int x = 0; x < 3; ++x)
    {
      CHECK_NEAR(colors.First[c][x], gradient[c][x], Packed * std::sqrt(covariance.Trace()) + 1e-6);
    }
  }
}

void CheckNode(const TestHierarchy& h, int level, int tree, std::size_t j)
{
  const HierarchyLayout& layout = h.Order.Layout;
  const bool twoSided = tree == HierarchyLayout::TwoSided;
  const SurfelCloud cloud = h.Get();
  const std::size_t node = layout.Begin(level, tree) + j;
  const std::size_t first = layout.Begin(0, tree) + (j << level);
  const std::size_t last =
    layout.Begin(0, tree) + std::min<std::size_t>((j + 1) << level, layout.NumberOfLeaves(tree));
  const LeafSums sums = SumLeaves(cloud, first, last, twoSided);
  CHECK(cloud.IsTwoSided(node) == twoSided);
  CHECK_NEAR(cloud.Node(node).Area, sums.Area, 1e-7 * sums.Area);
  CHECK_NEAR(cloud.OwnOpacity(node), sums.Opacity / sums.Area, Packed);
  // The mean of the children as they are stored (SheetOverlap.h): each level rounds once more.
  CHECK_NEAR(cloud.OverlapOf(node), sums.Overlap / sums.Area, 2.0 * Packed * level);
  const Vector3 p = cloud.Position(node), a = cloud.AreaVector(node);
  const double sign = Dot(a, sums.AreaVector) < 0.0 ? -1.0 : 1.0;
  const std::array<double, 4> color = cloud.Color(node);
  CHECK_NEAR(color[3], sums.Mass / sums.Area, Packed);
  for (int c = 0; c < 3; ++c)
  {
    CHECK_NEAR(p[c], sums.Position[c] / sums.Area, 3e-7);
    CHECK_NEAR(a[c], sign * sums.AreaVector[c], Packed * sums.Area);
    CHECK_NEAR(color[c], sums.Color[c] / sums.Seen, Packed);
  }
  CheckSpread(cloud, node, first, last, sums, twoSided);
}

TEST_CASE("Moments")
{
  Random random(1);
  const TestHierarchy h(BallAndSheet(700, random));
  CHECK(h.Order.Layout.NumberOfLeaves(0) == 700);
  CHECK(h.Order.Layout.NumberOfLeaves(1) == 700);
  for (int level = 1; level < h.Order.Layout.NumberOfLevels(); ++level)
  {
    for (int tree = 0; tree < 2; ++tree)
    {
      for (std::size_t j = 0; j < h.Order.Layout.Count(level, tree); ++j)
      {
        CheckNode(h, level, tree, j);
      }
    }
  }
}

/// Nodes are known for those of other kernels, however few these are.
TEST_CASE("Nodes of kernels that have changed")
{
  const auto make = [] {
    Random random(1);
    return TestHierarchy(BallAndSheet(700, random));
  };
  const auto areOfKernels = [](const TestHierarchy& h) {
    return AreNodesOfKernels(h.Get(), h.Order.Layout, SerialExecutor());
  };
  CHECK(areOfKernels(make()));
  TestHierarchy moved = make(), wider = make(), larger = make(), turned = make(), fainter = make();
  for (float& x : moved.Positions)
  {
    x += 3.0f;
  }
  CHECK(areOfKernels(moved)); // LeafPlacement.h is for that
  wider.Covariances[6 * 300] *= 1.2f;
  CHECK(!areOfKernels(wider));
  larger.AreaVectors[3 * 1000] += 0.1f;
  CHECK(!areOfKernels(larger));
  for (int c = 0; c < 3; ++c)
  {
    turned.AreaVectors[3 * 1000 + c] *= -1.0f; // of the two-sided tree, where signs mean nothing
  }
  CHECK(areOfKernels(turned));
  for (int c = 0; c < 3; ++c)
  {
    turned.AreaVectors[3 * 300 + c] *= -1.0f;
  }
  CHECK(!areOfKernels(turned));
  CHECK(AreSidesOfTrees(turned.Get(), turned.Order.Layout));
  turned.TwoSided[300] = 1;
  CHECK(!AreSidesOfTrees(turned.Get(), turned.Order.Layout));
  fainter.Opacities[1399] *= 0.8f;
  CHECK(!areOfKernels(fainter));
  TestHierarchy covered = make();
  covered.Overlaps[300] = 100;
  CHECK(!areOfKernels(covered));
}

/// Front-facing area of the ball, sum max(0, -A.v), from many sides: that of the leaves at levels
/// that the rule of coherence lets be drawn.
TEST_CASE("Coverage")
{
  Random random(2);
  const TestHierarchy h(BallAndSheet(4000, random));
  const HierarchyLayout& layout = h.Order.Layout;
  const SurfelCloud tree = h.Get();
  for (int repeat = 0; repeat < 50; ++repeat)
  {
    const Vector3 v = random.Direction();
    double leaves = 0.0;
    for (int level = 0; level <= 4; ++level)
    {
      double sum = 0.0;
      for (std::size_t j = 0; j < layout.Count(level, 0); ++j)
      {
        sum += std::max(0.0, -Dot(tree.AreaVector(layout.Begin(level, 0) + j), v));
      }
      leaves = level == 0 ? sum : leaves;
      CHECK_NEAR(sum / leaves, 1.0, 0.01 * level + 1e-12);
    }
  }
}

template <typename T>
bool SameBytes(const std::vector<T>& a, const std::vector<T>& b)
{
  return a.size() == b.size() &&
    (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

bool Same(const TestHierarchy& a, const TestHierarchy& b)
{
  return a.Order.Surfels == b.Order.Surfels && SameBytes(a.Nodes, b.Nodes) &&
    SameBytes(a.Colors, b.Colors) && a.LeafCovariances == b.LeafCovariances;
}

TEST_CASE("Threads")
{
  Random random(3);
  const TestCloud cloud = BallAndSheet(30000, random);
  const TestHierarchy one(cloud);
  for (unsigned int threads : { 2u, 8u })
  {
    CHECK(Same(one, TestHierarchy(cloud, ThreadExecutor(threads))));
  }
}

bool IsFinite(const TestHierarchy& h)
{
  const SurfelCloud tree = h.Get();
  for (std::size_t i = tree.NumberOfSurfels; i < h.NumberOfNodes(); ++i)
  {
    const Vector3 p = tree.Position(i), a = tree.AreaVector(i);
    const std::array<double, 4> c = tree.Color(i);
    if (!std::isfinite(p[0] + p[1] + p[2]) || !std::isfinite(a[0] + a[1] + a[2]) ||
      !std::isfinite(tree.Covariance(i).Trace()) || !std::isfinite(tree.Node(i).Bound) ||
      !std::isfinite(LeafCovariance(tree, i).Trace()) || !std::isfinite(c[0] + c[1] + c[2] + c[3]))
    {
      return false;
    }
  }
  return true;
}

/// From outside, inside and far away, through pinhole and lens, at any error: no NaN, nothing
/// negative.
void CheckPictures(const TestHierarchy& h)
{
  for (int i = 0; i < 24; ++i)
  {
    SplatContext context;
    context.Camera = PinholeView(32, 32, i % 2 ? 30.0 : 3000.0);
    const double distances[] = { 0.0, 0.9, 5.0, 1e9 };
    context.Camera.WorldToCamera.T[2] = distances[i % 4];
    context.Camera.Near = i % 3 ? 1e-6 : 0.0;
    context.Camera.Parallel = i % 8 == 7;
    const double radii[] = { 0.0, 0.1, 1e6 };
    context.Optics = { radii[i % 3], 2.0 };
    context.Cut.Rule = i % 5 == 4 ? CutRule::Paper : CutRule::Moments;
    const double errors[] = { 1.0, 0.0, 100.0 };
    context.Cut.Error = errors[i / 8];
    const Picture picture = RenderPicture(context, { h.Get() });
    CHECK(std::all_of(picture.Color.begin(), picture.Color.end(),
      [](float x) { return std::isfinite(x) && x >= 0.0f; }));
  }
}

/// No point, one point, all points in one place, on a line, at extremes, without area, and NaN.
TEST_CASE("Degenerate")
{
  for (int kind = 0; kind < 7; ++kind)
  {
    TestCloud cloud;
    const int count = kind == 0 ? 0 : kind == 1 ? 1 : 300;
    Random random(4);
    for (int i = 0; i < count; ++i)
    {
      TestSurfel s;
      const double t = random.Uniform(-1, 1);
      s.Position = kind == 2 ? Vector3{ 1, 2, 3 }
        : kind == 3          ? Vector3{ t, 2 * t, 3 * t }
        : kind == 4          ? Vector3{ 1e12 * t, 1e-12 * t, 1e9 * t }
                             : Vector3{ t, random.Uniform(-1, 1), random.Uniform(-1, 1) };
      s.Area = kind == 5 ? 0.0 : kind == 4 ? 1e20 : 1e-3;
      s.Normal = random.Direction();
      s.Position[0] =
        kind == 6 && i % 3 == 0 ? std::numeric_limits<double>::quiet_NaN() : s.Position[0];
      cloud.Add(s);
    }
    const TestHierarchy h(cloud);
    CHECK(IsFinite(h));
    CHECK(h.Order.NumberOfInvalidSurfels == (kind == 6 ? 100u : 0u));
    CHECK(h.Order.Layout.NumberOfLeaves() ==
      static_cast<std::size_t>(count) - h.Order.NumberOfInvalidSurfels);
    std::vector<std::uint32_t> order = h.Order.Surfels;
    std::sort(order.begin(), order.end());
    CHECK(std::adjacent_find(order.begin(), order.end()) == order.end());
    CheckPictures(h);
  }
}

/// Two parallel sheets that face away from each other, closer than a node is wide: split by their
/// normals, small nodes stay on one side.
TEST_CASE("Folds")
{
  TestCloud cloud;
  Random random(5);
  for (int i = 0; i < 4096; ++i)
  {
    TestSurfel s;
    s.Position = { random.Uniform(-1, 1), random.Uniform(-1, 1), i % 2 ? 0.01 : -0.01 };
    s.Normal = { 0.0, 0.0, i % 2 ? 1.0 : -1.0 };
    cloud.Add(s);
  }
  const TestHierarchy h(cloud);
  const SurfelCloud tree = h.Get();
  int mixed = 0;
  for (std::size_t j = 0; j < h.Order.Layout.Count(5, 0); ++j)
  {
    const std::size_t node = h.Order.Layout.Begin(5, 0) + j;
    mixed += Coherence(tree.AreaVector(node), tree.Node(node).Area) < 0.5 ? 1 : 0;
  }
  CHECK(mixed < 20); // of 128; by position alone nearly all
}

/// Any moments to 16 bits and back: to half a step of their units, whatever the rank.
TEST_CASE("Packing")
{
  Random random(6);
  for (int i = 0; i < 2000; ++i)
  {
    NodeMoments m;
    const double size = std::pow(10.0, random.Uniform(-12, 12));
    const int rank = random.Integer(0, 3);
    for (int r = 0; r < rank; ++r)
    {
      const double thin = r > 0 ? std::pow(10.0, random.Uniform(-6, 0)) : 1.0;
      AddOuterProduct(m.Covariance, random.Direction(), size * size * thin * thin);
    }
    m.Area = size * size;
    m.AreaVector = random.Direction();
    for (double& x : m.AreaVector)
    {
      x *= m.Area * random.Uniform(0, 1);
    }
    m.Opacity = random.Uniform(0, 1);
    m.Overlap = random.Uniform(0, 1);
    const bool twoSided = random.Integer(0, 1) != 0;
    const HierarchyNode node = PackNode(m, twoSided);
    const Symmetric3 s = CovarianceOf(node);
    const double largest = LargestElement(Mix(s, 1.0, m.Covariance, -1.0));
    CHECK(largest <= 8.0 * Packed * m.Covariance.Trace());
    for (int c = 0; c < 3; ++c)
    {
      CHECK_NEAR(AreaVectorOf(node)[c], m.AreaVector[c], Packed * m.Area);
    }
    CHECK_NEAR(OpacityOf(node), m.Opacity, Packed);
    CHECK_NEAR(OverlapOf(node), m.Overlap, 2.0 * Packed);
    CHECK(IsTwoSided(node) == twoSided);
  }
  HierarchyNode node{};
  for (double cosine : { -1.0, -0.3, 0.0, 0.99999, 1.0 })
  {
    SetBounds(1.0 / 3.0, cosine, node);
    CHECK(node.Bound >= 1.0 / 3.0);
    CHECK(ConeOf(node) <= cosine);
    CHECK(ConeOf(node) >= cosine - 1e-4);
  }
  // Never NaN, whatever comes.
  NodeMoments wild;
  wild.Area = wild.AreaVector[1] = std::numeric_limits<double>::infinity();
  wild.Covariance = { 1e300, 1e300, 1e300, 1e300, -1e300, std::nan("") };
  const HierarchyNode packed = PackNode(wild, false);
  CHECK(std::isfinite(packed.Area));
  CHECK(std::isfinite(CovarianceOf(packed).Trace()));
  CHECK(std::isfinite(Norm(AreaVectorOf(packed))));
}
}
