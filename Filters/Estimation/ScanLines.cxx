// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Estimation/ScanLines.h"

#include "Filters/Estimation/PrincipalPlane.h"
#include "Filters/Neighbors/LocalCloud.h"
#include "Filters/Neighbors/NeighborGraph.h"
#include "Filters/Neighbors/NeighborSearch.h"

#include <algorithm>
#include <cstddef>
#include <iterator>

namespace SurfelGeometry
{
namespace
{
/// Below this ratio of the two larger variances the neighbours are on a line.
constexpr double LineRatio = 0.02;

/// Below this one, they are on a narrow strip. Of random points on a plane, one in 10 000 looks so.
constexpr double NarrowRatio = 0.1;

/// Below this one, there are a few lines, whose distance is at least twice their pitch.
constexpr double LongRatio = 0.2;

/// More of a cloud are no rods: of grass 5 to 16 % are on lines, of loose twigs, fences and power
/// lines 0.7 to 4 %.
constexpr double MostOfRods = 0.05;

/// The wider neighbourhood: so many points of a sample of one in so many of the cloud.
constexpr int SampleNeighbors = 64;
constexpr double SampledShare = 1.0 / 16.0;

/// A sample of fewer points tells nothing.
constexpr int FewestSamples = 8;

/// Of the wider neighbourhood, so many are long around a line of a surface. In simulated scans of a
/// room, a facade and a tree from two places, 60 to 80 % of the points on single lines are below,
/// in a smaller sample: those of rods. Of the same places scanned in lines four and ten steps
/// apart, 3 to 6 % are.
constexpr double LongShare = 0.4;

/// Neighbours of a point on a line that are looked at.
constexpr int NearestOfLine = 8;

/// The points around are on a plane: largest variance across it, over the smaller one in it.
constexpr double PlaneRatio = 0.0005;

/// Within a surface, the line's variance across it is at most this part of that beside the line in
/// it. Floors that a scanner looks along have 0.001 to 0.03, rods and railings 0.08 to 4.
constexpr double WithinRatio = 0.05;

/// Of the points around that may be on rods, so many are within a surface if this one is. Where
/// smoothing has moved points of rods, some are by chance.
constexpr double WithinShare = 0.9;

/// Ways to the next lines are opposite, as a cosine, and their ratio is at most this one.
constexpr double Opposite = 0.95, MostUneven = 3.0;

/// Or so many are between lines that their scanners have seen: of the wires of fences 4 % are, of
/// floors and streets 75 to 95 %.
constexpr double BetweenShare = 0.5;
}

Spread SpreadOf(double smaller, double larger)
{
  return smaller < LineRatio * larger ? Spread::Line
    : smaller < NarrowRatio * larger  ? Spread::Narrow
    : smaller < LongRatio * larger    ? Spread::Long
                                      : Spread::Round;
}

bool IsWithinSurface(const Eigen::Matrix3d& line, const Eigen::Matrix3d& around)
{
  const Principal plane(around);
  if (plane.Variances[0] > PlaneRatio * plane.Variances[1])
  {
    return false;
  }
  const double across = plane.Normal.dot(line * plane.Normal);
  const double beside = line.trace() - across - Principal(line).Variances[2];
  return across < WithinRatio * beside;
}

bool AreToNextLines(const Vector3& a, const Vector3& b)
{
  const double x = Norm(a), y = Norm(b);
  return Dot(a, b) < -Opposite * x * y && std::max(x, y) < MostUneven * std::min(x, y);
}

bool IsOnRod(int i, const std::vector<LineKind>& kinds, const NeighborGraph& graph)
{
  const int* ids = graph.Row(static_cast<std::size_t>(i));
  if (kinds[i] == LineKind::Other)
  {
    return false;
  }
  int counts[5] = {};
  ++counts[static_cast<int>(kinds[i])];
  const int count = CountIds(ids, KeptNeighbors);
  for (int k = 0; k < count; ++k)
  {
    ++counts[static_cast<int>(kinds[ids[k]])];
  }
  const int within = counts[static_cast<int>(LineKind::WithinSurface)],
            between = counts[static_cast<int>(LineKind::BetweenLines)],
            lines = counts[static_cast<int>(LineKind::Rod)] + within + between;
  return within < WithinShare * lines && between < BetweenShare * lines;
}

std::vector<int> PointsBeside(const std::vector<int>& rods, const NeighborGraph& graph)
{
  std::vector<int> around, beside;
  for (const int i : rods)
  {
    const int* ids = graph.Row(static_cast<std::size_t>(i));
    around.insert(around.end(), ids, ids + CountIds(ids, KeptNeighbors));
  }
  std::sort(around.begin(), around.end());
  around.erase(std::unique(around.begin(), around.end()), around.end());
  std::set_difference(
    around.begin(), around.end(), rods.begin(), rods.end(), std::back_inserter(beside));
  return beside;
}

ScanLines::ScanLines(const LocalCloud& cloud, const Spreads& spreads)
  : Cloud(cloud)
  , Of(spreads)
{
  for (int i = 0; i < cloud.Size(); ++i)
  {
    if (spreads[i] >= Spread::Narrow)
    {
      this->Lines.push_back(i);
    }
  }
  if (this->Lines.size() <= MostOfRods * cloud.Size())
  {
    this->MakeSample();
  }
}

void ScanLines::MakeSample()
{
  for (const int i : SamplePoints(this->Cloud, this->Lines.empty() ? 0.0 : SampledShare))
  {
    const float* p = this->Cloud.Position(i);
    this->Positions.insert(this->Positions.end(), p, p + 3);
    this->AreLong.push_back(this->Of[i] != Spread::Round ? 1 : 0);
  }
  const int samples = static_cast<int>(this->AreLong.size());
  if (samples >= FewestSamples)
  {
    this->Tree = std::make_unique<NeighborSearch>(this->Positions.data(), samples);
  }
}

ScanLines::~ScanLines() = default;

bool ScanLines::IsAmongStrips(int i, const NeighborGraph& graph) const
{
  const int* ids = graph.Row(static_cast<std::size_t>(i));
  const auto strips = std::count_if(ids, ids + CountIds(ids, NearestOfLine),
    [this](int j) { return this->Of[j] >= Spread::Narrow; });
  return 2 * strips >= NearestOfLine;
}

bool ScanLines::IsOfSurface(int i, Query& query) const
{
  if (!this->Tree)
  {
    return true;
  }
  const float* p = this->Cloud.Position(i);
  this->Tree->nearestKSearch(
    pcl::PointXYZ(p[0], p[1], p[2]), SampleNeighbors, query.Ids, query.SquaredDistances);
  int areLong = 0;
  for (const int j : query.Ids)
  {
    areLong += this->AreLong[j];
  }
  return areLong >= LongShare * static_cast<double>(query.Ids.size());
}
}
