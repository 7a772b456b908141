// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Estimation/CloudPlanes.h"

#include "Filters/Common/ParallelFor.h"
#include "Filters/Estimation/LineFits.h"
#include "Filters/Estimation/PlaneFitter.h"
#include "Filters/Neighbors/LocalCloud.h"

#include <algorithm>

namespace SurfelGeometry
{
namespace
{
/// A neighbourhood is mixed if this many of the GraphDegree nearest are on another sheet.
constexpr int MixedNeighbors = 3;

/// Fits all points to their nearest neighbours. Returns false if stopped.
bool FitToNearest(const FitInput& input, const StageProgress& progress, PlaneFits& fits,
  NeighborGraph& graph, Spreads& spreads)
{
  const LocalCloud& cloud = input.Cloud;
  const FitSettings& settings = input.Settings;
  const bool isKnown = !graph.Ids.empty() && graph.AreNearest && !settings.UseRadius &&
    settings.NumberOfNeighbors <= KeptNeighbors;
  graph.Ids.resize(KeptNeighbors * fits.size());
  graph.AreNearest = !settings.UseRadius;
  return ParallelFor(cloud.Size(), progress, [&](vtkIdType begin, vtkIdType end) {
    PlaneFitter fitter(cloud, input.Tree, settings);
    Neighbors neighbors;
    for (vtkIdType i = begin; i < end; ++i)
    {
      const int self = static_cast<int>(i);
      if (isKnown)
      {
        graph.Get(cloud, self, settings.NumberOfNeighbors, neighbors);
      }
      else
      {
        fitter.FindAndKeep(self, graph, neighbors);
      }
      fits[i] = fitter.Fit(self, input.GivenNormal(self), neighbors, spreads[i]);
      fits[i].SideGiven = fits[i].Given && input.AreSidesGiven;
    }
  });
}
}

bool FitPlanes(
  const FitInput& input, const StageProgress& progress, PlaneFits& fits, NeighborGraph& graph)
{
  const size_t count = static_cast<size_t>(input.Cloud.Size());
  Spreads spreads(count);
  fits.resize(count);
  if (!FitToNearest(input, progress.Part(0.0, 0.9), fits, graph, spreads) ||
    !FitLines(input, spreads, graph, progress.Part(0.9, 1.0), fits))
  {
    return false;
  }
  const FitSettings& settings = input.Settings;
  ParallelFor(0, input.Cloud.Size(), [&](vtkIdType i, vtkIdType end) {
    for (; i < end; ++i)
    {
      if (!(fits[i].Spacing > 0.0))
      {
        // A single point: any radius will do.
        fits[i].MakeRound(settings.UseRadius && settings.Radius > 0.0 ? settings.Radius : 1.0);
      }
    }
  });
  return true;
}

bool RefineExtents(const OrientedCloud& oriented, const FitSettings& settings,
  const StageProgress& progress, PlaneFits& fits)
{
  const LocalCloud& cloud = oriented.Cloud;
  const std::vector<unsigned char>& twoSided = oriented.TwoSided;
  const auto isOfSheet = [&](int i, int j) {
    return AreOfOneSheet(fits[i], fits[j], twoSided[i] || twoSided[j],
      Load(cloud.Position(j)) - Load(cloud.Position(i)));
  };
  return ParallelFor(cloud.Size(), progress, [&](vtkIdType begin, vtkIdType end) {
    PlaneFitter fitter(cloud, oriented.Tree, settings);
    Neighbors neighbors;
    for (vtkIdType i = begin; i < end; ++i)
    {
      const int self = static_cast<int>(i);
      const auto isOfMySheet = [&](int j) { return isOfSheet(self, j); };
      const int* nearest = oriented.Graph.Row(i);
      const auto onOtherSheets = std::count_if(
        nearest, nearest + GraphDegree, [&](int j) { return j >= 0 && !isOfMySheet(j); });
      if (onOtherSheets >= MixedNeighbors && fits[i].HasPlane() && !fits[i].OnScanLines)
      {
        fitter.Refit(self, neighbors, fits[i], isOfMySheet);
      }
    }
  });
}
}
