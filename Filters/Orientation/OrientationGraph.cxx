// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Orientation/OrientationGraph.h"

#include "Filters/Common/ParallelFor.h"
#include "Filters/Common/ParityUnionFind.h"
#include "Filters/Neighbors/LocalCloud.h"
#include "Filters/Orientation/ScannerSides.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

namespace SurfelGeometry
{
namespace
{
/// An edge leads to another sheet if the sine of its angle to either tangent plane, its climb, is
/// larger than this.
constexpr double MaxClimb = 0.8;

/// Sure edges, which join points to patches: smallest vote, largest climb, and largest flatness of
/// both ends, unless nearly all neighbours are on one side of the tangent plane: heights on thin
/// tubes and rims, where the plane is tilted by the same in all directions. Near a crossing some
/// neighbours are on either side. SureBulge: |sum of the heights| / sum of absolute values.
constexpr double SureVote = 0.9;
constexpr double SureClimb = 0.5;
constexpr double SureFlatness = 0.15;
constexpr double SureBulge = 0.9;

/// Longer edges bridge a gap; in spacings of the end with the smaller spacing.
constexpr double LongestEdge = 4.0;

/// Vote in [-1, 1] on the relative sign of two normals: n_b against n_a mirrored at the plane
/// halfway between the points, which is exact on planes and circular arcs of any bend
/// (Koenig and Gumhold 2009, "Consistent propagation of normal orientations in point clouds").
/// 0 if the edge must not count. `sure`: whether it may join patches.
float VoteOf(const LocalCloud& cloud, const PlaneFits& fits, int a, int b, bool& sure)
{
  sure = false;
  const Vector3 d = Load(cloud.Position(b)) - Load(cloud.Position(a));
  const double length = Norm(d);
  if (!(length > 0.0) || length > LongestEdge * std::min(fits[a].Spacing, fits[b].Spacing))
  {
    return 0.0f;
  }
  if (fits[a].OnPlate && fits[b].OnPlate)
  {
    // Both point outward already, from one sheet or from two.
    const double cosine = Dot(fits[a].Normal, fits[b].Normal);
    sure = std::abs(cosine) >= SureVote;
    return static_cast<float>(std::abs(cosine));
  }
  const double climbA = Dot(fits[a].Normal, d) / length;
  const double climbB = Dot(fits[b].Normal, d) / length;
  const double climb = std::max(std::abs(climbA), std::abs(climbB));
  if (climb > MaxClimb)
  {
    return 0.0f;
  }
  const auto vote = static_cast<float>(Dot(fits[a].Normal, fits[b].Normal) - 2.0 * climbA * climbB);
  sure = std::abs(vote) >= SureVote && climb <= SureClimb && fits[a].OnPlate == fits[b].OnPlate;
  return vote;
}

/// Whether the direction of i's normal is reliable.
bool IsSure(const LocalCloud& cloud, const PlaneFits& fits, const NeighborGraph& graph, int i)
{
  if (fits[i].Flatness <= SureFlatness || fits[i].OnPlate)
  {
    return true;
  }
  const Vector3 p = Load(cloud.Position(i));
  const int* row = graph.Row(i);
  double sum = 0.0;
  double absolute = 0.0;
  for (int k = 0; k < GraphDegree && row[k] >= 0; ++k)
  {
    const double height = Dot(fits[i].Normal, Load(cloud.Position(row[k])) - p);
    sum += height;
    absolute += std::abs(height);
  }
  return std::abs(sum) >= SureBulge * absolute;
}

/// Whether i is among the first GraphDegree neighbours. No branch depends on where: it is hard to
/// predict.
bool IsAmong(int i, const int* row)
{
  int found = 0;
  for (int k = 0; k < GraphDegree; ++k)
  {
    found |= row[k] == i ? 1 : 0;
  }
  return found != 0;
}

/// Calls visit(k, j) for the neighbours j of i, of rank k, whose edge is stored at i: each edge is
/// stored once.
template <typename Visit>
void VisitEdges(const NeighborGraph& graph, int i, Visit&& visit)
{
  const int* row = graph.Row(i);
  for (int k = 0; k < GraphDegree && row[k] >= 0; ++k)
  {
    const int j = row[k];
    if (i < j || !IsAmong(i, graph.Row(j)))
    {
      visit(k, j);
    }
  }
}

/// Edges between a prefetch and its use.
constexpr std::uint32_t EdgesAhead = 8;

/// The class of edges that may not join patches.
constexpr unsigned char NotSure = SureEdges::NumberOfClasses;

/// The slots of the sure edges of a piece, the surest first; the order within a class stays.
/// @param classes [GraphDegree * points] of the slots; 0: the surest
/// @param ends of each class
std::vector<std::uint32_t> SortByClass(
  const std::vector<unsigned char>& classes, SureEdges::ClassEnds& ends)
{
  ends.fill(0);
  // Branch-free: which edges are sure is hard to predict.
  std::vector<std::uint32_t> sure(classes.size() + 1);
  std::uint32_t found = 0;
  for (std::uint32_t slot = 0; slot < classes.size(); ++slot)
  {
    sure[found] = slot;
    found += classes[slot] != NotSure ? 1 : 0;
  }
  sure.resize(found);
  for (const std::uint32_t slot : sure)
  {
    ++ends[classes[slot]];
  }
  std::uint32_t sum = 0;
  for (std::uint32_t& end : ends)
  {
    const std::uint32_t size = end;
    end = sum; // first its beginning
    sum += size;
  }
  std::vector<std::uint32_t> sorted(sum);
  for (const std::uint32_t slot : sure)
  {
    sorted[ends[classes[slot]]++] = slot;
  }
  return sorted;
}

/// Sure edges of the points from `first` to `last`, the surest first. Edges that close a loop of
/// surer ones among these points are left out: they are in no spanning forest of the whole graph.
/// @param classes, votes [GraphDegree * points]
SureEdges ThinSureEdges(const NeighborGraph& graph, const std::vector<unsigned char>& classes,
  const float* votes, vtkIdType first, vtkIdType last)
{
  SureEdges sure;
  const std::vector<std::uint32_t> slots = SortByClass(classes, sure.Ends);
  ParityUnionFind signs(static_cast<int>(last - first));
  sure.Edges.reserve(slots.size());
  std::uint32_t next = 0;
  for (std::uint32_t& end : sure.Ends)
  {
    for (; next < end; ++next)
    {
      const std::uint32_t slot = slots[next], i = slot / GraphDegree;
      const int j = graph.Row(static_cast<size_t>(first) + i)[slot % GraphDegree];
      if (j < first || j >= last ||
        signs.Join(static_cast<int>(i), static_cast<int>(j - first), false))
      {
        sure.Edges.push_back({ 2 * i + (votes[slot] < 0.0f ? 1 : 0), j });
      }
    }
    end = static_cast<std::uint32_t>(sure.Edges.size());
  }
  sure.Edges.shrink_to_fit();
  return sure;
}

/// The class of a sure edge.
unsigned char ClassOf(float vote)
{
  const double doubt = (1.0 - std::abs(vote)) / (1.0 - SureVote);
  return static_cast<unsigned char>(std::clamp(
    static_cast<int>(doubt * SureEdges::NumberOfClasses), 0, SureEdges::NumberOfClasses - 1));
}

/// The same where scanners are known: edges between points that surely face theirs come first.
unsigned char ClassAmongSeen(float vote, bool areSeen)
{
  constexpr int half = SureEdges::NumberOfClasses / 2;
  return static_cast<unsigned char>(ClassOf(vote) / 2 + (areSeen ? 0 : half));
}
}

EdgeVotes CollectVotes(const LocalCloud& cloud, const PlaneFits& fits, const NeighborGraph& graph,
  const std::vector<unsigned char>& seen)
{
  const vtkIdType count = cloud.Size();
  EdgeVotes edges;
  edges.Votes.resize(GraphDegree * static_cast<size_t>(count));
  edges.Sure.resize(static_cast<size_t>(PieceCount(count)));
  std::vector<unsigned char> areSure(static_cast<size_t>(count));
  ParallelFor(0, count, 1024, [&](vtkIdType begin, vtkIdType end) {
    for (vtkIdType i = begin; i < end; ++i)
    {
      areSure[i] = IsSure(cloud, fits, graph, static_cast<int>(i)) ? 1 : 0;
    }
  });
  ForPieces(count, [&](vtkIdType p, vtkIdType first, vtkIdType last) {
    float* votes = edges.Votes.data() + GraphDegree * first;
    std::fill_n(votes, GraphDegree * (last - first), 0.0f);
    std::vector<unsigned char> classes(static_cast<size_t>(GraphDegree * (last - first)), NotSure);
    for (vtkIdType i = first; i < last; ++i)
    {
      VisitEdges(graph, static_cast<int>(i), [&](int k, int j) {
        bool sure;
        const float vote = VoteOf(cloud, fits, static_cast<int>(i), j, sure);
        const vtkIdType slot = GraphDegree * (i - first) + k;
        const bool areSeen = !seen.empty() && seen[i] && seen[j];
        votes[slot] = areSeen && vote < 0.0f ? 0.0f : vote;
        if (sure && areSure[i] && areSure[j] && votes[slot] != 0.0f)
        {
          classes[slot] = seen.empty() ? ClassOf(vote) : ClassAmongSeen(vote, areSeen);
        }
      });
    }
    edges.Sure[p] = ThinSureEdges(graph, classes, votes, first, last);
  });
  return edges;
}

void JoinSureEdges(EdgeVotes& edges, ParityUnionFind& signs, std::vector<int>& evidence)
{
  const std::vector<SureEdges> pieces = std::move(edges.Sure);
  for (int sureness = 0; sureness < SureEdges::NumberOfClasses; ++sureness)
  {
    for (size_t p = 0; p < pieces.size(); ++p)
    {
      const SureEdges& sure = pieces[p];
      const auto first = static_cast<int>(PieceSize * p);
      const auto end = sure.Ends[sureness];
      for (auto e = sureness > 0 ? sure.Ends[sureness - 1] : 0; e < end; ++e)
      {
        // The edges of a class are anywhere in the piece.
        const SureEdge& next = sure.Edges[std::min(e + EdgesAhead, end - 1)];
        signs.Prefetch(first + next.From());
        signs.Prefetch(next.To);
        const SureEdge& edge = sure.Edges[e];
        if (evidence.empty())
        {
          signs.Join(first + edge.From(), edge.To, edge.Differ());
        }
        else
        {
          JoinSeen(first + edge.From(), edge.To, edge.Differ(), signs, evidence);
        }
      }
    }
  }
}
}
