// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Estimation/ScanLines.h"

#include "Filters/Common/Hash.h"
#include "Filters/Common/LocalCloud.h"
#include "Filters/Common/NeighborSearch.h"

#include <cstdint>

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

/// More of a cloud are the lines of a scanner that turns: 15 to 40 % of such scans are on lines, of
/// others about 0.1 %.
constexpr double MostOfRods = 0.05;

/// The wider neighbourhood: so many points of a sample of one in so many of the cloud.
constexpr int SampleNeighbors = 64;
constexpr double SampleShare = 1.0 / 16.0;

/// A sample of fewer points tells nothing.
constexpr int FewestSamples = 8;

/// Of the wider neighbourhood, so many are long around a line of a surface. In simulated scans of a
/// room, a facade and a tree from two places, 60 to 80 % of the points on single lines are below,
/// in a smaller sample: those of rods. Of the same places scanned in lines four and ten steps
/// apart, 3 to 6 % are.
constexpr double LongShare = 0.4;
}

Spread SpreadOf(double smaller, double larger)
{
  return smaller < LineRatio * larger ? Spread::Line
    : smaller < NarrowRatio * larger  ? Spread::Narrow
    : smaller < LongRatio * larger    ? Spread::Long
                                      : Spread::Round;
}

ScanLines::ScanLines(const LocalCloud& cloud, const Spreads& spreads)
  : Cloud(cloud)
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
    this->MakeSample(spreads);
  }
}

void ScanLines::MakeSample(const Spreads& spreads)
{
  for (int i = 0; i < this->Cloud.Size() && !this->Lines.empty(); ++i)
  {
    if (Hash(static_cast<std::uint64_t>(this->Cloud.SampleId(i))) < SampleShare)
    {
      const float* p = this->Cloud.Position(i);
      this->Positions.insert(this->Positions.end(), p, p + 3);
      this->AreLong.push_back(spreads[i] != Spread::Round ? 1 : 0);
    }
  }
  const int samples = static_cast<int>(this->AreLong.size());
  if (samples >= FewestSamples)
  {
    this->Tree = std::make_unique<NeighborSearch>(this->Positions.data(), samples);
  }
}

ScanLines::~ScanLines() = default;

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
