// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Hierarchy/KdTreeOrder.h"

#include "Core/Base/Buffer.h"
#include "Core/Surfels/NodeMoments.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <utility>

namespace SurfelSplatting
{
namespace
{
constexpr std::size_t Grain = 4096;

/// Nodes of at most MaxFold leaves are split by normals if their coherence is below FoldCoherence.
/// Both were measured on ray-traced scenes.
constexpr std::size_t MaxFold = 256;
constexpr double FoldCoherence = 0.95;

struct Leaf
{
  float Position[3];
  float Normal[3];   ///< area vector
  std::uint64_t Key; ///< see KeyOf

  std::uint32_t Surfel() const { return static_cast<std::uint32_t>(this->Key); }
};

/// An integer whose order is that of the places along the direction of a split, and of the surfels
/// where these are equal.
std::uint64_t KeyOf(double place, std::uint32_t surfel)
{
  const float single = static_cast<float>(place) + 0.0f; // not -0
  std::uint32_t bits;
  std::memcpy(&bits, &single, sizeof bits);
  const std::uint32_t ordered = bits ^ (bits >> 31 != 0 ? 0xffffffffu : 0x80000000u);
  return static_cast<std::uint64_t>(ordered) << 32 | surfel;
}

Vector3 ToVector(const float* v)
{
  return { v[0], v[1], v[2] };
}

void Store(const Vector3& v, float* out)
{
  std::copy(v.begin(), v.end(), out);
}

/// A direction close to the eigenvector of S's largest eigenvalue; zero if S is zero. Nine steps of
/// von Mises's power iteration.
Vector3 PrincipalDirection(const Symmetric3& s)
{
  const double trace = s.XX + s.YY + s.ZZ;
  if (!(trace > 0.0))
  {
    return { 0, 0, 0 };
  }
  // With the trace 1 the largest eigenvalue is 1/3 to 1: the vector stays within the range of
  // double.
  const double scale = 1.0 / trace;
  const Symmetric3 unit = Mix(s, scale, Symmetric3{}, 0.0);
  Vector3 v = s.XX >= s.YY && s.XX >= s.ZZ ? Vector3{ unit.XX, unit.XY, unit.XZ }
    : s.YY >= s.ZZ                         ? Vector3{ unit.XY, unit.YY, unit.YZ }
                                           : Vector3{ unit.XZ, unit.YZ, unit.ZZ };
  for (int i = 0; i < 8; ++i)
  {
    v = unit.Multiply(v);
  }
  const double length = Norm(v);
  return length > 0.0 ? Vector3{ v[0] / length, v[1] / length, v[2] / length } : Vector3{ 0, 0, 0 };
}

using Field = float (Leaf::*)[3];

Vector3 Sum(const Leaf* leaves, std::size_t count, Field field)
{
  Vector3 sum{ 0, 0, 0 };
  for (std::size_t i = 0; i < count; ++i)
  {
    for (int c = 0; c < 3; ++c)
    {
      sum[c] += (leaves[i].*field)[c];
    }
  }
  return sum;
}

Symmetric3 SumOfSquares(const Leaf* leaves, std::size_t count, Field field, const Vector3& mean)
{
  Symmetric3 s{};
  for (std::size_t i = 0; i < count; ++i)
  {
    const float* x = leaves[i].*field;
    AddOuterProduct(s, { x[0] - mean[0], x[1] - mean[1], x[2] - mean[2] }, 1.0);
  }
  return s;
}

/// Sums function(leaves, count) over pieces of a range; the same at any number of threads.
template <typename Value, typename Function, typename Add>
Value SumOfPieces(const Leaf* leaves, std::size_t count, const Executor& executor,
  const Function& function, const Add& add)
{
  if (count <= Grain)
  {
    return function(leaves, count);
  }
  std::vector<Value> pieces((count + Grain - 1) / Grain);
  executor.For(pieces.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
    {
      pieces[i] = function(leaves + i * Grain, std::min(Grain, count - i * Grain));
    }
  });
  Value sum = pieces[0];
  for (std::size_t i = 1; i < pieces.size(); ++i)
  {
    sum = add(sum, pieces[i]);
  }
  return sum;
}

/// Covariance of three floats of the leaves, times their number.
Symmetric3 Scatter(const Leaf* leaves, std::size_t count, Field field, const Executor& executor)
{
  Vector3 mean = SumOfPieces<Vector3>(
    leaves, count, executor,
    [field](const Leaf* piece, std::size_t size) { return Sum(piece, size, field); },
    [](const Vector3& x, const Vector3& y) {
      return Vector3{ x[0] + y[0], x[1] + y[1], x[2] + y[2] };
    });
  for (double& x : mean)
  {
    x /= static_cast<double>(count);
  }
  return SumOfPieces<Symmetric3>(
    leaves, count, executor,
    [field, &mean](
      const Leaf* piece, std::size_t size) { return SumOfSquares(piece, size, field, mean); },
    [](const Symmetric3& x, const Symmetric3& y) { return Mix(x, 1.0, y, 1.0); });
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

/// The signs of two-sided normals have no meaning: turns all to the side of the principal
/// direction.
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

/// The largest power of two below count >= 2: the left child of a node is always full.
std::size_t LeftCount(std::size_t count)
{
  std::size_t left = 1;
  while (2 * left < count)
  {
    left *= 2;
  }
  return left;
}

/// The median of nine keys between the first and the last one.
std::uint64_t MedianOfNine(const std::uint64_t* keys, std::size_t count)
{
  std::uint64_t some[9];
  for (std::size_t i = 0; i < 9; ++i)
  {
    some[i] = keys[i * (count - 1) / 8];
  }
  std::nth_element(some, some + 4, some + 9);
  return some[4];
}

/// The key of this rank among distinct ones, whose order changes. Quickselect; no branch depends on
/// single keys, of which half would be predicted wrongly.
std::uint64_t FindKey(std::uint64_t* keys, std::size_t count, std::size_t rank)
{
  constexpr std::size_t few = 32;
  constexpr int mostRounds = 64; // for keys with which the medians are far off
  for (int round = 0; round < mostRounds && count > few; ++round)
  {
    const std::uint64_t pivot = MedianOfNine(keys, count);
    std::size_t below = 0;
    for (std::size_t i = 0; i < count; ++i)
    {
      const std::uint64_t key = keys[i];
      keys[i] = keys[below];
      keys[below] = key;
      below += key < pivot ? 1 : 0;
    }
    if (rank < below)
    {
      count = below;
    }
    else
    {
      keys += below;
      count -= below;
      rank -= below;
    }
  }
  std::nth_element(keys, keys + rank, keys + count);
  return keys[rank];
}

/// Moves the leaves with keys below the limit to the beginning, without branches as well.
void Divide(Leaf* leaves, std::size_t count, std::uint64_t limit)
{
  std::size_t below = 0;
  for (std::size_t i = 0; i < count; ++i)
  {
    const Leaf leaf = leaves[i];
    leaves[i] = leaves[below];
    leaves[below] = leaf;
    below += leaf.Key < limit ? 1 : 0;
  }
}

/// Splits a range of leaves in two; returns the size of the first half.
/// @param keys scratch memory
std::size_t Split(Leaf* leaves, std::size_t count, bool twoSided, const Executor& executor,
  Buffer<std::uint64_t>& keys)
{
  bool byNormal = false;
  if (count <= MaxFold && count > 2)
  {
    if (twoSided)
    {
      AlignNormals(leaves, count);
    }
    byNormal = IsFolded(leaves, count);
  }
  const auto field = byNormal ? &Leaf::Normal : &Leaf::Position;
  const Vector3 direction = PrincipalDirection(Scatter(leaves, count, field, executor));
  keys.Resize(std::max(keys.Size(), count));
  executor.For(count, Grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
    {
      const double place = Dot(ToVector(leaves[i].*field), direction);
      keys[i] = leaves[i].Key = KeyOf(place, leaves[i].Surfel());
    }
  });
  const std::size_t left = LeftCount(count);
  Divide(leaves, count, FindKey(keys.Data(), count, left));
  return left;
}

/// Split() of two leaves: their principal direction is known. Half of all splits are of two.
void SplitPair(Leaf* leaves)
{
  const float *p = leaves[0].Position, *q = leaves[1].Position;
  const Vector3 d{ static_cast<double>(q[0]) - p[0], static_cast<double>(q[1]) - p[1],
    static_cast<double>(q[2]) - p[2] };
  const double x = std::abs(d[0]), y = std::abs(d[1]), z = std::abs(d[2]);
  const double largest = x >= y && x >= z ? d[0] : y >= z ? d[1] : d[2];
  const double length = std::copysign(Norm(d), largest);
  for (int i = 0; i < 2; ++i)
  {
    const double place = length != 0.0 ? Dot(ToVector(leaves[i].Position), d) / length : 0.0;
    leaves[i].Key = KeyOf(place, leaves[i].Surfel());
  }
  if (leaves[1].Key < leaves[0].Key)
  {
    std::swap(leaves[0], leaves[1]);
  }
}

void SplitAll(Leaf* leaves, std::size_t count, bool twoSided, Buffer<std::uint64_t>& keys)
{
  while (count > 1)
  {
    if (count == 2)
    {
      SplitPair(leaves);
      return;
    }
    const std::size_t left = Split(leaves, count, twoSided, SerialExecutor(), keys);
    SplitAll(leaves, left, twoSided, keys);
    leaves += left;
    count -= left;
  }
}

struct Range
{
  std::size_t Begin, Count;
  bool TwoSided;
};

/// Halves the ranges until there are enough for all threads. All threads work together on one that
/// has most of the leaves: the root, and its left child, which may be several times as large as the
/// right one.
void SplitInParallel(Leaf* leaves, std::vector<Range> ranges, const Executor& executor)
{
  constexpr std::size_t enough = 64;
  std::size_t all = 0;
  for (const Range& r : ranges)
  {
    all += r.Count;
  }
  const auto hasMost = [all](const Range& r) { return r.Count > all / 2; };
  bool halved = true;
  while (halved && ranges.size() < enough)
  {
    std::vector<std::size_t> left(ranges.size(), 0);
    const auto halve = [&](std::size_t i, const Executor& threads, Buffer<std::uint64_t>& keys) {
      const Range& r = ranges[i];
      left[i] =
        r.Count > Grain ? Split(leaves + r.Begin, r.Count, r.TwoSided, threads, keys) : r.Count;
    };
    const auto largest = static_cast<std::size_t>(
      std::find_if(ranges.begin(), ranges.end(), hasMost) - ranges.begin());
    if (largest < ranges.size())
    {
      Buffer<std::uint64_t> keys;
      halve(largest, executor, keys);
    }
    executor.For(ranges.size(), 1, [&](std::size_t begin, std::size_t end) {
      Buffer<std::uint64_t> keys;
      for (std::size_t i = begin; i < end; ++i)
      {
        if (i != largest)
        {
          halve(i, SerialExecutor(), keys);
        }
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
    Buffer<std::uint64_t> keys;
    for (std::size_t i = begin; i < end; ++i)
    {
      SplitAll(leaves + ranges[i].Begin, ranges[i].Count, ranges[i].TwoSided, keys);
    }
  });
}

bool IsFinite(const SurfelCloud& cloud, std::size_t i)
{
  const Vector3 p = cloud.Position(i), a = cloud.AreaVector(i);
  const Symmetric3 s = cloud.Covariance(i);
  return std::isfinite(p[0] + p[1] + p[2]) && std::isfinite(a[0] + a[1] + a[2]) &&
    (!cloud.IsInSpace() || std::isfinite(cloud.Densities[i])) &&
    std::isfinite(s.XX + s.YY + s.ZZ) && std::isfinite(s.XY + s.YZ + s.XZ);
}
}

namespace
{
/// Surfels of a piece of the cloud, one-sided and two-sided ones apart; without non-finite ones.
struct SortedPiece
{
  std::vector<std::uint32_t> Sides[HierarchyLayout::NumberOfTrees];
  std::uint64_t Invalid = 0;
};

std::vector<SortedPiece> SortBySide(const SurfelCloud& cloud, const Executor& executor)
{
  constexpr std::size_t size = 65536;
  std::vector<SortedPiece> pieces((cloud.NumberOfSurfels + size - 1) / size);
  executor.For(pieces.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t piece = begin; piece < end; ++piece)
    {
      const std::size_t last = std::min(cloud.NumberOfSurfels, (piece + 1) * size);
      for (std::size_t i = piece * size; i < last; ++i)
      {
        const bool finite = IsFinite(cloud, i);
        pieces[piece].Invalid += finite ? 0 : 1;
        if (finite)
        {
          pieces[piece].Sides[cloud.IsTwoSided(i) ? 1 : 0].push_back(static_cast<std::uint32_t>(i));
        }
      }
    }
  });
  return pieces;
}
}

