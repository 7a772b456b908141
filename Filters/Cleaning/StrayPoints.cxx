// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Cleaning/StrayPoints.h"

#include "Filters/Cleaning/CleaningProblem.h"
#include "Filters/Cleaning/HangingPoints.h"
#include "Filters/Cleaning/PointSpread.h"
#include "Filters/Cleaning/SurfaceDensity.h"
#include "Filters/Common/Median.h"
#include "Filters/Common/ParallelFor.h"
#include "Filters/Neighbors/NeighborSearch.h"
#include "Filters/Neighbors/SparseSurface.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>

namespace SurfelGeometry
{
namespace
{
/// A point in a set that fills space is stray if its mean distance is this many times the median of
/// the cloud, and this many times that of the surfaces nearest to it. Foliage has as many points as
/// other surfaces at the same distance from a scanner: with a spacing of s there, spread over a
/// depth of 40 s, 16 neighbours are in a ball of radius (3 * 16 / (4 pi) * 40)^(1/3) s instead of a
/// disc of (16 / pi)^(1/2) s, which is 2.4 times smaller.
constexpr double SparseFactor = 6.0;
constexpr double FoliageFactor = 2.4;

/// A point is stray if its mean distance is this many times the median of its neighbours'. At ends
/// of wires and at corners it is up to 2, with the scatter of random samples up to 2.8.
constexpr double LocalFactor = 3.0;

/// Or that to the nearest few: a wire has 16 points within eight spacings, and four within two.
/// With the scatter of random samples it is up to 3.4.
constexpr int FewNeighbors = 4;
constexpr double FewFactor = 3.5;

/// Up to this factor it is kept if it is in the plane of its neighbours, since it may be where a
/// sparse part of a surface meets one with 100 times its density.
constexpr double BorderFactor = 10.0;

/// Points that are as sparse are sought so many mean distances about it, which are 4.5 spacings of
/// a surface, among so many points: half of them are 100 times as dense.
constexpr double BorderReach = 3.0;
constexpr int BorderNeighbors = 4096;

/// A point beside a plane of neighbours is stray if it is this many of their standard deviations
/// away, and this many spacings: noise goes less far, and so do edges, whose neighbours are not in
/// a plane.
constexpr double BesidePlane = 5.0;
constexpr double BesidePlaneSpacings = 1.25;

/// In such a wider neighbourhood at most this many other points may be off the plane: the end of a
/// sparse branch that sticks in a dense one is not alone.
constexpr int WiderNeighbors = 4 * StrayNeighbors;
constexpr int OthersOffPlane = 2;

/// Points of a floor that is seen at a grazing angle are far from those of other lines of the scan,
/// but have two neighbours of their own line beside them: in the mean nearer than this part of
/// their mean distance, which is 0.3 where lines are five times as far apart as their points, and
/// 0.5 of random points.
constexpr int AsideNeighbors = 2;
constexpr double AsideShare = 0.4;

/// Whether point 0 is beside the plane of its neighbours rather than farther along.
bool LeavesPlane(const PointSpread& spread)
{
  return std::pow(spread.Mean.dot(spread.Axes.col(0)), 2) > 0.25 * spread.Mean.squaredNorm();
}

bool IsOffPlane(const PointSpread& spread, int neighbors)
{
  const double squared = std::pow(spread.Mean.dot(spread.Axes.col(0)), 2);
  // The area per point of a disc with these variances, see PlaneFitter.cxx.
  const double area = 4.0 * Pi * std::sqrt(spread.Variances[1] * spread.Variances[2]) / neighbors;
  return squared > BesidePlane * BesidePlane * spread.Variances[0] &&
    squared > BesidePlaneSpacings * BesidePlaneSpacings * area &&
    squared > 0.5 * spread.Mean.squaredNorm();
}

/// Of the points but for the one, not the first, that is farthest off their plane: it may be
/// stray. Changes `near`.
PointSpread SpreadWithoutFarthest(const PointSpread& spread, NearCloud& near)
{
  const Eigen::Vector3d normal = spread.Axes.col(0);
  const auto height = [&](const pcl::PointXYZ& p) {
    return std::abs((p.getVector3fMap().cast<double>() - spread.Mean).dot(normal));
  };
  near.erase(std::max_element(near.begin() + 1, near.end(),
    [&](const pcl::PointXYZ& a, const pcl::PointXYZ& b) { return height(a) < height(b); }));
  return SpreadOf(near);
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

/// A bound on IsOffPlane without principal axes: of the variances a <= b <= c, bc is at least a
/// third of ab + ac + bc.
bool MayBeOffPlane(const NearCloud& near)
{
  Eigen::Matrix3d s;
  Eigen::Vector4d mean;
  pcl::computeMeanAndCovarianceMatrix(near, s, mean);
  const double invariant = s(0, 0) * s(1, 1) - s(0, 1) * s(0, 1) + s(0, 0) * s(2, 2) -
    s(0, 2) * s(0, 2) + s(1, 1) * s(2, 2) - s(1, 2) * s(1, 2);
  const double squared = mean.head<3>().squaredNorm();
  const double area = 4.0 * Pi / static_cast<double>(near.size());
  const double least = BesidePlaneSpacings * BesidePlaneSpacings * area;
  return 3.0 * squared * squared > least * least * invariant;
}

/// Mean distance to the neighbours, and to the nearest few.
struct MeanDistances
{
  double All = 0.0, Few = 0.0;

  /// @param neighbors the nearest first
  explicit MeanDistances(const Neighbors& neighbors)
  {
    const int count = neighbors.Count(), few = std::min(count, FewNeighbors);
    double sum = 0.0;
    for (int k = 0; k < count; ++k)
    {
      sum += std::sqrt(neighbors.SquaredDistances[k]);
      this->Few = k + 1 == few ? sum / few : this->Few;
    }
    this->All = count > 0 ? sum / count : 0.0;
  }
};

/// What is found of a point that is beside its neighbours.
enum Verdict : unsigned char
{
  Stays,
  Stray,
  NearStray // it is so near to a surface that it may be in a halo as well
};

class StrayTest
{
public:
  explicit StrayTest(const CleaningProblem& problem)
    : Problem(problem)
    , Searched(problem.Searched)
    , Cloud(problem.Cloud())
    , Distances(problem.Cloud().Size())
    , FewDistances(problem.Cloud().Size())
    , MayBeOff(problem.Cloud().Size())
  {
  }

  bool Measure(const StageProgress& progress)
  {
    return ParallelFor(this->Cloud.Size(), progress, [&](vtkIdType begin, vtkIdType end) {
      Neighbors neighbors;
      NearCloud near;
      for (int i = static_cast<int>(begin); i < end; ++i)
      {
        this->Searched.Find(i, StrayNeighbors, neighbors);
        LoadNear(this->Cloud, i, neighbors, near);
        const MeanDistances means(neighbors);
        this->Distances[i] = static_cast<float>(means.All);
        this->FewDistances[i] = static_cast<float>(means.Few);
        this->MayBeOff[i] = MayBeOffPlane(near) ? 1 : 0;
      }
    });
  }

  /// Points in sparse sets that fill space or are curtains of mixed pixels. Collective; returns
  /// false if stopped.
  bool FindSparse(bool running, vtkDataArray* toScanner, std::vector<unsigned char>& stray)
  {
    std::vector<float> distances;
    for (const int i : SurfaceDensity::Samples(this->Problem))
    {
      distances.push_back(this->Distances[i]);
    }
    if (!this->Problem.Gather(running, distances))
    {
      return false;
    }
    this->Sparse = SparseFactor * Median(distances);
    std::vector<int> suspects;
    for (int i = 0; i < this->Cloud.Size(); ++i)
    {
      if (this->Distances[i] > this->Sparse)
      {
        suspects.push_back(i);
      }
    }
    if (suspects.empty() && !this->Problem.Sharing)
    {
      return true;
    }
    FlatPoints flat(this->Searched);
    SurfaceDensity surfaces;
    const auto counts = [&](int i) { return !this->IsInCurtain(i, toScanner); };
    if (!surfaces.Find(this->Problem, this->Distances, running, flat, counts))
    {
      return false;
    }
    ParallelFor(0, static_cast<vtkIdType>(suspects.size()), [&](vtkIdType k, vtkIdType end) {
      Neighbors neighbors;
      NearCloud near;
      for (; k < end; ++k)
      {
        const int i = suspects[k];
        const double usual = surfaces.UsualDistance(this->Problem.SharedPosition(i));
        const bool isSparse = this->Distances[i] > FoliageFactor * usual;
        const bool isInSpace = isSparse && !IsFlat(this->Searched, i, neighbors, near) &&
          !IsOnSparseSurface(i, *this->Searched.Tree, this->Distances, neighbors,
            [&flat](int j) { return flat.IsOnSurface(j); });
        stray[i] = isInSpace || (isSparse && this->IsInCurtain(i, toScanner)) ? 1 : 0;
      }
    });
    return true;
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
        int found;
        const int* ids = this->Searched.FindIds(i, StrayNeighbors, neighbors, found);
        if (sparse[i] || found < StrayNeighbors)
        {
          continue; // known already, or a region with hardly any points
        }
        if (this->MayBeOff[i] || this->MayBeFar(i, sparse, ids))
        {
          this->Searched.Find(i, StrayNeighbors, neighbors);
          stray[i] = this->Judge(i, sparse, neighbors, near);
        }
      }
    });
  }

