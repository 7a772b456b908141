// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Orientation/ThinPlates.h"

#include "Filters/Neighbors/LatticeStep.h"
#include "Filters/Neighbors/LocalCloud.h"
#include "Filters/Orientation/HeightCuts.h"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <array>

namespace SurfelGeometry
{
namespace
{
/// Flatter neighbourhoods are of one sheet. Two sheets a distance g apart have the variance g^2 / 4
/// across and, at 16 neighbours of spacing s of both, 16 s^2 / (4 pi) along: 0.1 is g = 0.7 s.
constexpr double MinFlatness = 0.1;

/// Largest deviation of the heights within the sheets, over the distance of the sheets. Noise of
/// one sheet does not pass: cut in halves, its heights have 0.38 (normal) or 0.29 (uniform).
constexpr double MaxDeviation = 0.18;

/// Smallest distance of the sheets, in spacings of both together. Closer ones are noise or
/// quantised coordinates.
constexpr double MinGap = 0.7;

/// Smallest distance in steps of the lattice on which the points are, if they are on one: a surface
/// between two layers of voxels has points in both.
constexpr double MinSteps = 1.5;

/// The sheets cover each other: largest distance of their centres along the plane, over the rms
/// distance of the points from the middle. On the two sides of a step it is above 1.
constexpr double MaxShift = 0.7;

/// Normals to start from: of the planes through the point and two of its nearest neighbours.
constexpr int NearestOfTriples = 5;
constexpr double MinTripleSine = 0.5;
constexpr int Refinements = 2;

/// The point's own normal, and those of the planes through it and two of these neighbours.
constexpr int MaxCandidates = 1 + NearestOfTriples * (NearestOfTriples - 1) / 2;

class PlateFit
{
public:
  /// The point itself is number 0, at zero.
  PlateFit(const LocalCloud& cloud, int i, const int* row)
  {
    const Vector3 p = Load(cloud.Position(i));
    this->Points.At[this->Points.Count++] = {};
    for (int k = 0; k < KeptNeighbors && row[k] >= 0; ++k)
    {
      this->Points.At[this->Points.Count++] = Load(cloud.Position(row[k])) - p;
    }
  }

  /// The outward normal in `normal`, if the points are on a plate.
  /// @param leastGap smallest distance of its sheets, world units
  bool Find(double leastGap, Vector3& normal) const
  {
    if (this->Points.Count < 2 * MinOnSheet)
    {
      return false;
    }
    Split best = this->CutByPlanes(leastGap, normal);
    for (int step = 0; step < Refinements; ++step)
    {
      const Vector3 common = this->CommonNormal(normal, best.Limit);
      Split split;
      CutHeights(this->Points, &common, 1, &split);
      if (!IsBetter(split, best))
      {
        break; // and so would be the next one
      }
      best = split;
      normal = common;
    }
    if (!AreTwoSheets(best, leastGap) || !this->Covers(normal, best.Limit))
    {
      return false;
    }
    normal = best.Limit < 0.0 ? normal : -1.0 * normal; // the point itself has the height 0
    return true;
  }

private:
  static bool AreTwoSheets(const Split& split, double leastGap)
  {
    return split.Gap >= leastGap &&
      split.Within <= MaxDeviation * MaxDeviation * split.Gap * split.Gap;
  }

  static bool IsBetter(const Split& a, const Split& b)
  {
    return a.Within * b.Gap * b.Gap < b.Within * a.Gap * a.Gap;
  }

  /// The best cut along `normal` and the normals of planes through near neighbours, or the first
  /// one that parts two sheets. Its direction goes to `normal`.
  Split CutByPlanes(double leastGap, Vector3& normal) const
  {
    std::array<Vector3, MaxCandidates> candidates;
    const int count = this->FindCandidates(normal, candidates);
    std::array<Split, CutLanes> splits;
    Split best;
    for (int c = 0; c < count && !AreTwoSheets(best, leastGap); ++c)
    {
      const int lane = c % CutLanes;
      if (lane == 0)
      {
        CutHeights(this->Points, &candidates[c], std::min(count - c, CutLanes), splits.data());
      }
      if (c == 0 || IsBetter(splits[lane], best))
      {
        best = splits[lane];
        normal = candidates[c];
      }
    }
    return best;
  }