KdTreeOrder MakeKdTreeOrder(const SurfelCloud& cloud, const Executor& executor)
{
  KdTreeOrder order;
  std::size_t counts[HierarchyLayout::NumberOfTrees] = { 0, 0 };
  {
    const std::vector<SortedPiece> pieces = SortBySide(cloud, executor);
    order.Surfels.reserve(cloud.NumberOfSurfels);
    for (int tree = 0; tree < HierarchyLayout::NumberOfTrees; ++tree)
    {
      for (const SortedPiece& piece : pieces)
      {
        const std::vector<std::uint32_t>& side = piece.Sides[tree];
        order.Surfels.insert(order.Surfels.end(), side.begin(), side.end());
        counts[tree] += side.size();
        order.NumberOfInvalidSurfels += tree == 0 ? piece.Invalid : 0;
      }
    }
  }
  order.Layout = HierarchyLayout(counts[0], counts[1]);
  const std::size_t oneSided = counts[0];

  // Relative to a surfel, so that float positions keep their digits.
  const std::size_t count = order.Surfels.size();
  const std::unique_ptr<Leaf[]> leaves(new Leaf[count]); // the threads that fill it touch it first
  const Vector3 origin = count == 0 ? Vector3{ 0, 0, 0 } : cloud.Position(order.Surfels[0]);
  executor.For(count, Grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
    {
      const std::uint32_t surfel = order.Surfels[i];
      const Vector3 p = cloud.Position(surfel);
      Store(Vector3{ p[0] - origin[0], p[1] - origin[1], p[2] - origin[2] }, leaves[i].Position);
      Store(cloud.AreaVector(surfel), leaves[i].Normal);
      leaves[i].Key = surfel;
    }
  });
  SplitInParallel(
    leaves.get(), { { 0, oneSided, false }, { oneSided, count - oneSided, true } }, executor);
  executor.For(count, Grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
    {
      order.Surfels[i] = leaves[i].Surfel();
    }
  });
  return order;
}
}
