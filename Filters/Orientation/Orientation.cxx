// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Orientation/Orientation.h"

#include "Filters/Common/LocalCloud.h"
#include "Filters/Orientation/ConsistentSets.h"
#include "Filters/Orientation/OrientationGraph.h"
#include "Filters/Orientation/ParityUnionFind.h"
#include "Filters/Orientation/SignPropagation.h"

#include "vtkSMPTools.h"

namespace SurfelGeometry
{
namespace
{
/// Smaller patches are decided with others; points.
constexpr int MinPatch = 30;

/// One execution.
class Orienter
{
public:
  Orienter(const LocalCloud& cloud, const NeighborGraph& graph, const OutsideSettings& settings,
    std::vector<PlaneFit>& fits)
    : Cloud(cloud)
    , Graph(graph)
    , Settings(settings)
    , Fits(fits)
    , Edges(CollectVotes(cloud, fits, graph))
    , Signs(cloud.Size())
    , Sides(static_cast<size_t>(cloud.Size()), 0)
  {
  }

  /// Returns false if stopped.
  bool Run(const StageProgress& progress, OrientationResult& result)
  {
    JoinSureEdges(this->Graph, this->Edges, this->Signs);
    if (!progress.Step(0.3) || !this->Decide(true, progress.Part(0.3, 0.5)) ||
      !JoinPatches({ this->Graph, this->Edges, this->Fits, this->Sides }, progress.Part(0.5, 0.7),
        this->Signs) ||
      !this->Decide(false, progress.Part(0.7, 1.0)))
    {
      return false;
    }
    this->Apply(result);
    return true;
  }

private:
  /// Decides the outsides of sets that have none yet; `patches`: only those that need no help.
  bool Decide(bool patches, const StageProgress& progress)
  {
    this->Sets = CollectSets(this->Fits, this->Signs);
    const std::vector<double> conflicts =
      Conflicts(this->Graph, this->Edges, this->Sets, this->Signs);
    OutsideSettings settings = this->Settings;
    settings.UseViewpoint = settings.UseViewpoint && !patches;
    const OutsideInput input{ this->Cloud, this->Fits, this->Sets.Normals };
    for (int c = 0; c < this->Sets.Count(); ++c)
    {
      const Component component{ this->Sets.Begin(c), this->Sets.Size(c), conflicts[c] };
      signed char& side = this->Sides[this->Signs.Find(component.Ids[0]).first];
      if (side == 0 && (!patches || component.Count >= MinPatch))
      {
        const OutsideSign outside = DecideOutside(input, settings, component);
        side = static_cast<signed char>(outside.Sign);
        this->NumberOfClosed += outside.IsClosed ? 1 : 0;
      }
      // There may be as many sets as points: no report for each.
      const bool report = c % 1024 == 0 || component.Count > 1024;
      if (report &&
        !progress.Step(static_cast<double>(this->Sets.Starts[c + 1]) / this->Cloud.Size()))
      {
        return false;
      }
    }
    return true;
  }

  /// Turns normals outward, and marks the points that have an outside.
  void Apply(OrientationResult& result)
  {
    result.TwoSided.resize(this->Fits.size());
    result.NumberOfComponents = this->Sets.Count();
    result.NumberOfClosedComponents = this->NumberOfClosed;
    for (int c = 0; c < this->Sets.Count(); ++c)
    {
      const int* ids = this->Sets.Begin(c);
      const signed char side = this->Sides[this->Signs.Find(ids[0]).first];
      for (int m = 0; m < this->Sets.Size(c); ++m)
      {
        const int i = ids[m];
        PlaneFit& fit = this->Fits[i];
        if (!fit.Given)
        {
          const Vector3 normal = this->Sets.Normals[i];
          fit.Normal = side < 0 ? -1.0 * normal : normal;
        }
        const bool hasOutside = fit.Given || (side != 0 && !fit.Isolated && !fit.Degenerate);
        result.TwoSided[i] = hasOutside ? 0 : 1;
      }
    }
  }

  const LocalCloud& Cloud;
  const NeighborGraph& Graph;
  const OutsideSettings& Settings;
  std::vector<PlaneFit>& Fits;
  EdgeVotes Edges;
  ParityUnionFind Signs;
  std::vector<signed char> Sides; // [n] at the root of a set: +1 its sign is outward, -1 inward, 0
                                  // unknown
  ConsistentSets Sets;
  int NumberOfClosed = 0;
};
}

void FaceViewpoint(const LocalCloud& cloud, const Vector3& viewpoint, std::vector<PlaneFit>& fits)
{
  vtkSMPTools::For(0, cloud.Size(), [&](vtkIdType begin, vtkIdType end) {
    for (vtkIdType i = begin; i < end; ++i)
    {
      if (Dot(fits[i].Normal, viewpoint - Load(cloud.Position(static_cast<int>(i)))) < 0.0)
      {
        fits[i].Normal = -1.0 * fits[i].Normal;
      }
    }
  });
}

bool OrientConsistently(const LocalCloud& cloud, const NeighborGraph& graph,
  const OutsideSettings& settings, const StageProgress& progress, std::vector<PlaneFit>& fits,
  OrientationResult& result)
{
  return Orienter(cloud, graph, settings, fits).Run(progress, result);
}
}