  /// Returns their number.
  int FindCandidates(const Vector3& normal, std::array<Vector3, MaxCandidates>& candidates) const
  {
    const std::array<Vector3, KeptNeighbors + 1>& at = this->Points.At;
    int count = 0;
    candidates[count++] = normal;
    for (int a = 1; a < NearestOfTriples; ++a)
    {
      for (int b = a + 1; b <= NearestOfTriples; ++b)
      {
        const Vector3 across = Cross(at[a], at[b]);
        const double area = Norm(across);
        if (area > MinTripleSine * Norm(at[a]) * Norm(at[b]))
        {
          candidates[count++] = (1.0 / area) * across;
        }
      }
    }
    return count;
  }

  /// Normal of two parallel planes through the two parts.
  Vector3 CommonNormal(const Vector3& normal, double limit) const
  {
    std::array<Vector3, 2> sums{};
    std::array<int, 2> counts{};
    for (int k = 0; k < this->Points.Count; ++k)
    {
      const int part = Dot(this->Points.At[k], normal) > limit ? 1 : 0;
      sums[part] = sums[part] + this->Points.At[k];
      ++counts[part];
    }
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    for (int k = 0; k < this->Points.Count; ++k)
    {
      const int part = Dot(this->Points.At[k], normal) > limit ? 1 : 0;
      const Vector3 d = this->Points.At[k] - (1.0 / counts[part]) * sums[part];
      const Eigen::Vector3d e(d[0], d[1], d[2]);
      covariance.noalias() += e * e.transpose();
    }
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
    eigen.computeDirect(covariance);
    const Eigen::Vector3d n = eigen.eigenvectors().col(0);
    return Normalized({ n[0], n[1], n[2] }, normal);
  }

  /// Whether both parts are about the same place.
  bool Covers(const Vector3& normal, double limit) const
  {
    std::array<Vector3, 2> sums{};
    std::array<int, 2> counts{};
    double squares = 0.0;
    for (int k = 0; k < this->Points.Count; ++k)
    {
      const double height = Dot(this->Points.At[k], normal);
      const Vector3 flat = this->Points.At[k] - height * normal;
      const int part = height > limit ? 1 : 0;
      sums[part] = sums[part] + flat;
      ++counts[part];
      squares += Dot(flat, flat);
    }
    const Vector3 middle = (1.0 / this->Points.Count) * (sums[0] + sums[1]);
    const Vector3 shift = (1.0 / counts[1]) * sums[1] - (1.0 / counts[0]) * sums[0];
    const double variance = squares / this->Points.Count - Dot(middle, middle);
    return Dot(shift, shift) <= MaxShift * MaxShift * variance;
  }

  PlatePoints Points;
};
}

bool TurnPlatesOutward(const LocalCloud& cloud, const NeighborGraph& graph,
  const StageProgress& progress, PlaneFits& fits)
{
  const double leastGap = MinSteps * LatticeStep(cloud, graph);
  return ParallelFor(cloud.Size(), progress, [&](vtkIdType begin, vtkIdType end) {
    for (vtkIdType i = begin; i < end; ++i)
    {
      PlaneFit& fit = fits[i];
      if (fit.Flatness < MinFlatness || fit.SideGiven || !fit.HasPlane())
      {
        continue;
      }
      Vector3 normal = fit.Normal;
      if (PlateFit(cloud, static_cast<int>(i), graph.Row(i))
            .Find(std::max(leastGap, MinGap * fit.Spacing), normal))
      {
        fit.Normal = normal;
        fit.OnPlate = true;
      }
    }
  });
}
}
