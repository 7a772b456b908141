// SPDX-License-Identifier: BSD-3-Clause
#include "HierarchyBuilder.h"

#include "NodeMoments.h"

#include <algorithm>
#include <cmath>

namespace SurfelSplatting
{
namespace
{
constexpr std::size_t Grain = 4096;

/// Nodes up to this many leaves are split by their normals where their area vectors cancel below
/// this coherence. Both measured on ray-traced scenes.
constexpr std::size_t LargestFold = 256;
constexpr double FoldCoherence = 0.95;

struct Leaf
{
  float Position[3];
  float Normal[3]; ///< area vector
  float Key;       ///< position along the direction of the split
  std::uint32_t Surfel;

  bool operator<(const Leaf& other) const
  {
    return this->Key != other.Key ? this->Key < other.Key : this->Surfel < other.Surfel;
  }
};

Vector3 ToVector(const float* v)
{
  return { v[0], v[1], v[2] };
}

void Store(const Vector3& v, float* out)
{
  std::copy(v.begin(), v.end(), out);
}

void Store(const Symmetric3& s, float* out)
{
  const double values[6] = { s.XX, s.YY, s.ZZ, s.XY, s.YZ, s.XZ };
  std::copy_n(values, 6, out);
}

Symmetric3 ToSymmetric(const float* s)
{
  return { s[0], s[1], s[2], s[3], s[4], s[5] };
}

/// A direction close to that of S's largest eigenvalue; zero where S is zero.
Vector3 PrincipalDirection(const Symmetric3& s)
{
  Vector3 v = s.XX >= s.YY && s.XX >= s.ZZ ? Vector3{ s.XX, s.XY, s.XZ }
    : s.YY >= s.ZZ                         ? Vector3{ s.XY, s.YY, s.YZ }
                                           : Vector3{ s.XZ, s.YZ, s.ZZ };
  for (int i = 0; i < 8; ++i)
  {
    const double length = Norm(v);
    if (!(length > 0.0))
    {
      return { 0, 0, 0 };
    }
    v = s.Multiply({ v[0] / length, v[1] / length, v[2] / length });
  }
  const double length = Norm(v);
  return length > 0.0 ? Vector3{ v[0] / length, v[1] / length, v[2] / length } : Vector3{ 0, 0, 0 };
}

/// Covariance of three floats of the leaves, times their number.
Symmetric3 Scatter(const Leaf* leaves, std::size_t count, const float (Leaf::*field)[3])
{
  Vector3 mean{ 0, 0, 0 };
  for (std::size_t i = 0; i < count; ++i)
  {
    for (int c = 0; c < 3; ++c)
    {
      mean[c] += (leaves[i].*field)[c];
    }
  }
  for (double& x : mean)
  {
    x /= static_cast<double>(count);
  }
  Symmetric3 s{};
  for (std::size_t i = 0; i < count; ++i)
  {
    const float* x = leaves[i].*field;
    AddOuterProduct(s, { x[0] - mean[0], x[1] - mean[1], x[2] - mean[2] }, 1.0);
  }
  return s;
}

bool IsFolded(const Leaf* leaves, std::size_t count)
{
  Vector3 sum{ 0, 0, 0 };
  double area = 0.0;
  for (std::size_t i = 0; i < count; ++i)
  {
    const Vector3 a = ToVector(leaves[i].Normal);
    for (int c = 0; c < 3; ++c)
    {
      sum[c] += a[c];
    }
    area += Norm(a);
  }
  return Coherence(sum, area) < FoldCoherence;
}

/// Two-sided leaves' signs mean nothing: all to the side of the principal direction.
void AlignNormals(Leaf* leaves, std::size_t count)
{
  Symmetric3 s{};
  for (std::size_t i = 0; i < count; ++i)
  {
    AddOuterProduct(s, ToVector(leaves[i].Normal), 1.0);
  }
  const Vector3 direction = PrincipalDirection(s);
  for (std::size_t i = 0; i < count; ++i)
  {
    const float sign = Dot(ToVector(leaves[i].Normal), direction) < 0.0 ? -1.0f : 1.0f;
    for (float& x : leaves[i].Normal)
    {
      x *= sign;
    }
  }
}

/// The largest power of two below count, count >= 2: the left child of a node is always full.
std::size_t LeftCount(std::size_t count)
{
  std::size_t left = 1;
  while (2 * left < count)
  {
    left *= 2;
  }
  return left;
}

/// Splits a range of leaves in two; returns the size of the first.
std::size_t Split(Leaf* leaves, std::size_t count, bool twoSided)
{
  bool byNormal = false;
  if (count <= LargestFold && count > 2)
  {
    if (twoSided)
    {
      AlignNormals(leaves, count);
    }
    byNormal = IsFolded(leaves, count);
  }
  const auto field = byNormal ? &Leaf::Normal : &Leaf::Position;
  const Vector3 direction = PrincipalDirection(Scatter(leaves, count, field));
  for (std::size_t i = 0; i < count; ++i)
  {
    leaves[i].Key = static_cast<float>(Dot(ToVector(leaves[i].*field), direction));
  }
  const std::size_t left = LeftCount(count);
  std::nth_element(leaves, leaves + left, leaves + count);
  return left;
}

void SplitAll(Leaf* leaves, std::size_t count, bool twoSided)
{
  while (count > 1)
  {
    const std::size_t left = Split(leaves, count, twoSided);
    SplitAll(leaves, left, twoSided);
    leaves += left;
    count -= left;
  }
}

struct Range
{
  std::size_t Begin, Count;
  bool TwoSided;
};

/// Halves the largest ranges until there are enough for all threads.
void SplitInParallel(std::vector<Leaf>& leaves, std::vector<Range> ranges, const Executor& executor)
{
  constexpr std::size_t enough = 64;
  bool halved = true;
  while (halved && ranges.size() < enough)
  {
    std::vector<std::size_t> left(ranges.size(), 0);
    executor.For(ranges.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i)
      {
        const Range& r = ranges[i];
        left[i] = r.Count > Grain ? Split(leaves.data() + r.Begin, r.Count, r.TwoSided) : r.Count;
      }
    });
    std::vector<Range> next;
    halved = false;
    for (std::size_t i = 0; i < ranges.size(); ++i)
    {
      const Range& r = ranges[i];
      next.push_back({ r.Begin, left[i], r.TwoSided });
      if (left[i] < r.Count)
      {
        next.push_back({ r.Begin + left[i], r.Count - left[i], r.TwoSided });
        halved = true;
      }
    }
    ranges.swap(next);
  }
  executor.For(ranges.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
    {
      SplitAll(leaves.data() + ranges[i].Begin, ranges[i].Count, ranges[i].TwoSided);
    }
  });
}

