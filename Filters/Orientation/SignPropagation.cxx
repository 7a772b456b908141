// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Orientation/SignPropagation.h"

#include "Filters/Common/ParityUnionFind.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>

namespace SurfelGeometry
{
namespace
{
/// Patches are joined if their votes agree this much: |sum| / sum of absolute values.
constexpr double Agreement = 0.8;

/// Larger patches need more than a chance contact: the sum of votes must reach this times the
/// square root of the size of the smaller patch, or MaxEvidence if that is less.
constexpr double EvidencePerRoot = 0.5;
constexpr double MaxEvidence = 8.0;

/// A patch below this size is joined to its surest neighbour if the votes agree at least this much.
constexpr int SmallPatch = 30;
constexpr double SmallAgreement = 0.3;

/// The votes between two sets.
struct Pair
{
  std::uint64_t Key; // roots of the sets, the smaller one in the high half
  double Sum, Absolute;

  int First() const { return static_cast<int>(this->Key >> 32); }
  int Second() const { return static_cast<int>(this->Key & 0xffffffffu); }
};

/// The edges from one set to another.
std::vector<Edge> EdgesBetweenSets(const PatchVotes& votes, ParityUnionFind& signs)
{
  signs.Flatten();
  const vtkIdType count = votes.Edges.Count();
  if (count > 0 && signs.Size(signs.FindReadOnly(0).first) == count)
  {
    return {}; // one set, as of most closed surfaces
  }
  std::vector<std::vector<Edge>> found(PieceCount(count));
  ForPieces(count, [&](vtkIdType p, vtkIdType first, vtkIdType last) {
    for (vtkIdType i = first; i < last; ++i)
    {
      const int root = signs.FindReadOnly(static_cast<int>(i)).first;
      const int* row = votes.Graph.Row(static_cast<size_t>(i));
      for (int k = 0; k < GraphDegree && row[k] >= 0; ++k)
      {
        // Most neighbours are in the same set.
        const float vote = votes.Edges.Votes[GraphDegree * i + k];
        if (signs.FindReadOnly(row[k]).first != root && vote != 0.0f)
        {
          found[p].push_back({ static_cast<int>(i), row[k], vote });
        }
      }
    }
  });
  return Concatenated(found);
}

Pair VoteOf(const Edge& edge, ParityUnionFind& signs)
{
  const auto [rootA, flipA] = signs.Find(edge.A);
  const auto [rootB, flipB] = signs.Find(edge.B);
  const double vote = flipA != flipB ? -edge.Vote : edge.Vote;
  const std::uint64_t key = static_cast<std::uint64_t>(std::min(rootA, rootB)) << 32 |
    static_cast<std::uint64_t>(std::max(rootA, rootB));
  return { key, vote, std::abs(vote) };
}

/// Sorts by key; those with the same stay in their order.
void SortByKey(Pair* begin, Pair* end)
{
  constexpr std::ptrdiff_t few = 16;
  if (end - begin > few)
  {
    std::stable_sort(begin, end, [](const Pair& a, const Pair& b) { return a.Key < b.Key; });
    return;
  }
  for (Pair* next = begin; next < end; ++next)
  {
    const Pair pair = *next;
    Pair* to = next;
    for (; to > begin && to[-1].Key > pair.Key; --to)
    {
      *to = to[-1];
    }
    *to = pair;
  }
}

/// Removes the edges within a set from `edges`. Returns the votes of the others, sorted by key: by
/// counting those of each first set, most of which have a few.
/// @param points number of all
std::vector<Pair> SortedVotes(size_t points, std::vector<Edge>& edges, ParityUnionFind& signs)
{
  std::vector<std::uint32_t> ends(points + 1);
  size_t kept = 0;
  for (const Edge& edge : edges)
  {
    const Pair vote = VoteOf(edge, signs);
    const bool isBetween = vote.First() != vote.Second();
    ends[static_cast<size_t>(vote.First()) + 1] += isBetween ? 1 : 0;
    edges[kept] = edge;
    kept += isBetween ? 1 : 0;
  }
  edges.resize(kept);
  std::partial_sum(ends.begin(), ends.end(), ends.begin()); // their beginnings first
  std::vector<Pair> votes(kept);
  for (const Edge& edge : edges)
  {
    const Pair vote = VoteOf(edge, signs);
    votes[ends[static_cast<size_t>(vote.First())]++] = vote;
  }
  std::uint32_t begin = 0;
  for (const std::uint32_t end : ends)
  {
    SortByKey(votes.data() + begin, votes.data() + end);
    begin = end;
  }
  return votes;
}

/// Removes the edges within a set from `edges`. Returns the votes of the others, summed for each
/// pair of sets.
std::vector<Pair> VotesBetweenSets(size_t points, std::vector<Edge>& edges, ParityUnionFind& signs)
{
  std::vector<Pair> votes = SortedVotes(points, edges, signs);
  size_t pairs = 0;
  for (size_t v = 0; v < votes.size(); ++v)
  {
    if (pairs > 0 && votes[pairs - 1].Key == votes[v].Key)
    {
      votes[pairs - 1].Sum += votes[v].Sum;
      votes[pairs - 1].Absolute += votes[v].Absolute;
    }
    else
    {
      votes[pairs++] = votes[v];
    }
  }
  votes.resize(pairs);
  return votes;
}

/// Joins the sets of a and b, unless that contradicts their outsides. Returns whether it did.
bool JoinOutsides(
  int a, int b, bool differ, ParityUnionFind& signs, std::vector<signed char>& sides)
{
  const auto [rootA, flipA] = signs.Find(a);
  const auto [rootB, flipB] = signs.Find(b);
  const signed char sideA = sides[rootA];
  const int sign = (flipA != flipB) != differ ? -1 : 1; // of root a relative to root b
  if (rootA == rootB || sideA * sides[rootB] * sign < 0)
  {
    return false;
  }
  const auto side = static_cast<signed char>(sideA != 0 ? sideA : sign * sides[rootB]);
  signs.Join(a, b, differ);
  sides[rootA] = side;
  sides[rootB] = static_cast<signed char>(sign * side);
  return true;
}

/// Whether the votes join two patches. `isLast`: in the last rounds, which join small patches.
bool IsTrusted(const Pair& pair, const ParityUnionFind& signs, bool isLast)
{
  const int size = std::min(signs.Size(pair.First()), signs.Size(pair.Second()));
  const double evidence = std::abs(pair.Sum);
  if (isLast)
  {
    return size < SmallPatch && evidence >= SmallAgreement * pair.Absolute;
  }
  return evidence >= Agreement * pair.Absolute &&
    evidence >= std::min(EvidencePerRoot * std::sqrt(double(size)), MaxEvidence);
}

/// One round of Boruvka's algorithm: joins each set with its surest trusted partner.
/// Returns whether any sets were joined.
bool JoinSets(
  std::vector<Edge>& edges, bool isLast, ParityUnionFind& signs, std::vector<signed char>& sides)
{
  std::vector<Pair> pairs = VotesBetweenSets(sides.size(), edges, signs);
  pairs.erase(std::remove_if(pairs.begin(), pairs.end(),
                [&](const Pair& pair) { return !IsTrusted(pair, signs, isLast); }),
    pairs.end());
  std::sort(pairs.begin(), pairs.end(), [](const Pair& a, const Pair& b) {
    const double x = std::abs(a.Sum);
    const double y = std::abs(b.Sum);
    return x != y ? x > y : a.Key < b.Key;
  });
  std::vector<char> joined(sides.size(), 0);
  bool any = false;
  for (const Pair& pair : pairs)
  {
    const int a = pair.First();
    const int b = pair.Second();
    if ((!joined[a] || !joined[b]) && JoinOutsides(a, b, pair.Sum < 0.0, signs, sides))
    {
      joined[a] = joined[b] = 1;
      any = true;
    }
  }
  return any;
}
}

bool JoinPatches(const PatchVotes& votes, const StageProgress& progress, ParityUnionFind& signs,
  std::vector<signed char>& sides)
{
  std::vector<Edge> open = EdgesBetweenSets(votes, signs);
  if (open.empty())
  {
    return true;
  }
  // Plates are joined with other things only in the last rounds.
  const auto mixed = std::stable_partition(open.begin(), open.end(),
    [&](const Edge& edge) { return votes.Fits[edge.A].OnPlate == votes.Fits[edge.B].OnPlate; });
  const std::vector<Edge> later(mixed, open.end());
  open.erase(mixed, open.end());
  for (const bool isLast : { false, true })
  {
    if (isLast)
    {
      open.insert(open.end(), later.begin(), later.end());
    }
    while (JoinSets(open, isLast, signs, sides))
    {
      if (!progress.Step(0.5))
      {
        return false;
      }
    }
  }
  return true;
}
}
