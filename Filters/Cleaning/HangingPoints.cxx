// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Cleaning/HangingPoints.h"

#include "Filters/Cleaning/CleaningProblem.h"
#include "Filters/Cleaning/LocalQuadric.h"
#include "Filters/Cleaning/PointSpread.h"
#include "Filters/Common/ArrayTuples.h"
#include "Filters/Common/ParallelFor.h"
#include "Filters/Neighbors/NeighborGraph.h"
#include "Filters/Neighbors/NeighborSearch.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace SurfelGeometry
{
namespace
{
/// A point hangs if its mean distance is so many times the least of its neighbours' and no more
/// than a few of them have it in their plane: by the lower factor if its line of sight says so, by
/// the higher one in a halo. (At ends of wires and at corners it is up to 2.)
constexpr double SparserFactor = 1.5;
constexpr double HaloFactor = 2.25;
constexpr int MostInPlane = 3;

/// A cloud has halos if this share of about so many points hang without a line of sight that says
/// so. (Of scans without halos 0 to 0.3 %: where thin or sparse things are beside dense ones.)
constexpr double HaloShare = 0.005;
constexpr double HaloSamples = 1 << 15;

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
constexpr int LeastCurtainPoints = 6;
constexpr double CurtainReach = 3.0;
constexpr double FlatCurtain = 0.05;
constexpr double CurtainSine = 0.2;

/// A thing that is much sparser than what is beside it has points that are as sparse, of which the
/// nearest are in one plane: a blade of grass before a stone, the ground about it. They are sought
/// among so many neighbours: those whose mean distance is at least this part of the point's. These
/// neighbours are foliage, not surfaces, if their least variance is above this part of the next
/// one: uniform points in a ball have 0.85.
constexpr int HaloNeighbors = 16 * StrayNeighbors;
constexpr float AsSparse = 1.0f / 1.5f;
constexpr double ThickSet = 0.7;

/// Points have the same scanner if their places of it differ by less than this part of the way to
/// it. A curtain is of one scanner: where so many of StrayNeighbors points are as sparse and have
/// another one, or none, these lie in a surface.
constexpr double SamePlace = 0.01;
constexpr int LeastOfOthers = StrayNeighbors / 4;

/// The way to the scanner; NaN if none is known. As floats, which is what other processes get.
Eigen::Vector3d WayOf(const LocalCloud& cloud, int i, vtkDataArray* toScanner)
{
  double way[3] = { NAN, NAN, NAN };
  if (toScanner)
  {
    ReadTuple(toScanner, cloud.InputIds[i], way);
  }
  return Eigen::Vector3f(way[0], way[1], way[2]).cast<double>();
}

/// The unit vector to the scanner. NaN where it is not known.
Eigen::Vector3d SightOf(const LocalCloud& cloud, int i, vtkDataArray* toScanner)
{
  const Eigen::Vector3d sight = WayOf(cloud, i, toScanner).stableNormalized();
  return std::abs(sight.squaredNorm() - 1.0) < 0.5 ? sight : Eigen::Vector3d::Constant(NAN);
}

enum Hanging : unsigned char
{
  NotTested,
  HangsNot,
  InSight, // its line of sight says so
  InHalo   // if the cloud has any
};

class HangingTest
{
public:
  HangingTest(
    const SearchedCloud& searched, const std::vector<float>& distances, vtkDataArray* toScanner)
    : Searched(searched)
    , Distances(distances)
    , ToScanner(toScanner)
  {
  }

  /// Changes `neighbors` and `near`.
  Hanging Find(int i, Neighbors& neighbors, NearCloud& near) const
  {
    int found;
    const int* ids = this->Searched.FindIds(i, StrayNeighbors, neighbors, found);
    float least = this->Distances[i];
    for (int k = 0; k < found; ++k)
    {
      least = std::min(least, this->Distances[ids[k]]);
    }
    if (!(this->Distances[i] > SparserFactor * least))
    {
      return HangsNot;
    }
    const bool inSight = this->HangsInSight(i, least / SpacingsOfDistance, neighbors);
    if (!(inSight || this->Distances[i] > HaloFactor * least) ||
      !this->IsOffSurfaces(i, neighbors, near))
    {
      return HangsNot;
    }
    return inSight ? InSight : this->IsInHalo(i, neighbors, near) ? InHalo : HangsNot;
  }

  /// Whether the hanging points about a point are a surface that is seen from the scanner.
  /// @param hanging a search among them, of whose positions `positions` has three values each
  bool IsInSurface(int i, const NeighborSearch& hanging, const std::vector<float>& positions) const
  {
    const float* p = this->Searched.Cloud.Position(i);
    pcl::Indices ids;
    std::vector<float> squared;
    hanging.nearestKSearch(pcl::PointXYZ(p[0], p[1], p[2]), CurtainPoints, ids, squared);
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
    return IsThin(spread) && std::abs(this->Sight(i).dot(spread.Axes.col(0))) > CurtainSine;
  }

private:
  Eigen::Vector3d Sight(int i) const { return SightOf(this->Searched.Cloud, i, this->ToScanner); }

  /// Whether there is something nearer to the scanner and something farther beside the line of
  /// sight, and less at the depth of the point. False if the scanner is not known.
  bool HangsInSight(int i, double spacing, Neighbors& neighbors) const
  {
    const Eigen::Vector3d sight = this->Sight(i);
    if (sight.hasNaN())
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

  /// Whether a point that hangs is beside surfaces, and in no sheet that is as sparse.
  bool IsInHalo(int i, Neighbors& neighbors, NearCloud& near) const
  {
    this->Searched.Tree->FindNearest(i, HaloNeighbors, neighbors);
    LoadNear(this->Searched.Cloud, i, neighbors, near);
    const Eigen::Vector3d variances = VariancesOf(near);
    return variances[0] < ThickSet * variances[1] &&
      !(LoadAsSparse(this->Searched.Cloud, i, this->Distances, neighbors, near) &&
        IsThin(SpreadOf(near)));
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

/// Whether so many points are in halos that the cloud has them. Collective; false if stopped.
/// @param hangs [n] Hanging; changed where it is not tested, of the points that tell
bool HasHalos(const CleaningProblem& problem, bool running, const HangingTest& test,
  std::vector<unsigned char>& hangs)
{
  const double total = std::max(HaloSamples, static_cast<double>(problem.Total()));
  const std::vector<int> samples = problem.Samples(HaloSamples / total);
  std::vector<float> inHalo(samples.size());
  ParallelFor(0, static_cast<vtkIdType>(samples.size()), [&](vtkIdType k, vtkIdType end) {
    Neighbors neighbors;
    NearCloud near;
    for (; k < end; ++k)
    {
      unsigned char& found = hangs[samples[k]];
      found = found == NotTested ? test.Find(samples[k], neighbors, near) : found;
      inHalo[k] = found == InHalo ? 1.0f : 0.0f;
    }
  });
  return problem.Gather(running, inHalo) &&
    std::accumulate(inHalo.begin(), inHalo.end(), 0.0) >
    HaloShare * static_cast<double>(inHalo.size());
}
}

bool IsThin(const PointSpread& spread)
{
  return spread.Variances[0] < FlatCurtain * spread.Variances[1];
}

bool LoadAsSparse(const LocalCloud& cloud, int i, const std::vector<float>& distances,
  const Neighbors& neighbors, NearCloud& near)
{
  const float *p = cloud.Position(i), least = AsSparse * distances[i];
  near.clear();
  near.push_back(pcl::PointXYZ(0.0f, 0.0f, 0.0f));
  for (size_t k = 0; k < neighbors.Ids.size() && near.size() < CurtainPoints; ++k)
  {
    const int j = neighbors.Ids[k];
    if (distances[j] > least)
    {
      const float* q = cloud.Position(j);
      near.push_back(pcl::PointXYZ(q[0] - p[0], q[1] - p[1], q[2] - p[2]));
    }
  }
  return near.size() >= LeastCurtainPoints;
}

bool IsCurtain(const LocalCloud& cloud, int i, const std::vector<int>& sparse,
  vtkDataArray* toScanner, const PointSpread& spread)
{
  if (!(std::abs(SightOf(cloud, i, toScanner).dot(spread.Axes.col(0))) < CurtainSine))
  {
    return false;
  }
  const auto placeOf = [&](int j) {
    const Eigen::Vector3f p(cloud.Position(j));
    return Eigen::Vector3d(p.cast<double>() + WayOf(cloud, j, toScanner));
  };
  const Eigen::Vector3d place = placeOf(i);
  const double limit = SamePlace * WayOf(cloud, i, toScanner).norm();
  const auto others = std::count_if(
    sparse.begin(), sparse.end(), [&](int j) { return !((placeOf(j) - place).norm() < limit); });
  return others < LeastOfOthers;
}

bool FindHangingPoints(const CleaningProblem& problem, bool running,
  const std::vector<float>& distances, vtkDataArray* toScanner, const StageProgress& progress,
  std::vector<unsigned char>& stray)
{
  const SearchedCloud& searched = problem.Searched;
  const HangingTest test(searched, distances, toScanner);
  std::vector<unsigned char> hangs(stray.size());
  std::transform(stray.begin(), stray.end(), hangs.begin(),
    [](unsigned char isStray) { return isStray ? HangsNot : NotTested; });
  const bool hasHalos = HasHalos(problem, running, test, hangs);
  if (!running || !(hasHalos || toScanner))
  {
    return running;
  }
  const int count = searched.Cloud.Size();
  running = ParallelFor(count, progress.Part(0.0, 0.9), [&](vtkIdType begin, vtkIdType end) {
    Neighbors neighbors;
    NearCloud near;
    for (int i = static_cast<int>(begin); i < end; ++i)
    {
      const unsigned char found = hangs[i] == NotTested ? test.Find(i, neighbors, near) : hangs[i];
      hangs[i] = found == InSight || (found == InHalo && hasHalos) ? 1 : 0;
    }
  });
  std::vector<float> positions;
  for (int i = 0; i < count; ++i)
  {
    if (hangs[i])
    {
      const float* p = searched.Cloud.Position(i);
      positions.insert(positions.end(), p, p + 3);
    }
  }
  if (!running || positions.empty())
  {
    return running;
  }
  const NeighborSearch hanging(positions.data(), static_cast<int>(positions.size() / 3));
  return ParallelFor(count, progress.Part(0.9, 1.0), [&](vtkIdType begin, vtkIdType end) {
    for (int i = static_cast<int>(begin); i < end; ++i)
    {
      if (hangs[i] && !test.IsInSurface(i, hanging, positions))
      {
        stray[i] = 1;
      }
    }
  });
}
}