bool IsFinite(const SurfelCloud& cloud, std::size_t i)
{
  const Vector3 p = cloud.Position(i), a = cloud.AreaVector(i);
  const Symmetric3 s = cloud.Covariance(i);
  return std::isfinite(p[0] + p[1] + p[2]) && std::isfinite(a[0] + a[1] + a[2]) &&
    std::isfinite(s.XX + s.YY + s.ZZ) && std::isfinite(s.XY + s.YZ + s.XZ);
}

/// Reads and writes the values of nodes.
class NodeAccess
{
public:
  explicit NodeAccess(const NodeArrays& arrays)
    : Arrays(arrays)
  {
  }

  NodeMoments Get(std::size_t i) const
  {
    NodeMoments m;
    m.Area = this->Arrays.Areas[i];
    m.AreaVector = ToVector(this->Arrays.AreaVectors + 3 * i);
    m.Position = ToVector(this->Arrays.Positions + 3 * i);
    m.Covariance = ToSymmetric(this->Arrays.Covariances + 6 * i);
    m.LeafCovariance = ToSymmetric(this->Arrays.LeafCovariances + 6 * i);
    m.Opacity = this->Arrays.Opacities ? this->Arrays.Opacities[i] : 1.0;
    return m;
  }

  void Set(std::size_t i, const NodeMoments& m) const
  {
    this->Arrays.Areas[i] = static_cast<float>(m.Area);
    Store(m.AreaVector, this->Arrays.AreaVectors + 3 * i);
    Store(m.Position, this->Arrays.Positions + 3 * i);
    Store(m.Covariance, this->Arrays.Covariances + 6 * i);
    Store(m.LeafCovariance, this->Arrays.LeafCovariances + 6 * i);
    if (this->Arrays.Opacities)
    {
      this->Arrays.Opacities[i] = static_cast<float>(m.Opacity);
    }
  }

