// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Orientation/Orientation.h"

#include "Filters/Common/LocalCloud.h"
#include "Filters/Orientation/OrientationGraph.h"
#include "Filters/Orientation/ParityUnionFind.h"
#include "Filters/Orientation/SignPropagation.h"

#include "vtkSMPTools.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>

namespace SurfelGeometry
{
namespace
{
void Flip(PlaneFit& fit)
{
  fit.Normal = -1.0 * fit.Normal;
}

/// The points of each component, one component after another.
struct Members
{
  std::vector<int> Ids;
  std::vector<int> Starts; // [components + 1]

  int Count(int c) const { return this->Starts[c + 1] - this->Starts[c]; }
  const int* Begin(int c) const { return this->Ids.data() + this->Starts[c]; }
};

/// Numbers the sets as components, and turns every normal to the sign of its set's root.
Members ApplySigns(ParityUnionFind& signs, std::vector<PlaneFit>& fits, OrientationResult& result)
{
  const int count = static_cast<int>(fits.size());
  std::vector<int> numbers(count, -1);
  result.Components.resize(count);
  Members members;
  members.Starts.push_back(0);
  for (int i = 0; i < count; ++i)
  {
    const auto [root, flip] = signs.Find(i);
    if (numbers[root] < 0)
    {
      numbers[root] = result.NumberOfComponents++;
      members.Starts.push_back(members.Starts.back() + signs.Size(root));
    }
    result.Components[i] = numbers[root];
    if (flip)
    {
      Flip(fits[i]);
    }
  }
  std::vector<int> next(members.Starts.begin(), members.Starts.end() - 1);
  members.Ids.resize(count);
  for (int i = 0; i < count; ++i)
  {
    members.Ids[next[result.Components[i]]++] = i;
  }
  return members;
}

/// Share of the votes of each component that contradict its orientation.
std::vector<double> Conflicts(const NeighborGraph& graph, const EdgeVotes& edges,
  const OrientationResult& result, const ParityUnionFind& signs)
{
  // Votes as integers, in units of 2^-24: their sums do not depend on the order.
  constexpr double unit = 1.0 / (1 << 24);
  using Sums = std::vector<std::atomic<std::int64_t>>;
  Sums against(result.NumberOfComponents), all(result.NumberOfComponents);
  ForPieces(edges.Count(), [&](vtkIdType, vtkIdType first, vtkIdType end) {
    int last = -1; // component of the sums below
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
      const int c = result.Components[edge.A];
      if (c == result.Components[edge.B])
      {
        if (c != last)
        {
          flush(c);
        }
        const bool differ = signs.FindReadOnly(edge.A).second != signs.FindReadOnly(edge.B).second;
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

/// [n] the normals before they are turned; empty if the outside of none was known.
std::vector<Float3> KnownNormals(const std::vector<PlaneFit>& fits)
{
  std::vector<Float3> given;
  if (std::any_of(
        fits.begin(), fits.end(), [](const PlaneFit& fit) { return fit.Given || fit.OnPlate; }))
  {
    given.resize(fits.size());
    std::transform(
      fits.begin(), fits.end(), given.begin(), [](const PlaneFit& fit) { return fit.Normal; });
  }
  return given;
}

/// Turns the normals of a component outward, and marks the points that have an outside.
void ApplyOutside(const Component& component, int sign, const std::vector<Float3>& given,
  std::vector<PlaneFit>& fits, std::vector<unsigned char>& twoSided)
{
  for (int m = 0; m < component.Count; ++m)
  {
    const int i = component.Ids[m];
    PlaneFit& fit = fits[i];
    if (fit.Given)
    {
      fit.Normal = given[i];
      twoSided[i] = 0;
      continue;
    }
    if (sign < 0)
    {
      Flip(fit);
    }
    twoSided[i] = sign != 0 && !fit.Isolated && !fit.Degenerate ? 0 : 1;
  }
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
  const OutsideSettings& settings, const StageProgress& progress, std::vector<PlaneFit>& fits,
  OrientationResult& result)
{
  const int count = cloud.Size();
  const std::vector<Float3> given = KnownNormals(fits);
  const EdgeVotes edges = CollectVotes(cloud, fits, graph);
  ParityUnionFind signs(count);
  if (!PropagateSigns(graph, edges, fits, progress, signs))
  {
    return false;
  }
  const Members members = ApplySigns(signs, fits, result);
  const std::vector<double> conflicts = Conflicts(graph, edges, result, signs);
  result.TwoSided.assign(count, 1);
  for (int c = 0; c < result.NumberOfComponents; ++c)
  {
    const Component component{ members.Begin(c), members.Count(c), conflicts[c] };
    const OutsideSign outside = DecideOutside({ cloud, fits, given }, settings, component);
    result.NumberOfClosedComponents += outside.IsClosed ? 1 : 0;
    ApplyOutside(component, outside.Sign, given, fits, result.TwoSided);
    // There may be as many components as points: no report for each.
    const bool report = c % 1024 == 0 || component.Count > 1024;
    if (report && !progress.Step(0.7 + 0.3 * members.Starts[c + 1] / count))
    {
      return false;
    }
  }
  return true;
}
}
