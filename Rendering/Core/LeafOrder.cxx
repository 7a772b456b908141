// SPDX-License-Identifier: BSD-3-Clause
#include "LeafOrder.h"

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
}
