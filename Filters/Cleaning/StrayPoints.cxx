// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Cleaning/StrayPoints.h"

#include "Filters/Cleaning/PointSpread.h"
#include "Filters/Common/Median.h"
#include "Filters/Common/VectorMath.h"

#include <algorithm>
#include <cmath>

namespace SurfelGeometry
{
namespace
{
/// Neighbours of a mean distance. Fewer than this many points that are near each other, and far
/// from all others, are stray points too.
constexpr int StrayNeighbors = 16;

/// A set of points fills space if its smallest variance is above this part of its largest: 16
/// uniform points in a ball have 0.35, in a disc with noise of a quarter of their spacing 0.05.
constexpr double FillsSpace = 0.05;

/// A point in a set that fills space is stray if its mean distance is this many times the median of
/// the cloud. Foliage is as dense as other surfaces at the same distance from a scanner.
constexpr double SparseFactor = 6.0;

/// A point is stray if its mean distance is this many times the median of its neighbours'. At ends
/// of wires and at corners it is up to 2, with the scatter of random samples up to 2.8.
constexpr double LocalFactor = 3.0;

/// Up to this factor it is kept if it is in the plane of its neighbours, since it may be where a
/// sparse part of a surface meets one with 100 times its density.
constexpr double BorderFactor = 10.0;

/// A point beside a plane of neighbours is stray if it is this many of their standard deviations
/// away, and this many spacings: noise goes less far, and so do edges, whose neighbours are not in
/// a plane.
constexpr double BesidePlane = 5.0;
constexpr double BesidePlaneSpacings = 1.25;

/// In such a wider neighbourhood at most this many other points may be off the plane: the end of a
/// sparse branch that sticks in a dense one is not alone.
constexpr int WiderNeighbors = 4 * StrayNeighbors;
constexpr int OthersOffPlane = 2;

enum Suspicion : unsigned char
{
  NONE = 0,
  BESIDE = 1,    // it is beside its neighbours, not among them
  SPATIAL = 2,   // its neighbours fill space
  OFF_PLANE = 4, // its neighbours are in a plane, it is not
};

/// Whether point 0 is outside of its neighbours: farther from their mean than they are in RMS.
bool IsBeside(const PointSpread& spread)
{
  return spread.Mean.squaredNorm() > spread.Variances.sum();
}

/// Whether point 0 is beside the plane of its neighbours rather than farther along.
bool LeavesPlane(const PointSpread& spread)
{
  return std::pow(spread.Mean.dot(spread.Axes.col(0)), 2) > 0.25 * spread.Mean.squaredNorm();
}

bool IsOffPlane(const PointSpread& spread, int neighbors)
{
  const double squared = std::pow(spread.Mean.dot(spread.Axes.col(0)), 2);
  // The area per point of a disc with these variances, see PlaneFit.cxx.
  const double area = 4.0 * Pi * std::sqrt(spread.Variances[1] * spread.Variances[2]) / neighbors;
  return squared > BesidePlane * BesidePlane * spread.Variances[0] &&
    squared > BesidePlaneSpacings * BesidePlaneSpacings * area &&
    squared > 0.5 * spread.Mean.squaredNorm();
}

/// Whether hardly any other points are off the plane by at least half as much as point 0.
bool IsAloneOffPlane(const PointSpread& plane, const NearCloud& near)
{
  const Eigen::Vector3d normal = plane.Axes.col(0);
  const double limit = 0.5 * std::abs(plane.Mean.dot(normal));
  const auto off = std::count_if(near.begin(), near.end(), [&](const pcl::PointXYZ& p) {
    const Eigen::Vector3d d = p.getVector3fMap().cast<double>() - plane.Mean;
    return std::abs(d.dot(normal)) > limit;
  });
  return off <= OthersOffPlane;
}

unsigned char SuspicionOf(const PointSpread& spread, int neighbors)
{
  const bool spatial = spread.Variances[0] > FillsSpace * spread.Variances[2];
  return static_cast<unsigned char>((IsBeside(spread) ? BESIDE : NONE) |
    (spatial ? SPATIAL : NONE) | (IsOffPlane(spread, neighbors) ? OFF_PLANE : NONE));
}

double MeanDistance(const Neighbors& neighbors)
{
  double sum = 0.0;
  for (const float squared : neighbors.SquaredDistances)
  {
    sum += std::sqrt(squared);
  }
  return neighbors.Count() > 0 ? sum / neighbors.Count() : 0.0;
}

class StrayTest
{
public:
  StrayTest(const LocalCloud& cloud, const NeighborSearch& tree)
    : Cloud(cloud)
    , Tree(tree)
    , Distances(cloud.Size())
    , Suspicions(cloud.Size())
  {
  }