  /// Adds halos and mixed pixels. Collective; returns false if stopped.
  bool FindHanging(bool running, vtkDataArray* toScanner, const StageProgress& progress,
    std::vector<unsigned char>& stray) const
  {
    return FindHangingPoints(this->Problem, running, this->Distances, toScanner, progress, stray);
  }

private:
  /// Whether the flat neighbours of a sparse point are mixed pixels in a curtain, not a floor.
  bool IsInCurtain(int i, vtkDataArray* toScanner) const
  {
    if (!toScanner || this->Distances[i] <= this->Sparse)
    {
      return false;
    }
    Neighbors neighbors;
    NearCloud near;
    this->Searched.Find(i, StrayNeighbors, neighbors);
    LoadNear(this->Cloud, i, neighbors, near);
    if (neighbors.Count() < StrayNeighbors)
    {
      return false;
    }
    std::vector<int> sparse;
    std::copy_if(neighbors.Ids.begin(), neighbors.Ids.end(), std::back_inserter(sparse),
      [this](int j) { return this->Distances[j] > this->Sparse; });
    if (!IsCurtain(this->Cloud, i, sparse, toScanner, SpreadOf(near)))
    {
      return false;
    }
    double aside = 0.0, all = 0.0;
    Neighbors others;
    for (const int j : neighbors.Ids)
    {
      this->Searched.Find(j, StrayNeighbors, others);
      aside += std::sqrt(others.SquaredDistances[AsideNeighbors - 1]);
      all += this->Distances[j];
    }
    return aside > AsideShare * all;
  }

