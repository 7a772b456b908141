// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Estimation/GivenNormals.h"

#include "Filters/Common/ParallelFor.h"
#include "Filters/Common/VectorMath.h"
#include "Filters/Estimation/PrincipalPlane.h"
#include "Filters/Neighbors/NeighborGraph.h"
#include "Filters/Neighbors/NeighborSearch.h"

#include <cmath>
#include <cstddef>
#include <numeric>

namespace SurfelGeometry
{
namespace
{
constexpr double SampledNormals = 8192.0; // about
constexpr int FewestJudged = 64;          // points in planes; fewer tell nothing
constexpr int PlaneNeighbors = 16;
constexpr int SideNeighbors = 8; // whose signs are compared with that of a point

/// Neighbours are in a plane with this variance across it at most, over the smaller one in it, and
/// this ratio of the two in it at least: blades of grass have signs of their own.
constexpr double FlatLimit = 0.02, WideLimit = 0.2;

/// Given normals are off the plane if the cosine is less than this. Of good ones 0 to 2 % are, of
/// grass 15 %; of those with noise of 23 degrees 31 %, of those that are all alike in a scene with
/// floor and walls 56 %.
constexpr double AcrossCosine = 0.9, MostAskew = 0.25;

/// Two normals are those of one sheet if their cosine, but for the sign, is at least SideCosine,
/// and the way between the points climbs by SideClimb of its length at most: not from one side of a
/// leaf to the other. Of those in trees, whose leaves were seen from either side, 0.06 % have
/// opposite signs; where half of a statue is turned, 0.25 %.
constexpr double SideCosine = 0.8, SideClimb = 0.1, MostOpposite = 0.001;

/// A point that has another this near, as a part of the distance of its neighbours, with the
/// opposite normal, is one of both sides of a sheet. The order of its neighbours tells nothing.
constexpr double BackDistance = 0.01;

struct NormalsTally
{
  int Judged = 0, Off = 0, Pairs = 0, Opposite = 0;

  NormalsTally operator+(const NormalsTally& other) const
  {
    return { this->Judged + other.Judged, this->Off + other.Off, this->Pairs + other.Pairs,
      this->Opposite + other.Opposite };
  }
};

/// Looks at points one after another. Each thread has its own.
class NormalsJudge
{
public:
  NormalsJudge(const SearchedCloud& searched, const std::vector<float>& given)
    : Searched(searched)
    , Given(given)
  {
  }

  NormalsTally Look(int i)
  {
    NormalsTally tally;
    const Vector3 normal = this->NormalOf(i);
    this->Searched.Find(i, PlaneNeighbors, this->Around);
    if (!(Dot(normal, normal) > 0.0) || this->Around.Count() < PlaneNeighbors)
    {
      return tally;
    }
    this->Near.Load(this->Searched.Cloud, i, this->Around.Ids.data(), PlaneNeighbors);
    const Principal plane(this->Near.Covariance());
    const Eigen::Vector3d& v = plane.Variances;
    if (!(v[0] < FlatLimit * v[1] && v[1] > WideLimit * v[2]))
    {
      return tally;
    }
    tally.Judged = 1;
    tally.Off = std::abs(Dot(normal, ToVector(plane.Normal))) < AcrossCosine ? 1 : 0;
    if (!this->HasBack(normal))
    {
      this->CompareSides(i, normal, tally);
    }
    return tally;
  }

private:
  Vector3 NormalOf(int i) const { return Load(this->Given.data() + 3 * static_cast<size_t>(i)); }

  bool HasBack(const Vector3& normal) const
  {
    const std::vector<float>& squares = this->Around.SquaredDistances;
    return squares[0] < BackDistance * BackDistance * squares[SideNeighbors - 1] &&
      Dot(normal, this->NormalOf(this->Around.Ids[0])) < 0.0;
  }

  void CompareSides(int i, const Vector3& normal, NormalsTally& tally) const
  {
    const LocalCloud& cloud = this->Searched.Cloud;
    const Vector3 p = Load(cloud.Position(i));
    for (int k = 0; k < SideNeighbors; ++k)
    {
      const int j = this->Around.Ids[k];
      const double cosine = Dot(normal, this->NormalOf(j));
      const double climb = Dot(normal, Load(cloud.Position(j)) - p);
      if (std::abs(cosine) > SideCosine &&
        climb * climb < SideClimb * SideClimb * this->Around.SquaredDistances[k])
      {
        ++tally.Pairs;
        tally.Opposite += cosine < 0.0 ? 1 : 0;
      }
    }
  }

  const SearchedCloud& Searched;
  const std::vector<float>& Given;
  Neighbors Around;
  Patch Near;
};
}

NormalsUse JudgeNormals(const SearchedCloud& searched, const std::vector<float>& given)
{
  const LocalCloud& cloud = searched.Cloud;
  const std::vector<int> sample = SamplePoints(cloud, SampledNormals / cloud.Size());
  std::vector<NormalsTally> tallies(sample.size());
  ParallelFor(0, static_cast<vtkIdType>(sample.size()), [&](vtkIdType k, vtkIdType end) {
    NormalsJudge judge(searched, given);
    for (; k < end; ++k)
    {
      tallies[k] = judge.Look(sample[static_cast<size_t>(k)]);
    }
  });
  const NormalsTally sum = std::accumulate(tallies.begin(), tallies.end(), NormalsTally());
  if (sum.Judged >= FewestJudged && sum.Off > MostAskew * sum.Judged)
  {
    return NormalsUse::Dropped;
  }
  return sum.Pairs >= FewestJudged && sum.Opposite > MostOpposite * sum.Pairs
    ? NormalsUse::WithoutSides
    : NormalsUse::Kept;
}
}
