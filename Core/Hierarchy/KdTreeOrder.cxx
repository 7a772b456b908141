// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Hierarchy/KdTreeOrder.h"

#include "Core/Base/Buffer.h"
#include "Core/Base/KeySelection.h"
#include "Core/Base/KeySorter.h"
#include "Core/Base/Pieces.h"
#include "Core/Surfels/NodeMoments.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

namespace SurfelSplatting
{
namespace
{
constexpr std::size_t Grain = 4096;

/// All threads together split a range of more leaves.
constexpr std::size_t Many = 64 * Grain;

/// Nodes of at most MaxFold leaves are split by normals if their coherence is below FoldCoherence.
/// Both were measured on ray-traced scenes.
constexpr std::size_t MaxFold = 256;
constexpr double FoldCoherence = 0.95;

struct Leaf
{
  float Position[3];
  float Normal[3];   ///< area vector
  std::uint64_t Key; ///< KeyAt

  std::uint32_t Surfel() const { return IndexOfKey(this->Key); }
};

/// The order is that of the places along the direction of a split, and of the surfels where these
/// are equal.
std::uint64_t KeyAt(double place, std::uint32_t surfel)
{
  return KeyOf(static_cast<float>(place) + 0.0f, surfel); // not -0
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
  const double trace = s.Trace();
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

/// Sums of three floats of some leaves, relative to a place, and of their products.
struct Moments
{
  Vector3 First{ 0, 0, 0 };
  Symmetric3 Second{};

  Moments() = default;
  Moments(const Leaf* leaves, std::size_t count, Field field, const float* place)
  {
    for (std::size_t i = 0; i < count; ++i)
    {
      const float* x = leaves[i].*field;
      const Vector3 d{ static_cast<double>(x[0]) - place[0], static_cast<double>(x[1]) - place[1],
        static_cast<double>(x[2]) - place[2] };
      this->First = this->First + d;
      AddOuterProduct(this->Second, d, 1.0);
    }
  }

  void Add(const Moments& other)
  {
    this->First = this->First + other.First;
    this->Second = Mix(this->Second, 1.0, other.Second, 1.0);
  }
};

/// Covariance of three floats of the leaves, times their number. One of them is near enough to the
/// mean for one pass in double.
Symmetric3 Scatter(const Leaf* leaves, std::size_t count, Field field, const Executor& executor)
{
  const float* place = leaves[0].*field;
  Moments sum;
  if (count <= Grain)
  {
    sum = Moments(leaves, count, field, place);
  }
  else
  {
    std::vector<Moments> pieces(CountPieces(count, Grain));
    ForPieces(count, Grain, executor, [&](std::size_t i, std::size_t first, std::size_t size) {
      pieces[i] = Moments(leaves + first, size, field, place);
    });
    for (const Moments& piece : pieces)
    {
      sum.Add(piece);
    }
  }
  AddOuterProduct(sum.Second, sum.First, -1.0 / static_cast<double>(count));
  return sum.Second;
}

bool IsFolded(const Leaf* leaves, std::size_t count)
{
  Vector3 sum{ 0, 0, 0 };
  double area = 0.0;
  for (std::size_t i = 0; i < count; ++i)
  {
    const Vector3 a = ToVector(leaves[i].Normal);
    sum = sum + a;
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

/// Moves the leaves with keys below the limit to the beginning, without branches as well; returns
/// their number.
std::size_t Divide(Leaf* leaves, std::size_t count, std::uint64_t limit)
{
  std::size_t below = 0;
  for (std::size_t i = 0; i < count; ++i)
  {
    const Leaf leaf = leaves[i];
    leaves[i] = leaves[below];
    leaves[below] = leaf;
    below += leaf.Key < limit ? 1 : 0;
  }
  return below;
}

/// Leaves on the wrong side, one run after another.
class Misplaced
{
public:
  void Add(std::size_t begin, std::size_t end)
  {
    if (begin < end)
    {
      this->Runs.push_back({ begin, this->Count });
      this->Count += end - begin;
    }
  }
  std::size_t Size() const { return this->Count; }

  /// Calls visit(index of the leaf) for some of them.
  template <typename Visit>
  void For(std::size_t first, std::size_t last, const Visit& visit) const
  {
    auto run = std::upper_bound(this->Runs.begin(), this->Runs.end(), first,
                 [](std::size_t number, const Run& r) { return number < r.First; }) -
      1;
    for (std::size_t i = first; i < last; ++i)
    {
      const auto next = run + 1;
      run = next < this->Runs.end() && i >= next->First ? next : run;
      visit(i, run->Begin + (i - run->First));
    }
  }

private:
  struct Run
  {
    std::size_t Begin, First; // its first leaf, and how many are in the runs before
  };
  std::vector<Run> Runs;
  std::size_t Count = 0;
};

/// Divide() for many leaves, by all threads: `left` of them have keys below the limit.
void DivideTogether(
  Leaf* leaves, std::size_t count, std::uint64_t limit, std::size_t left, const Executor& executor)
{
  std::vector<std::size_t> below(CountPieces(count, Grain));
  ForPieces(count, Grain, executor, [&](std::size_t p, std::size_t first, std::size_t size) {
    below[p] = Divide(leaves + first, size, limit);
  });
  Misplaced high, low;
  for (std::size_t p = 0; p < below.size(); ++p)
  {
    const std::size_t first = p * Grain, last = std::min(count, first + Grain);
    high.Add(first + below[p], std::min(last, left));
    low.Add(std::max(first, left), first + below[p]);
  }
  executor.For(high.Size(), Grain, [&](std::size_t begin, std::size_t end) {
    std::vector<std::size_t> places;
    places.reserve(end - begin);
    low.For(begin, end, [&](std::size_t, std::size_t leaf) { places.push_back(leaf); });
    high.For(begin, end,
      [&](std::size_t i, std::size_t leaf) { std::swap(leaves[leaf], leaves[places[i - begin]]); });
  });
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
      keys[i] = leaves[i].Key = KeyAt(place, leaves[i].Surfel());
    }
  });
  const std::size_t left = LeftCount(count);
  const std::uint64_t limit = FindKey(keys.Data(), count, left, executor);
  if (count > Many)
  {
    DivideTogether(leaves, count, limit, left, executor);
  }
  else
  {
    Divide(leaves, count, limit);
  }
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
    leaves[i].Key = KeyAt(place, leaves[i].Surfel());
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

struct LeafRange
{
  std::size_t Begin, Count;
  bool TwoSided;
};

/// Halves the ranges until there are enough for all threads.
void SplitInParallel(Leaf* leaves, std::vector<LeafRange> ranges, const Executor& executor)
{
  constexpr std::size_t enough = 64;
  bool halved = true;
  while (halved && ranges.size() < enough)
  {
    std::vector<std::size_t> left(ranges.size(), 0);
    const auto halve = [&](std::size_t i, const Executor& threads, Buffer<std::uint64_t>& keys) {
      const LeafRange& r = ranges[i];
      left[i] =
        r.Count > Grain ? Split(leaves + r.Begin, r.Count, r.TwoSided, threads, keys) : r.Count;
    };
    {
      Buffer<std::uint64_t> keys;
      for (std::size_t i = 0; i < ranges.size(); ++i)
      {
        if (ranges[i].Count > Many)
        {
          halve(i, executor, keys);
        }
      }
    }
    executor.For(ranges.size(), 1, [&](std::size_t begin, std::size_t end) {
      Buffer<std::uint64_t> keys;
      for (std::size_t i = begin; i < end; ++i)
      {
        if (ranges[i].Count <= Many)
        {
          halve(i, SerialExecutor(), keys);
        }
      }
    });
    std::vector<LeafRange> next;
    halved = false;
    for (std::size_t i = 0; i < ranges.size(); ++i)
    {
      const LeafRange& r = ranges[i];
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

bool HasFiniteNormal(const SurfelCloud& cloud, std::size_t i)
{
  const float* n = cloud.Normals ? cloud.Normals + 3 * i : nullptr;
  return !n || std::isfinite(n[0] + n[1] + n[2]);
}

bool IsFinite(const SurfelCloud& cloud, std::size_t i)
{
  const Vector3 p = cloud.Position(i), a = cloud.AreaVector(i);
  const Symmetric3 s = cloud.Covariance(i);
  return std::isfinite(p[0] + p[1] + p[2]) && std::isfinite(a[0] + a[1] + a[2]) &&
    (!cloud.IsInSpace() || std::isfinite(cloud.Densities[i])) && HasFiniteNormal(cloud, i) &&
    std::isfinite(s.XX + s.YY + s.ZZ) && std::isfinite(s.XY + s.YZ + s.XZ);
}

/// Surfels of a piece of the cloud, one-sided and two-sided ones apart; without non-finite ones.
struct SortedPiece
{
  std::vector<std::uint32_t> Sides[HierarchyLayout::NumberOfTrees];
  std::size_t Begins[HierarchyLayout::NumberOfTrees]; // of the sides among the leaves
  std::uint64_t Invalid = 0;
};

std::vector<SortedPiece> SortBySide(const SurfelCloud& cloud, const Executor& executor)
{
  constexpr std::size_t size = 65536;
  const std::size_t count = cloud.NumberOfSurfels;
  std::vector<SortedPiece> pieces(CountPieces(count, size));
  ForPieces(count, size, executor, [&](std::size_t p, std::size_t first, std::size_t number) {
    for (std::size_t i = first; i < first + number; ++i)
    {
      const bool finite = IsFinite(cloud, i);
      pieces[p].Invalid += finite ? 0 : 1;
      if (finite)
      {
        pieces[p].Sides[cloud.IsTwoSided(i) ? 1 : 0].push_back(static_cast<std::uint32_t>(i));
      }
    }
  });
  return pieces;
}

/// The position of the first finite surfel; the origin if there is none.
Vector3 FirstPosition(const SurfelCloud& cloud, const std::vector<SortedPiece>& pieces)
{
  for (int tree = 0; tree < HierarchyLayout::NumberOfTrees; ++tree)
  {
    for (const SortedPiece& piece : pieces)
    {
      if (!piece.Sides[tree].empty())
      {
        return cloud.Position(piece.Sides[tree].front());
      }
    }
  }
  return { 0, 0, 0 };
}

/// Relative to a surfel, so that float positions keep their digits.
void FillLeaves(const SurfelCloud& cloud, const std::vector<SortedPiece>& pieces,
  const Executor& executor, Leaf* leaves)
{
  const Vector3 origin = FirstPosition(cloud, pieces);
  executor.For(pieces.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t piece = begin; piece < end; ++piece)
    {
      for (int tree = 0; tree < HierarchyLayout::NumberOfTrees; ++tree)
      {
        Leaf* leaf = leaves + pieces[piece].Begins[tree];
        for (const std::uint32_t surfel : pieces[piece].Sides[tree])
        {
          Store(cloud.Position(surfel) - origin, leaf->Position);
          Store(cloud.AreaVector(surfel), leaf->Normal);
          leaf->Key = surfel;
          ++leaf;
        }
      }
    }
  });
}
}

KdTreeOrder MakeKdTreeOrder(const SurfelCloud& cloud, const Executor& executor)
{
  KdTreeOrder order;
  std::vector<SortedPiece> pieces = SortBySide(cloud, executor);
  std::size_t count = 0, oneSided = 0;
  for (int tree = 0; tree < HierarchyLayout::NumberOfTrees; ++tree)
  {
    oneSided = count; // those before the two-sided ones
    for (SortedPiece& piece : pieces)
    {
      piece.Begins[tree] = count;
      count += piece.Sides[tree].size();
      order.NumberOfInvalidSurfels += tree == 0 ? piece.Invalid : 0;
    }
  }
  order.Layout = HierarchyLayout(oneSided, count - oneSided);
  const std::unique_ptr<Leaf[]> leaves(new Leaf[count]); // the threads that fill it touch it first
  FillLeaves(cloud, pieces, executor, leaves.get());
  pieces.clear();
  SplitInParallel(
    leaves.get(), { { 0, oneSided, false }, { oneSided, count - oneSided, true } }, executor);
  order.Surfels.resize(count);
  executor.For(count, Grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
    {
      order.Surfels[i] = leaves[i].Surfel();
    }
  });
  return order;
}
}
