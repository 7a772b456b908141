// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Cleaning/MixedPixels.h"

#include "Filters/Cleaning/LocalQuadric.h"
#include "Filters/Cleaning/PointSpread.h"
#include "Filters/Common/NeighborGraph.h"
#include "Filters/Common/NeighborSearch.h"

#include "vtkDataArray.h"

#include <algorithm>
#include <cmath>

namespace SurfelGeometry
{
namespace
{
/// A point hangs between surfaces if its mean distance is so many times the least of its
/// neighbours', no more than a few of them have it in their plane, and its line of sight says so.
constexpr double SparserFactor = 1.5;
constexpr int MostInPlane = 3;

/// A plane of flat neighbours has a point that is as near to it as most of them, or a part of their
/// spacing, and not far beyond them.
constexpr double InPlaneDeviations = 2.5;
constexpr double InPlaneSpacings = 0.2;
constexpr double ReachOfPlane = 3.0;

/// So many points are looked at for what is nearer and farther beside the line of sight: those
/// within three spacings of the line, off the point's depth by more than one and a half. The mean
/// distance of StrayNeighbors points of a surface is that many spacings.
constexpr int SightNeighbors = 4 * StrayNeighbors;
constexpr double BesideSight = 3.0;
constexpr double OffDepth = 1.5;
constexpr double SpacingsOfDistance = 1.5;

/// Points that hang in sight and are in one plane are a curtain only if it contains the line of
/// sight; otherwise they are the few that came back from a dark thing. The plane is that of so many
/// of them, no farther than these mean distances, if its variance is this part of the next one; the
/// sine between it and the line of sight is at most 0.2, which their own scatter may make.
constexpr int CurtainPoints = 13;
constexpr int LeastCurtainPoints = 6;
constexpr double CurtainReach = 3.0;
constexpr double FlatCurtain = 0.05;
constexpr double CurtainSine = 0.2;

class MixedTest
{
public:
  MixedTest(
    const SearchedCloud& searched, const std::vector<float>& distances, vtkDataArray* toScanner)
    : Searched(searched)
    , Distances(distances)
    , ToScanner(toScanner)
  {
  }

  /// Changes `neighbors` and `near`.
  bool IsMixed(int i, Neighbors& neighbors, NearCloud& near) const
  {
    int found;
    const int* ids = this->Searched.FindIds(i, StrayNeighbors, neighbors, found);
    float least = this->Distances[i];
    for (int k = 0; k < found; ++k)
    {
      least = std::min(least, this->Distances[ids[k]]);
    }
    return this->Distances[i] > SparserFactor * least &&
      this->HangsInSight(i, least / SpacingsOfDistance, neighbors) &&
      this->IsOffSurfaces(i, neighbors, near);
  }

  /// Whether the mixed pixels about a point are a surface instead.
  /// @param mixed a search among them, of whose positions `positions` has three values each
  bool IsInSurface(int i, const NeighborSearch& mixed, const std::vector<float>& positions) const
  {
    const float* p = this->Searched.Cloud.Position(i);
    pcl::Indices ids;
    std::vector<float> squared;
    mixed.nearestKSearch(pcl::PointXYZ(p[0], p[1], p[2]), CurtainPoints, ids, squared);
    const double reach = CurtainReach * this->Distances[i];
    NearCloud near;
    for (size_t k = 0; k < ids.size() && squared[k] < reach * reach; ++k)
    {
      const float* q = &positions[3 * static_cast<size_t>(ids[k])];
      near.push_back(pcl::PointXYZ(q[0] - p[0], q[1] - p[1], q[2] - p[2]));
    }
    if (near.size() < LeastCurtainPoints)
    {
      return false;
    }
    const PointSpread spread = SpreadOf(near);
    return spread.Variances[0] < FlatCurtain * spread.Variances[1] &&
      std::abs(this->Sight(i).dot(spread.Axes.col(0))) > CurtainSine;
  }

private:
  /// The unit vector to the scanner. NaN where it is not known.
  Eigen::Vector3d Sight(int i) const
  {
    double way[3];
    this->ToScanner->GetTuple(this->Searched.Cloud.InputIds[i], way);
    // As floats, which is what other processes get.
    return Eigen::Vector3f(way[0], way[1], way[2]).cast<double>().stableNormalized();
  }

