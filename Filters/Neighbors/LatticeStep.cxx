// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Neighbors/LatticeStep.h"

#include "Filters/Neighbors/LocalCloud.h"
#include "Filters/Neighbors/NeighborGraph.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace SurfelGeometry
{
namespace
{
/// So many points of a sample tell a lattice.
constexpr double LatticeSample = 512.0;

/// What is shorter than this part of the largest way to a neighbour is rounding.
constexpr double LeastStep = 1e-3;

/// By how much of a step a point of a lattice may be off it.
constexpr double LatticeTolerance = 0.02;

/// Ways from sampled points to their stored neighbours, along the axes; as many of each.
std::array<std::vector<double>, 3> WaysToNeighbors(
  const LocalCloud& cloud, const NeighborGraph& graph)
{
  std::array<std::vector<double>, 3> ways;
  for (const int i : SamplePoints(cloud, LatticeSample / cloud.Size()))
  {
    const int* row = graph.Row(i);
    for (int k = 0; k < CountIds(row, KeptNeighbors); ++k)
    {
      const Vector3 d = Load(cloud.Position(row[k])) - Load(cloud.Position(i));
      for (int axis = 0; axis < 3; ++axis)
      {
        ways[axis].push_back(std::abs(d[axis]));
      }
    }
  }
  return ways;
}

/// The step of which all ways are multiples; 0 if there is none.
/// @param least shorter ways are rounding
double CommonStep(const std::vector<double>& ways, double least)
{
  double step = 0.0;
  for (const double way : ways)
  {
    step = way > least && (step == 0.0 || way < step) ? way : step;
  }
  const auto isMultiple = [step](double way) {
    const double steps = way / step;
    return std::abs(steps - std::round(steps)) < LatticeTolerance;
  };
  return step > 0.0 && std::all_of(ways.begin(), ways.end(), isMultiple) ? step : 0.0;
}
}

double LatticeStep(const LocalCloud& cloud, const NeighborGraph& graph)
{
  const std::array<std::vector<double>, 3> ways = WaysToNeighbors(cloud, graph);
  double longest = 0.0, largest = 0.0;
  for (const std::vector<double>& along : ways)
  {
    for (const double way : along)
    {
      longest = std::max(longest, way);
    }
  }
  for (const std::vector<double>& along : ways)
  {
    const double step = CommonStep(along, LeastStep * longest);
    if (step == 0.0)
    {
      return 0.0;
    }
    largest = std::max(largest, step);
  }
  return largest;
}
}
