// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Orientation/Orientation.h"

#include "Filters/Common/LocalCloud.h"
#include "Filters/Orientation/OrientationGraph.h"
#include "Filters/Orientation/ParityUnionFind.h"
#include "Filters/Orientation/WindingNumber.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <numeric>

namespace SurfelGeometry
{
namespace
{
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

/// Sum of votes between two sets.
struct Pair
{
  std::uint64_t Key; // smaller root in the high half
  double Sum, Absolute;

  int First() const { return static_cast<int>(this->Key >> 32); }
  int Second() const { return static_cast<int>(this->Key & 0xffffffffu); }
};

/// Edges that lead from one set to another.
std::vector<Edge> EdgesBetweenSets(
  const NeighborGraph& graph, const EdgeVotes& edges, ParityUnionFind& signs)
{
  signs.Flatten();
  const vtkIdType count = edges.Count();
  std::vector<std::vector<Edge>> found(PieceCount(count));
  ForPieces(count, [&](vtkIdType p, vtkIdType first, vtkIdType last) {
    VisitVotes(graph, edges, first, last, [&](const Edge& edge) {
      if (signs.Look(edge.A).first != signs.Look(edge.B).first)
      {
        found[p].push_back(edge);
      }
    });
  });
  return Concatenated(found);
}

/// Keeps the edges that lead from one set to another, as votes between the sets' roots.
std::vector<Pair> VotesBetweenSets(std::vector<Edge>& edges, ParityUnionFind& signs)
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

bool IsTrusted(const Pair& pair, const ParityUnionFind& signs, bool last)
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
bool JoinSets(std::vector<Edge>& edges, ParityUnionFind& signs, int count, bool last)
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

void Flip(PlaneFit& fit)
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
Members ApplySigns(ParityUnionFind& signs, std::vector<PlaneFit>& fits, Sidedness& sides)
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
std::vector<double> Conflicts(const NeighborGraph& graph, const EdgeVotes& edges,
  const Sidedness& sides, const ParityUnionFind& signs)
{
  // Votes as integers of 2^-24: their sums are the same in any order.
  constexpr double unit = 1.0 / (1 << 24);
  using Sums = std::vector<std::atomic<std::int64_t>>;
  Sums against(sides.NumberOfComponents), all(sides.NumberOfComponents);
  ForPieces(edges.Count(), [&](vtkIdType, vtkIdType first, vtkIdType end) {
    int last = -1; // component of the sums here
    std::int64_t lastAgainst = 0, lastAll = 0;
    const auto flush = [&](int next) {
      if (last >= 0)
      {
        against[last].fetch_add(lastAgainst, std::memory_order_relaxed);
        all[last].fetch_add(lastAll, std::memory_order_relaxed);
      }
      last = next;
      lastAgainst = lastAll = 0;
    };
    VisitVotes(graph, edges, first, end, [&](const Edge& edge) {
      const int c = sides.Components[edge.A];
      if (c == sides.Components[edge.B])
      {
        if (c != last)
        {
          flush(c);
        }
        const bool differ = signs.Look(edge.A).second != signs.Look(edge.B).second;
        const auto vote = static_cast<std::int64_t>(std::abs(edge.Vote) / unit);
        lastAll += vote;
        lastAgainst += differ != (edge.Vote < 0.0f) ? vote : 0;
      }
    });
    flush(-1);
  });
  std::vector<double> shares(all.size());
  for (size_t c = 0; c < all.size(); ++c)
  {
    const double sum = static_cast<double>(all[c]);
    shares[c] = sum > 0.0 ? static_cast<double>(against[c]) / sum : 1.0;
  }
  return shares;
}

/// +1: closed, normals outward. -1: closed, inward. 0: open or doubtful.
int ClosedSign(
  const LocalCloud& cloud, const std::vector<PlaneFit>& fits, const int* members, int count)
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
int FacingSign(const LocalCloud& cloud, const std::vector<PlaneFit>& fits, const int* members,
  int count, const OrientationSettings& settings)
{
  double toward = 0.0;
  double away = 0.0;
  for (int m = 0; m < count; ++m)
  {
    const PlaneFit& fit = fits[members[m]];
    const Vector3 direction =
      Normalized(settings.Viewpoint - Load(cloud.Position(members[m])), { 0.0, 0.0, 0.0 });
    const double facing = fit.Spacing * fit.Spacing * Dot(fit.Normal, direction);
    (facing > 0.0 ? toward : away) += std::abs(facing);
  }
  const double needed = settings.FacingAgreement * (toward + away);
  return toward > needed ? 1 : (away > needed ? -1 : 0);
}

/// [n] the normals as they are before they are turned; empty if none was given.
std::vector<Float3> GivenNormals(const std::vector<PlaneFit>& fits)
{
  std::vector<Float3> given;
  if (std::any_of(fits.begin(), fits.end(), [](const PlaneFit& fit) { return fit.Given; }))
  {
    given.resize(fits.size());
    std::transform(
      fits.begin(), fits.end(), given.begin(), [](const PlaneFit& fit) { return fit.Normal; });
  }
  return given;
}

/// Sign by which given normals, where the component has any, agree or disagree with it.
int GivenSign(const std::vector<PlaneFit>& fits, const std::vector<Float3>& given,
  const int* members, int count)
{
  if (given.empty())
  {
    return 0;
  }
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

void FaceViewpoint(const LocalCloud& cloud, const Vector3& viewpoint, std::vector<PlaneFit>& fits)
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
  const OrientationSettings& settings, const StageProgress& monitor, std::vector<PlaneFit>& fits,
  Sidedness& sides)
{
  const int count = cloud.Size();
  const EdgeVotes edges = CollectVotes(cloud, fits, graph);
  ParityUnionFind signs(count);
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

  const std::vector<Float3> given = GivenNormals(fits);
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
      PlaneFit& fit = fits[ids[m]];
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
