// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Orientation/ThinPlates.h"

#include "Filters/Common/LocalCloud.h"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace SurfelGeometry
{
namespace
{
/// Flatter neighbourhoods are of one sheet. Two sheets a distance g apart have the variance g^2 / 4
/// across and, at 16 neighbours of spacing s of both, 16 s^2 / (4 pi) along: 0.1 is g = 0.7 s.
constexpr double MinFlatness = 0.1;

/// Smallest number of points on either sheet, the point itself included.
constexpr int MinOnSheet = 4;

/// Largest deviation of the heights within the sheets, over the distance of the sheets. Noise of
/// one sheet does not pass: cut in halves, its heights have 0.38 (normal) or 0.29 (uniform).
constexpr double MaxDeviation = 0.18;

/// Smallest distance of the sheets, in spacings of both together. Closer ones are noise or
/// quantised coordinates.
constexpr double MinGap = 0.7;

/// The sheets cover each other: largest distance of their centres along the plane, over the rms
/// distance of the points from the middle. On the two sides of a step it is above 1.
constexpr double MaxShift = 0.7;

/// Normals to start from: of the planes through the point and two of its nearest neighbours.
constexpr int NearestOfTriples = 5;
constexpr double MinTripleSine = 0.5;
constexpr int Refinements = 2;

constexpr int MaxPoints = KeptNeighbors + 1;

/// Points cut in two by their heights along a direction.
struct Split
{
  double Within = std::numeric_limits<double>::infinity(); // variance of the heights in the parts
  double Gap = 0.0;                                        // distance of the parts' means
  double Limit = 0.0;                                      // height of the cut
};

class PlateFit
{
public:
  /// The point itself is number 0, at zero.
  PlateFit(const LocalCloud& cloud, int i, const int* row)
  {
    const Vector3 p = Load(cloud.Position(i));
    this->Points[this->Count++] = {};
    for (int k = 0; k < KeptNeighbors && row[k] >= 0; ++k)
    {
      this->Points[this->Count++] = Load(cloud.Position(row[k])) - p;
    }
  }

  /// The outward normal in `normal`, if the points are on a plate.
  bool Find(double spacing, Vector3& normal) const
  {
    if (this->Count < 2 * MinOnSheet)
    {
      return false;
    }
    Split best = this->Cut(normal);
    for (int a = 1; a < NearestOfTriples && !AreTwoSheets(best, spacing); ++a)
    {
      for (int b = a + 1; b <= NearestOfTriples && !AreTwoSheets(best, spacing); ++b)
      {
        const Vector3 across = Cross(this->Points[a], this->Points[b]);
        const double area = Norm(across);
        if (area > MinTripleSine * Norm(this->Points[a]) * Norm(this->Points[b]))
        {
          this->Improve((1.0 / area) * across, normal, best);
        }
      }
    }
    for (int step = 0; step < Refinements; ++step)
    {
      this->Improve(this->CommonNormal(normal, best.Limit), normal, best);
    }
    if (!AreTwoSheets(best, spacing) || !this->Covers(normal, best.Limit))
    {
      return false;
    }
    normal = best.Limit < 0.0 ? normal : -1.0 * normal; // the point itself has the height 0
    return true;
  }

private:
  static bool AreTwoSheets(const Split& split, double spacing)
  {
    return split.Gap >= MinGap * spacing &&
      split.Within <= MaxDeviation * MaxDeviation * split.Gap * split.Gap;
  }

  /// The cut that leaves the least variance (k-means of two clusters in one dimension, exact).
  Split Cut(const Vector3& normal) const
  {
    std::array<double, MaxPoints> heights;
    double sum = 0.0, squares = 0.0;
    for (int k = 0; k < this->Count; ++k)
    {
      heights[k] = Dot(this->Points[k], normal);
      sum += heights[k];
      squares += heights[k] * heights[k];
    }
    std::sort(heights.begin(), heights.begin() + this->Count);
    Split best;
    double below = 0.0;
    for (int k = 1; k <= this->Count - MinOnSheet; ++k)
    {
      below += heights[k - 1];
      const double above = sum - below;
      const double within =
        (squares - below * below / k - above * above / (this->Count - k)) / this->Count;
      if (k >= MinOnSheet && within < best.Within)
      {
        best = { std::max(0.0, within), above / (this->Count - k) - below / k,
          0.5 * (heights[k - 1] + heights[k]) };
      }
    }
    return best;
  }

  void Improve(const Vector3& candidate, Vector3& normal, Split& best) const
  {
    const Split split = this->Cut(candidate);
    if (split.Within * best.Gap * best.Gap < best.Within * split.Gap * split.Gap)
    {
      best = split;
      normal = candidate;
    }
  }

  /// Normal of two parallel planes through the two parts.
  Vector3 CommonNormal(const Vector3& normal, double limit) const
  {
    std::array<Vector3, 2> sums{};
    std::array<int, 2> counts{};
    for (int k = 0; k < this->Count; ++k)
    {
      const int part = Dot(this->Points[k], normal) > limit ? 1 : 0;
      sums[part] = sums[part] + this->Points[k];
      ++counts[part];
    }
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    for (int k = 0; k < this->Count; ++k)
    {
      const int part = Dot(this->Points[k], normal) > limit ? 1 : 0;
      const Vector3 d = this->Points[k] - (1.0 / counts[part]) * sums[part];
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
    for (int k = 0; k < this->Count; ++k)
    {
      const double height = Dot(this->Points[k], normal);
      const Vector3 flat = this->Points[k] - height * normal;
      const int part = height > limit ? 1 : 0;
      sums[part] = sums[part] + flat;
      ++counts[part];
      squares += Dot(flat, flat);
    }
    const Vector3 middle = (1.0 / this->Count) * (sums[0] + sums[1]);
    const Vector3 shift = (1.0 / counts[1]) * sums[1] - (1.0 / counts[0]) * sums[0];
    const double variance = squares / this->Count - Dot(middle, middle);
    return Dot(shift, shift) <= MaxShift * MaxShift * variance;
  }

  std::array<Vector3, MaxPoints> Points;
  int Count = 0;
};
}

bool TurnPlatesOutward(const LocalCloud& cloud, const NeighborGraph& graph,
  const StageProgress& progress, PlaneFits& fits)
{
  return ParallelFor(cloud.Size(), progress, [&](vtkIdType begin, vtkIdType end) {
    for (vtkIdType i = begin; i < end; ++i)
    {
      PlaneFit& fit = fits[i];
      if (fit.Flatness < MinFlatness || fit.Given || fit.Isolated || fit.Degenerate)
      {
        continue;
      }
      Vector3 normal = fit.Normal;
      if (PlateFit(cloud, static_cast<int>(i), graph.Row(i)).Find(fit.Spacing, normal))
      {
        fit.Normal = normal;
        fit.OnPlate = true;
      }
    }
  });
}
}