  /// Whether enough neighbours are stray, or nearer than the point's distance says, for a closer
  /// look.
  /// @param ids [StrayNeighbors]
  bool MayBeFar(int i, const std::vector<unsigned char>& sparse, const int* ids) const
  {
    const auto telling = std::count_if(ids, ids + StrayNeighbors,
      [&](int j) { return sparse[j] || LocalFactor * this->Distances[j] < this->Distances[i]; });
    return telling > StrayNeighbors / 2 || this->MayBeFarFromFew(i, ids);
  }

  /// The nearest neighbour alone says no for most points.
  bool MayBeFarFromFew(int i, const int* ids) const
  {
    const float least = this->FewDistances[i] / static_cast<float>(FewFactor);
    const auto isNearer = [&](int j) { return this->FewDistances[j] < least; };
    return this->FewDistances[ids[0]] < 2.0f * least &&
      std::count_if(ids, ids + StrayNeighbors, isNearer) >= StrayNeighbors / 2;
  }

  /// Median of the neighbours' distances. Changes the order of `ids`.
  static double UsualOf(const std::vector<float>& distances, std::vector<int>& ids)
  {
    const auto less = [&distances](int a, int b) { return distances[a] < distances[b]; };
    std::nth_element(ids.begin(), ids.begin() + ids.size() / 2, ids.end(), less);
    return distances[ids[ids.size() / 2]];
  }