  Vector3 Position(std::size_t i) const { return ToVector(this->Arrays.Positions + 3 * i); }
  Vector3 AreaVector(std::size_t i) const { return ToVector(this->Arrays.AreaVectors + 3 * i); }

private:
  NodeArrays Arrays;
};

/// Upwards to the next float but a few, so that bounds hold for the float values.
constexpr double Outwards = 1.0 + 1e-6;

double CosineBetween(const Vector3& a, const Vector3& b)
{
  const double lengths = Norm(a) * Norm(b);
  return lengths > 0.0 ? Dot(a, b) / lengths : -1.0;
}

/// Sphere and cone about a node that hold those of nodes below it; exact where these are leaves.
void BoundNode(const NodeAccess& access, const NodeArrays& arrays, std::size_t node,
  std::size_t first, std::size_t last, bool leaves)
{
  double radius = 0.0, angle = 0.0, cosine = 1.0;
  const Vector3 p = access.Position(node), a = access.AreaVector(node);
  for (std::size_t i = first; i < last; ++i)
  {
    const Vector3 c = access.Position(i);
    const double distance = Norm({ c[0] - p[0], c[1] - p[1], c[2] - p[2] });
    radius = std::max(radius, distance + arrays.Bounds[i]);
    const double between = CosineBetween(access.AreaVector(i), a);
    cosine = std::fmin(cosine, between);
    if (!leaves)
    {
      const double widest = std::acos(std::fmin(1.0, std::fmax(-1.0, between))) +
        std::acos(std::fmin(1.0, std::fmax(-1.0, static_cast<double>(arrays.Cones[i]))));
      angle = std::max(angle, widest);
    }
  }
  if (!leaves)
  {
    constexpr double pi = 3.14159265358979323846;
    cosine = angle >= pi ? -1.0 : std::cos(angle);
  }
  arrays.Bounds[node] = static_cast<float>(radius * Outwards);
  arrays.Cones[node] = static_cast<float>(std::fmax(-1.0, cosine - 1e-6));
}

/// Spheres and cones of a level: about leaves where these are few, else about the nodes of
/// BoundedLevel, which keeps both tight without looking at all leaves once a level.
constexpr int BoundedLevel = 6;

void BoundLevel(const HierarchyLayout& layout, int tree, int level, const NodeAccess& access,
  const NodeArrays& arrays, const Executor& executor)
{
  const int below = level <= BoundedLevel ? 0 : BoundedLevel;
  const std::size_t begin = layout.Begin(below, tree), count = layout.Count(below, tree);
  const std::size_t grain = std::max<std::size_t>(1, Grain >> (level - below));
  executor.For(layout.Count(level, tree), grain, [&](std::size_t from, std::size_t to) {
    for (std::size_t j = from; j < to; ++j)
    {
      const std::size_t node = layout.Begin(level, tree) + j;
      BoundNode(access, arrays, node, begin + (j << (level - below)),
        begin + std::min<std::size_t>((j + 1) << (level - below), count), below == 0);
      if (tree == HierarchyLayout::TwoSided)
      {
        arrays.Cones[node] = -1.0f; // seen from everywhere
      }
    }
  });
}

