// SPDX-License-Identifier: BSD-3-Clause
#include "SurfelOrientation.h"

#include "LocalCloud.h"
#include "SurfelSigns.h"
#include "SurfelWinding.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>

namespace SurfelGeometry
{
namespace
{
/// An edge that climbs more than this (sine of its angle to either tangent plane) leads to
/// another sheet.
constexpr double LargestClimb = 0.8;

/// For the patches: smallest vote, largest climb and largest flatness of both ends.
constexpr double SureVote = 0.9;
constexpr double SureClimb = 0.5;
constexpr double SureFlatness = 0.15;

/// Edges longer than this many spacings of the closer-spaced end bridge a gap.
constexpr double LongestEdge = 4.0;

/// Patches are joined if the votes between them agree this much: |sum| / sum of absolute values.
constexpr double Agreement = 0.8;

/// Larger patches need more than a chance contact: sum of votes, per square root of the size of
/// the smaller patch, and at most LargestEvidence.
constexpr double EvidencePerRoot = 0.5;
constexpr double LargestEvidence = 8.0;

/// A patch below this size is joined to its surest neighbour if the votes agree only this much.
constexpr int SmallPatch = 30;
constexpr double SmallAgreement = 0.3;

/// Share of the edges within a component that may contradict its orientation.
constexpr double LargestConflict = 0.03;

/// A component is closed if the winding number at its surfels is at least ClosedMean on average
/// and beyond ClosedLeast at ClosedShare of the samples. On a sphere of which a share f is missing
/// the mean is (1 - f) / 2: up to a fifth may be missing; half a sphere, 0.32, is open.
constexpr double ClosedMean = 0.4;
constexpr double ClosedLeast = 0.15;
constexpr double ClosedShare = 0.85;
constexpr int WindingSamples = 192;
constexpr int SmallestClosed = 30; // points; fewer tell nothing

struct Edge
{
  int A, B;
  float Vote;
};

/// Sum of votes between two sets.
struct Pair
{
  std::uint64_t Key; // smaller root in the high half
  double Sum, Absolute;

  int First() const { return static_cast<int>(this->Key >> 32); }
  int Second() const { return static_cast<int>(this->Key & 0xffffffffu); }
};

Vector3 Between(const LocalCloud& cloud, int a, int b)
{
  return Normalized(Load(cloud.Position(b)) - Load(cloud.Position(a)), { 0.0, 0.0, 0.0 });
}

/// Vote in [-1, 1] on the relative sign of two normals: n_b against n_a mirrored at the plane
/// halfway between the points, which is exact on planes and circular arcs of any bend
/// (Koenig and Gumhold 2009, "Consistent propagation of normal orientations in point clouds").
/// 0 where the edge must not count.
float VoteOf(const LocalCloud& cloud, const std::vector<SurfelFit>& fits, int a, int b)
{
  const Vector3 d = Load(cloud.Position(b)) - Load(cloud.Position(a));
  const double length = Length(d);
  if (!(length > 0.0) || length > LongestEdge * std::min(fits[a].Spacing, fits[b].Spacing))
  {
    return 0.0f;
  }
  const double climbA = Dot(fits[a].Normal, d) / length;
  const double climbB = Dot(fits[b].Normal, d) / length;
  if (std::max(std::abs(climbA), std::abs(climbB)) > LargestClimb)
  {
    return 0.0f;
  }
  return static_cast<float>(Dot(fits[a].Normal, fits[b].Normal) - 2.0 * climbA * climbB);
}

bool IsSure(const LocalCloud& cloud, const std::vector<SurfelFit>& fits, const Edge& edge)
{
  const Vector3 d = Between(cloud, edge.A, edge.B);
  return std::abs(edge.Vote) >= SureVote && std::abs(Dot(fits[edge.A].Normal, d)) <= SureClimb &&
    std::abs(Dot(fits[edge.B].Normal, d)) <= SureClimb &&
    std::max(fits[edge.A].Flatness, fits[edge.B].Flatness) <= SureFlatness;
}

/// The edges of the graph: slot GraphDegree i + k leads from i to its neighbour of rank k.
struct EdgeVotes
{
  static constexpr unsigned char NotSure = 255;