  /// Whether there is something nearer to the scanner and something farther beside the line of
  /// sight, and less at the depth of the point. False if the scanner is not known.
  bool HangsInSight(int i, double spacing, Neighbors& neighbors) const
  {
    const Eigen::Vector3d sight = this->Sight(i);
    if (!(sight.squaredNorm() > 0.5))
    {
      return false;
    }
    this->Searched.Tree->FindNearest(i, SightNeighbors, neighbors);
    int nearer = 0, farther = 0, same = 0;
    for (const int j : neighbors.Ids)
    {
      const Eigen::Vector3d d = this->Between(i, j);
      const double along = d.dot(sight);
      if ((d - along * sight).norm() < BesideSight * spacing)
      {
        ++(along > OffDepth * spacing ? nearer : along < -OffDepth * spacing ? farther : same);
      }
    }
    return nearer > 0 && farther > 0 && nearer + farther > same;
  }

  Eigen::Vector3d Between(int i, int j) const
  {
    const float *p = this->Searched.Cloud.Position(i), *q = this->Searched.Cloud.Position(j);
    return Eigen::Vector3d(q[0] - p[0], q[1] - p[1], q[2] - p[2]);
  }

  bool IsOffSurfaces(int i, Neighbors& neighbors, NearCloud& near) const
  {
    this->Searched.Find(i, StrayNeighbors, neighbors);
    const std::vector<int> around = neighbors.Ids;
    int inPlane = 0;
    for (size_t k = 0; k < around.size() && inPlane <= MostInPlane; ++k)
    {
      inPlane += this->IsInPlaneOf(around[k], i, neighbors, near) ? 1 : 0;
    }
    return inPlane <= MostInPlane;
  }

  /// Whether point i goes on with the plane about point j.
  bool IsInPlaneOf(int j, int i, Neighbors& neighbors, NearCloud& near) const
  {
    this->Searched.Find(j, StrayNeighbors, neighbors);
    const Eigen::Vector3d d = this->Between(j, i);
    const double spacing = SpacingOf(neighbors), reach = ReachOfPlane * spacing;
    if (!(d.squaredNorm() < reach * reach))
    {
      return false;
    }
    LoadNear(this->Searched.Cloud, j, neighbors, near);
    const PointSpread spread = SpreadOf(near);
    const double height = (d - spread.Mean).dot(spread.Axes.col(0));
    const double tolerance =
      std::max(InPlaneDeviations * std::sqrt(spread.Variances[0]), InPlaneSpacings * spacing);
    return !FillsSpaceAround(spread.Variances) && std::abs(height) < tolerance;
  }

  const SearchedCloud& Searched;
  const std::vector<float>& Distances;
  vtkDataArray* ToScanner;
};
}

bool FindMixedPixels(const SearchedCloud& searched, const std::vector<float>& distances,
  vtkDataArray* toScanner, const StageProgress& progress, std::vector<unsigned char>& stray)
{
  if (!toScanner)
  {
    return true;
  }
  const MixedTest test(searched, distances, toScanner);
  const int count = searched.Cloud.Size();
  std::vector<unsigned char> isMixed(count, 0);
  const bool running =
    ParallelFor(count, progress.Part(0.0, 0.9), [&](vtkIdType begin, vtkIdType end) {
      Neighbors neighbors;
      NearCloud near;
      for (int i = static_cast<int>(begin); i < end; ++i)
      {
        isMixed[i] = !stray[i] && test.IsMixed(i, neighbors, near) ? 1 : 0;
      }
    });
  std::vector<float> positions;
  for (int i = 0; i < count; ++i)
  {
    if (isMixed[i])
    {
      const float* p = searched.Cloud.Position(i);
      positions.insert(positions.end(), p, p + 3);
    }
  }
  if (!running || positions.empty())
  {
    return running;
  }
  const NeighborSearch mixed(positions.data(), static_cast<int>(positions.size() / 3));
  return ParallelFor(count, progress.Part(0.9, 1.0), [&](vtkIdType begin, vtkIdType end) {
    for (int i = static_cast<int>(begin); i < end; ++i)
    {
      if (isMixed[i] && !test.IsInSurface(i, mixed, positions))
      {
        stray[i] = 1;
      }
    }
  });
}
}