void FillLeaves(const SurfelCloud& cloud, const LeafOrder& order, const Vector3& shift,
  const Executor& executor, const NodeArrays& arrays)
{
  const NodeAccess access(arrays);
  executor.For(order.Surfels.size(), Grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
    {
      const std::uint32_t surfel = order.Surfels[i];
      const Vector3 p = cloud.Position(surfel);
      NodeMoments m;
      m.AreaVector = cloud.AreaVector(surfel);
      m.Area = Norm(m.AreaVector);
      m.Position = { p[0] - shift[0], p[1] - shift[1], p[2] - shift[2] };
      m.Covariance = m.LeafCovariance = cloud.Covariance(surfel);
      m.Opacity = cloud.Opacities ? cloud.Opacities[surfel] : 1.0;
      access.Set(i, m);
      arrays.Bounds[i] = 0.0f;
      const bool twoSided = i >= order.Layout.NumberOfLeaves(HierarchyLayout::OneSided);
      arrays.Cones[i] = twoSided || !(m.Area > 0.0) ? -1.0f : 1.0f;
    }
  });
}
}

LeafOrder OrderLeaves(const SurfelCloud& cloud, const Executor& executor)
{
  std::vector<std::uint32_t> sides[HierarchyLayout::NumberOfTrees];
  LeafOrder order;
  for (std::size_t i = 0; i < cloud.NumberOfSurfels; ++i)
  {
    if (IsFinite(cloud, i))
    {
      const bool twoSided = cloud.TwoSided && cloud.TwoSided[i];
      sides[twoSided ? 1 : 0].push_back(static_cast<std::uint32_t>(i));
    }
    else
    {
      ++order.NumberOfInvalidSurfels;
    }
  }
  order.Layout = HierarchyLayout(sides[0].size(), sides[1].size());
  order.Surfels = std::move(sides[0]);
  const std::size_t oneSided = order.Surfels.size();
  order.Surfels.insert(order.Surfels.end(), sides[1].begin(), sides[1].end());
  std::vector<std::uint32_t>().swap(sides[1]);

  // About the middle, so that float positions keep their digits.
  std::vector<Leaf> leaves(order.Surfels.size());
  const Vector3 middle = leaves.empty() ? Vector3{ 0, 0, 0 } : cloud.Position(order.Surfels[0]);
  executor.For(leaves.size(), Grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
    {
      const std::uint32_t surfel = order.Surfels[i];
      const Vector3 p = cloud.Position(surfel);
      Store(Vector3{ p[0] - middle[0], p[1] - middle[1], p[2] - middle[2] }, leaves[i].Position);
      Store(cloud.AreaVector(surfel), leaves[i].Normal);
      leaves[i].Surfel = surfel;
    }
  });
  SplitInParallel(
    leaves, { { 0, oneSided, false }, { oneSided, leaves.size() - oneSided, true } }, executor);
  executor.For(leaves.size(), Grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
    {
      order.Surfels[i] = leaves[i].Surfel;
    }
  });
  return order;
}

void FillNodes(const SurfelCloud& cloud, const LeafOrder& order, const Vector3& shift,
  const Executor& executor, const NodeArrays& arrays)
{
  FillLeaves(cloud, order, shift, executor, arrays);
  const HierarchyLayout& layout = order.Layout;
  const NodeAccess access(arrays);
  for (int level = 1; level < layout.NumberOfLevels(); ++level)
  {
    for (int tree = 0; tree < HierarchyLayout::NumberOfTrees; ++tree)
    {
      const bool twoSided = tree == HierarchyLayout::TwoSided;
      const std::size_t below = layout.Begin(level - 1, tree);
      const std::size_t belowCount = layout.Count(level - 1, tree);
      const std::size_t first = layout.Begin(level, tree);
      executor.For(layout.Count(level, tree), Grain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t j = begin; j < end; ++j)
        {
          const std::size_t left = below + 2 * j;
          const NodeMoments moments = access.Get(left);
          access.Set(first + j,
            2 * j + 1 < belowCount ? Join(moments, access.Get(left + 1), twoSided) : moments);
        }
      });
      BoundLevel(layout, tree, level, access, arrays, executor);
    }
  }
}
}