  std::vector<float> Votes;           ///< 0: no edge, or the other end reports it
  std::vector<unsigned char> Classes; ///< of sure edges, the surest 0; else NotSure
};

/// Calls visit(k, j) for each neighbour j, of rank k, of i whose edge is i's to report: each edge
/// once.
template <typename Visit>
void VisitEdges(const NeighborGraph& graph, int i, Visit&& visit)
{
  const int* mine = graph.Row(i);
  for (int k = 0; k < GraphDegree && mine[k] >= 0; ++k)
  {
    const int j = mine[k];
    const int* theirs = graph.Row(j);
    const bool mutual = std::find(theirs, theirs + GraphDegree, i) != theirs + GraphDegree;
    if (!mutual || i < j)
    {
      visit(k, j);
    }
  }
}

EdgeVotes CollectVotes(
  const LocalCloud& cloud, const std::vector<SurfelFit>& fits, const NeighborGraph& graph)
{
  const vtkIdType count = cloud.Size();
  EdgeVotes edges;
  edges.Votes.resize(GraphDegree * static_cast<size_t>(count));
  edges.Classes.resize(edges.Votes.size());
  vtkSMPTools::For(0, count, 1024, [&](vtkIdType begin, vtkIdType end) {
    std::fill(
      edges.Votes.begin() + GraphDegree * begin, edges.Votes.begin() + GraphDegree * end, 0.0f);
    std::fill(edges.Classes.begin() + GraphDegree * begin,
      edges.Classes.begin() + GraphDegree * end, EdgeVotes::NotSure);
    for (vtkIdType i = begin; i < end; ++i)
    {
      VisitEdges(graph, static_cast<int>(i), [&](int k, int j) {
        const Edge edge{ static_cast<int>(i), j, VoteOf(cloud, fits, static_cast<int>(i), j) };
        edges.Votes[GraphDegree * i + k] = edge.Vote;
        if (IsSure(cloud, fits, edge))
        {
          const double doubt = (1.0 - std::abs(edge.Vote)) / (1.0 - SureVote);
          edges.Classes[GraphDegree * i + k] = static_cast<unsigned char>(
            std::clamp(static_cast<int>(doubt * EdgeVotes::NotSure), 0, EdgeVotes::NotSure - 1));
        }
      });
    }
  });
  return edges;
}

/// Joins sure edges, the surest first: Kruskal's algorithm with the votes in classes.
void JoinSureEdges(const NeighborGraph& graph, const EdgeVotes& edges, SurfelSigns& signs)
{
  std::array<size_t, EdgeVotes::NotSure + 1> ends{};
  for (const unsigned char c : edges.Classes)
  {
    ++ends[c];
  }
  ends[EdgeVotes::NotSure] = 0;
  std::partial_sum(ends.begin(), ends.end(), ends.begin());
  std::vector<std::uint64_t> order(ends.back());
  for (size_t slot = edges.Classes.size(); slot-- > 0;)
  {
    if (edges.Classes[slot] != EdgeVotes::NotSure)
    {
      order[--ends[edges.Classes[slot]]] = slot;
    }
  }
  for (const std::uint64_t slot : order)
  {
    const size_t i = slot / GraphDegree;
    signs.Join(static_cast<int>(i), graph.Row(i)[slot % GraphDegree], edges.Votes[slot] < 0.0f);
  }
}

/// Calls visit(edge) for all edges that have a vote, ordered by their points.
template <typename Visit>
void VisitVotes(const NeighborGraph& graph, const EdgeVotes& edges, Visit&& visit)
{
  const size_t count = edges.Votes.size() / GraphDegree;
  for (size_t i = 0; i < count; ++i)
  {
    for (int k = 0; k < GraphDegree; ++k)
    {
      const float vote = edges.Votes[GraphDegree * i + k];
      if (vote != 0.0f)
      {
        visit(Edge{ static_cast<int>(i), graph.Row(i)[k], vote });
      }
    }
  }
}

/// Edges that lead from one set to another.
std::vector<Edge> EdgesBetweenSets(
  const NeighborGraph& graph, const EdgeVotes& edges, SurfelSigns& signs)
{
  std::vector<Edge> between;
  VisitVotes(graph, edges, [&](const Edge& edge) {
    if (signs.Find(edge.A).first != signs.Find(edge.B).first)
    {
      between.push_back(edge);
    }
  });
  return between;
}

/// Keeps the edges that lead from one set to another, as votes between the sets' roots.
std::vector<Pair> VotesBetweenSets(std::vector<Edge>& edges, SurfelSigns& signs)
{
  std::vector<Pair> votes;
  size_t kept = 0;
  for (const Edge& edge : edges)
  {
    const auto [rootA, flipA] = signs.Find(edge.A);
    const auto [rootB, flipB] = signs.Find(edge.B);
    if (rootA == rootB)
    {
      continue;
    }
    const double vote = flipA != flipB ? -edge.Vote : edge.Vote;
    const std::uint64_t key = static_cast<std::uint64_t>(std::min(rootA, rootB)) << 32 |
      static_cast<std::uint64_t>(std::max(rootA, rootB));
    votes.push_back({ key, vote, std::abs(vote) });
    edges[kept++] = edge;
  }
  edges.resize(kept);
  std::stable_sort(
    votes.begin(), votes.end(), [](const Pair& a, const Pair& b) { return a.Key < b.Key; });
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

bool IsTrusted(const Pair& pair, const SurfelSigns& signs, bool last)
{
  const int size = std::min(signs.Size(pair.First()), signs.Size(pair.Second()));
  const double evidence = std::abs(pair.Sum);
  if (last)
  {
    return size < SmallPatch && evidence >= SmallAgreement * pair.Absolute;
  }
  return evidence >= Agreement * pair.Absolute &&
    evidence >= std::min(EvidencePerRoot * std::sqrt(double(size)), LargestEvidence);
}

/// One round: of the trusted pairs, each set's surest one is joined (Boruvka's algorithm).
/// Returns whether anything was joined.
bool JoinSets(std::vector<Edge>& edges, SurfelSigns& signs, int count, bool last)
{
  std::vector<Pair> pairs = VotesBetweenSets(edges, signs);
  pairs.erase(std::remove_if(pairs.begin(), pairs.end(),
                [&](const Pair& pair) { return !IsTrusted(pair, signs, last); }),
    pairs.end());
  std::sort(pairs.begin(), pairs.end(), [](const Pair& a, const Pair& b) {
    const double x = std::abs(a.Sum);
    const double y = std::abs(b.Sum);
    return x != y ? x > y : a.Key < b.Key;
  });
  std::vector<char> served(count, 0);
  for (const Pair& pair : pairs)
  {
    const int a = pair.First();
    const int b = pair.Second();
    if (!served[a] || !served[b])
    {
      served[a] = served[b] = 1;
      signs.Join(a, b, pair.Sum < 0.0);
    }
  }
  return !pairs.empty();
}

void Flip(SurfelFit& fit)
{
  fit.Normal = -1.0 * fit.Normal;
}

/// Members of each component, one after the other.
struct Members
{
  std::vector<int> Ids;
  std::vector<int> Starts; // [components + 1]

  int Count(int c) const { return this->Starts[c + 1] - this->Starts[c]; }
  const int* Begin(int c) const { return this->Ids.data() + this->Starts[c]; }
};

/// Numbers the sets and turns every normal to the sign of its set's root.
Members ApplySigns(SurfelSigns& signs, std::vector<SurfelFit>& fits, Sidedness& sides)
{
  const int count = static_cast<int>(fits.size());
  std::vector<int> numbers(count, -1);
  sides.Components.resize(count);
  Members members;
  members.Starts.push_back(0);
  for (int i = 0; i < count; ++i)
  {
    const auto [root, flip] = signs.Find(i);
    if (numbers[root] < 0)
    {
      numbers[root] = sides.NumberOfComponents++;
      members.Starts.push_back(members.Starts.back() + signs.Size(root));
    }
    sides.Components[i] = numbers[root];
    if (flip)
    {
      Flip(fits[i]);
    }
  }
  std::vector<int> next(members.Starts.begin(), members.Starts.end() - 1);
  members.Ids.resize(count);
  for (int i = 0; i < count; ++i)
  {
    members.Ids[next[sides.Components[i]]++] = i;
  }
  return members;
}

/// Share of each component's votes that contradict its orientation.
std::vector<double> Conflicts(
  const NeighborGraph& graph, const EdgeVotes& edges, const Sidedness& sides, SurfelSigns& signs)
{
  std::vector<double> against(sides.NumberOfComponents, 0.0);
  std::vector<double> all(sides.NumberOfComponents, 0.0);
  VisitVotes(graph, edges, [&](const Edge& edge) {
    const int c = sides.Components[edge.A];
    if (c == sides.Components[edge.B])
    {
      const bool differ = signs.Find(edge.A).second != signs.Find(edge.B).second;
      all[c] += std::abs(edge.Vote);
      against[c] += differ != (edge.Vote < 0.0f) ? std::abs(edge.Vote) : 0.0;
    }
  });
  for (size_t c = 0; c < all.size(); ++c)
  {
    against[c] = all[c] > 0.0 ? against[c] / all[c] : 1.0;
  }
  return against;
}

/// +1: closed, normals outward. -1: closed, inward. 0: open or doubtful.
int ClosedSign(
  const LocalCloud& cloud, const std::vector<SurfelFit>& fits, const int* members, int count)
{
  if (count < SmallestClosed)
  {
    return 0;
  }
  const int samples = std::min(count, WindingSamples);
  std::vector<double> windings(samples);
  const WindingNumbers numbers(cloud, fits, members, count);
  vtkSMPTools::For(0, samples, [&](vtkIdType begin, vtkIdType end) {
    for (vtkIdType s = begin; s < end; ++s)
    {
      const int at = members[static_cast<size_t>(s) * count / samples];
      windings[s] = numbers.At(at);
    }
  });
  const double mean = std::accumulate(windings.begin(), windings.end(), 0.0) / samples;
  const double sign = mean < 0.0 ? -1.0 : 1.0;
  const auto agreeing = std::count_if(
    windings.begin(), windings.end(), [sign](double w) { return sign * w > ClosedLeast; });
  const bool closed = std::abs(mean) >= ClosedMean && agreeing >= ClosedShare * samples;
  return closed ? static_cast<int>(sign) : 0;
}

/// +1 or -1 if that much of the area faces the viewpoint, or faces away from it; else 0.
int FacingSign(const LocalCloud& cloud, const std::vector<SurfelFit>& fits, const int* members,
  int count, const OrientationSettings& settings)
{
  double toward = 0.0;
  double away = 0.0;
  for (int m = 0; m < count; ++m)
  {
    const SurfelFit& fit = fits[members[m]];
    const Vector3 direction =
      Normalized(settings.Viewpoint - Load(cloud.Position(members[m])), { 0.0, 0.0, 0.0 });
    const double facing = fit.Spacing * fit.Spacing * Dot(fit.Normal, direction);
    (facing > 0.0 ? toward : away) += std::abs(facing);
  }
  const double needed = settings.FacingAgreement * (toward + away);
  return toward > needed ? 1 : (away > needed ? -1 : 0);
}

/// Sign by which given normals, where the component has any, agree or disagree with it.
int GivenSign(const std::vector<SurfelFit>& fits, const std::vector<Vector3>& given,
  const int* members, int count)
{
  double sum = 0.0;
  double absolute = 0.0;
  for (int m = 0; m < count; ++m)
  {
    if (fits[members[m]].Given)
    {
      const double agreement = Dot(fits[members[m]].Normal, given[members[m]]);
      sum += agreement;
      absolute += std::abs(agreement);
    }
  }
  return std::abs(sum) > Agreement * absolute ? (sum > 0.0 ? 1 : -1) : 0;
}
}

void FaceViewpoint(const LocalCloud& cloud, const Vector3& viewpoint, std::vector<SurfelFit>& fits)
{
  vtkSMPTools::For(0, cloud.Size(), [&](vtkIdType begin, vtkIdType end) {
    for (vtkIdType i = begin; i < end; ++i)
    {
      if (Dot(fits[i].Normal, viewpoint - Load(cloud.Position(static_cast<int>(i)))) < 0.0)
      {
        Flip(fits[i]);
      }
    }
  });
}

bool OrientConsistently(const LocalCloud& cloud, const NeighborGraph& graph,
  const OrientationSettings& settings, const SurfelMonitor& monitor, std::vector<SurfelFit>& fits,
  Sidedness& sides)
{
  const int count = cloud.Size();
  const EdgeVotes edges = CollectVotes(cloud, fits, graph);
  SurfelSigns signs(count);
  JoinSureEdges(graph, edges, signs);
  if (!monitor.Step(0.4))
  {
    return false;
  }
  std::vector<Edge> open = EdgesBetweenSets(graph, edges, signs);
  for (const bool last : { false, true })
  {
    while (JoinSets(open, signs, count, last))
    {
      if (!monitor.Step(0.6))
      {
        return false;
      }
    }
  }

  std::vector<Vector3> given(count);
  std::transform(
    fits.begin(), fits.end(), given.begin(), [](const SurfelFit& fit) { return fit.Normal; });
  const Members members = ApplySigns(signs, fits, sides);
  const std::vector<double> conflicts = Conflicts(graph, edges, sides, signs);
  sides.TwoSided.assign(count, 1);
  for (int c = 0; c < sides.NumberOfComponents; ++c)
  {
    const int* ids = members.Begin(c);
    const int size = members.Count(c);
    int sign = GivenSign(fits, given, ids, size);
    if (sign == 0 && conflicts[c] <= LargestConflict)
    {
      sign = ClosedSign(cloud, fits, ids, size);
      sides.NumberOfClosedComponents += sign != 0 ? 1 : 0;
      if (sign == 0 && settings.UseViewpoint)
      {
        sign = FacingSign(cloud, fits, ids, size, settings);
      }
    }
    for (int m = 0; m < size; ++m)
    {
      SurfelFit& fit = fits[ids[m]];
      if (fit.Given)
      {
        fit.Normal = given[ids[m]];
        sides.TwoSided[ids[m]] = 0;
        continue;
      }
      if (sign < 0)
      {
        Flip(fit);
      }
      sides.TwoSided[ids[m]] = sign != 0 && !fit.Isolated && !fit.Degenerate ? 0 : 1;
    }
    // Components may be as many as points: not a report for each.
    const bool report = c % 1024 == 0 || size > 1024;
    if (report && !monitor.Step(0.7 + 0.3 * members.Starts[c + 1] / count))
    {
      return false;
    }
  }
  return true;
}
}