  bool Measure(const StageProgress& progress)
  {
    return ParallelFor(this->Cloud.Size(), progress, [&](vtkIdType begin, vtkIdType end) {
      Neighbors neighbors;
      NearCloud near;
      for (int i = static_cast<int>(begin); i < end; ++i)
      {
        this->Tree.FindNearest(i, StrayNeighbors, neighbors);
        LoadNear(this->Cloud, i, neighbors, near);
        const PointSpread spread = SpreadOf(near);
        this->Distances[i] = static_cast<float>(MeanDistance(neighbors));
        this->Suspicions[i] = SuspicionOf(spread, neighbors.Count());
      }
    });
  }

  /// Points in sparse sets that fill space.
  void FindSparse(std::vector<unsigned char>& stray)
  {
    std::vector<float> distances = this->Distances;
    this->Sparse = SparseFactor * Median(distances);
    for (size_t i = 0; i < stray.size(); ++i)
    {
      stray[i] = (this->Suspicions[i] & SPATIAL) && this->Distances[i] > this->Sparse ? 1 : 0;
    }
  }

  /// Adds points that are beside their neighbours, and those whose neighbours are mostly stray.
  bool FindBeside(const StageProgress& progress, const std::vector<unsigned char>& sparse,
    std::vector<unsigned char>& stray) const
  {
    return ParallelFor(this->Cloud.Size(), progress, [&](vtkIdType begin, vtkIdType end) {
      Neighbors neighbors;
      NearCloud near;
      for (int i = static_cast<int>(begin); i < end; ++i)
      {
        if (!sparse[i] && (this->Suspicions[i] != NONE || this->Distances[i] > this->Sparse))
        {
          this->Tree.FindNearest(i, StrayNeighbors, neighbors);
          stray[i] = this->IsStray(i, sparse, neighbors, near) ? 1 : 0;
        }
      }
    });
  }

private:
  /// Changes `neighbors` and `near`.
  bool IsStray(
    int i, const std::vector<unsigned char>& sparse, Neighbors& neighbors, NearCloud& near) const
  {
    if (this->Suspicions[i] & OFF_PLANE)
    {
      LoadNear(this->Cloud, i, neighbors, near);
      const PointSpread plane = SpreadOf(near);
      this->Tree.FindNearest(i, WiderNeighbors, neighbors);
      LoadNear(this->Cloud, i, neighbors, near);
      if (IsAloneOffPlane(plane, near))
      {
        return true;
      }
      neighbors.Ids.resize(StrayNeighbors);
    }
    std::vector<int>& ids = neighbors.Ids;
    const size_t count = ids.size();
    ids.erase(
      std::remove_if(ids.begin(), ids.end(), [&](int j) { return sparse[j] != 0; }), ids.end());
    if (2 * ids.size() < count)
    {
      return true;
    }
    const auto less = [this](int a, int b) { return this->Distances[a] < this->Distances[b]; };
    std::nth_element(ids.begin(), ids.begin() + ids.size() / 2, ids.end(), less);
    const double usual = this->Distances[ids[ids.size() / 2]];
    if (this->Distances[i] <= LocalFactor * usual)
    {
      return false;
    }
    // Without other stray points the neighbours show their surface.
    const auto isFar = [&](int j) { return this->Distances[j] > 2.0 * usual; };
    ids.erase(std::remove_if(ids.begin(), ids.end(), isFar), ids.end());
    LoadNear(this->Cloud, i, neighbors, near);
    return this->Distances[i] > BorderFactor * usual || LeavesPlane(SpreadOf(near));
  }

  const LocalCloud& Cloud;
  const NeighborSearch& Tree;
  std::vector<float> Distances; // [n] mean distance to the neighbours, world units
  std::vector<unsigned char> Suspicions;
  double Sparse = 0.0; // world units
};
}

bool FindStrayPoints(const LocalCloud& cloud, const NeighborSearch& tree,
  const StageProgress& progress, std::vector<unsigned char>& stray)
{
  stray.assign(cloud.Size(), 0);
  if (cloud.Size() <= StrayNeighbors)
  {
    return true; // too few to say what is usual
  }
  StrayTest test(cloud, tree);
  if (!test.Measure(progress.Part(0.0, 0.8)))
  {
    return false;
  }
  test.FindSparse(stray);
  const std::vector<unsigned char> sparse = stray;
  return test.FindBeside(progress.Part(0.8, 1.0), sparse, stray);
}
}