  /// Changes `neighbors` and `near`.
  Verdict Judge(
    int i, const std::vector<unsigned char>& sparse, Neighbors& neighbors, NearCloud& near) const
  {
    LoadNear(this->Cloud, i, neighbors, near);
    const PointSpread spread = SpreadOf(near);
    if (IsOffPlane(spread, neighbors.Count()))
    {
      this->Searched.Tree->FindNearest(i, WiderNeighbors, neighbors);
      LoadNear(this->Cloud, i, neighbors, near);
      if (IsAloneOffPlane(spread, near))
      {
        return Stray;
      }
      neighbors.Ids.resize(StrayNeighbors);
    }
    else if (!IsBeside(spread) && !FillsSpaceAround(spread.Variances) &&
      this->Distances[i] <= this->Sparse)
    {
      return Stays;
    }
    std::vector<int>& ids = neighbors.Ids;
    const size_t count = ids.size();
    Remove(sparse, ids);
    if (2 * ids.size() < count)
    {
      return Stray;
    }
    const double few = UsualOf(this->FewDistances, ids), usual = UsualOf(this->Distances, ids);
    const bool isFar = this->Distances[i] > LocalFactor * usual;
    if (!isFar && this->FewDistances[i] <= FewFactor * few)
    {
      return Stays;
    }
    // Without other stray points the neighbours show their surface.
    const auto isSparse = [&](int j) { return this->Distances[j] > 2.0 * usual; };
    ids.erase(std::remove_if(ids.begin(), ids.end(), isSparse), ids.end());
    LoadNear(this->Cloud, i, neighbors, near);
    const bool isOutside = this->Distances[i] > BorderFactor * usual || LeavesPlane(SpreadOf(near));
    return isOutside && isFar                         ? Stray
      : !this->IsOnBorder(i, sparse, neighbors, near) ? NearStray
                                                      : Stays;
  }

  static void Remove(const std::vector<unsigned char>& sparse, std::vector<int>& ids)
  {
    ids.erase(
      std::remove_if(ids.begin(), ids.end(), [&](int j) { return sparse[j] != 0; }), ids.end());
  }

  /// Whether a point beside much denser ones has others about it that are as sparse, in one plane
  /// with it: a surface goes on there, with fewer points. Changes `neighbors` and `near`.
  bool IsOnBorder(
    int i, const std::vector<unsigned char>& sparse, Neighbors& neighbors, NearCloud& near) const
  {
    this->Searched.Tree->FindWithin(
      i, BorderReach * this->Distances[i], BorderNeighbors, neighbors);
    Remove(sparse, neighbors.Ids);
    if (!LoadAsSparse(this->Cloud, i, this->FewDistances, neighbors, near))
    {
      return false;
    }
    const PointSpread spread = SpreadOf(near);
    return IsThin(spread) ||
      (near.size() == CurtainPoints && IsThin(SpreadWithoutFarthest(spread, near)));
  }

  const CleaningProblem& Problem;
  const SearchedCloud& Searched;
  const LocalCloud& Cloud;
  std::vector<float> Distances;        // [n] mean distance to the neighbours, world units
  std::vector<float> FewDistances;     // [n] that to FewNeighbors of them
  std::vector<unsigned char> MayBeOff; // [n] 1: the point may be off the plane of its neighbours
  double Sparse = 0.0;                 // world units
};
}

bool FindStrayPoints(const CleaningProblem& problem, vtkDataArray* toScanner,
  const StageProgress& progress, std::vector<unsigned char>& stray)
{
  stray.assign(problem.Cloud().Size(), 0);
  if (problem.Total() <= StrayNeighbors)
  {
    return true; // too few to say what is usual
  }
  StrayTest test(problem);
  bool running = test.Measure(progress.Part(0.0, 0.8));
  if (!test.FindSparse(running, toScanner, stray))
  {
    return false;
  }
  const std::vector<unsigned char> sparse = stray;
  running = test.FindBeside(progress.Part(0.8, 0.9), sparse, stray);
  std::vector<unsigned char> hanging(stray.size());
  std::transform(stray.begin(), stray.end(), hanging.begin(),
    [](unsigned char verdict) { return verdict == Stray ? 1 : 0; });
  running = test.FindHanging(running, toScanner, progress.Part(0.9, 1.0), hanging);
  std::transform(stray.begin(), stray.end(), hanging.begin(), stray.begin(),
    [](unsigned char verdict, unsigned char hangs) { return verdict != Stays || hangs ? 1 : 0; });
  return running;
}
}
