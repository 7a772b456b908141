// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Estimation/SharpNormals.h"

#include "Filters/Estimation/PrincipalPlane.h"
#include "Filters/Neighbors/LocalCloud.h"
#include "Filters/Neighbors/NeighborGraph.h"

#include <Eigen/Cholesky>

#include <cmath>
#include <limits>
#include <vector>

namespace SurfelGeometry
{
namespace
{
/// Neighbourhoods flatter than this have no edge that is worth a test: across the middle of an edge
/// of 30 degrees, two half planes have about tan^2(15 degrees) / 4, 0.018.
constexpr double LeastFlatness = 0.015;

/// The plane of one side has so much of the variance that all neighbours have along their normal.
constexpr double PlaneShare = 0.2;

/// A plane is better than a smooth surface if its points are off it by so much of the variance
/// that they have about a quadric through all neighbours. With 1/2, up to 0.9 % of the normals of
/// spheres and tubes with little noise change, with 1/4 0.16 %.
constexpr double SmoothShare = 0.25;

/// Points lie in a plane if they are no farther off than so many deviations of its points, and a
/// part of a spacing for planes without noise.
constexpr double PlaneReach = 2.5, LeastReach = 0.07;

/// Fewer neighbours, or variances in the plane farther from a disc's, make no plane.
constexpr int FewestInPlane = 5;
constexpr double LeastRoundness = 0.06;

/// Cosine between the planes before and after they are fitted to their points, and between the mean
/// normal and that of one side, at least: edges up to 150 degrees have no others.
constexpr double SteadyCosine = 0.9, LeastSharpCosine = 0.25;

/// In a second round the planes of the first reach what is nearer to the edge. Of the normals half
/// a spacing from an edge of 110 degrees, 17 % are wrong after one and 7 % after two; a third round
/// gains nothing.
constexpr int SharpRounds = 2;

/// Edges are long. A normal stays sharp if of its nearest neighbours at most so many lie in no
/// plane.
constexpr int Voters = 12, MostRound = 4;

/// A plane seen from a point.
struct SidePlane
{
  Vector3 Normal;
  double Height = 0.0;   // over the point, along Normal
  double Variance = 0.0; // of its points along Normal
};

/// The variance that the points of a fit have along its normal: with 16 neighbours in a disc, the
/// spacing squared is 4 pi / 16 of the tangential one.
double VarianceOf(const PlaneFit& fit)
{
  return 4.0 / Pi * fit.Flatness * fit.Spacing * fit.Spacing;
}

bool HasPlane(const PlaneFit& fit)
{
  return fit.HasPlane() && !fit.OnPlate;
}

bool MayBeAtEdge(const PlaneFit& fit)
{
  return fit.Flatness > LeastFlatness && !fit.Given && HasPlane(fit);
}

/// Finds the sides of edges. Each thread has one.
class SideFinder
{
public:
  SideFinder(const OrientedCloud& oriented, const PlaneFits& fits)
    : Cloud(oriented.Cloud)
    , Graph(oriented.Graph)
    , Fits(fits)
  {
  }

  /// The fit of point i, with the normal of its side if it is beside an edge.
  PlaneFit Sharpened(int i)
  {
    PlaneFit fit = this->Fits[i];
    SidePlane plane;
    if (!this->FindPlane(i, plane))
    {
      return fit;
    }
    const Vector3 found = plane.Normal;
    const bool isPlane = this->FitToPoints(i, plane) && this->FitToPoints(i, plane) &&
      Dot(plane.Normal, found) >= SteadyCosine;
    const double cosine = Dot(plane.Normal, fit.Normal);
    if (!isPlane || std::abs(cosine) < LeastSharpCosine ||
      !(plane.Variance < PlaneShare * VarianceOf(fit)) ||
      !(plane.Variance < SmoothShare * this->VarianceAboutQuadric(i)))
    {
      return fit;
    }
    fit.Normal = std::copysign(1.0, cosine) * plane.Normal;
    Vector3 u, v;
    TangentFrame(fit.Normal, u, v);
    const Vector3 axis = fit.AxisU, normal = fit.Normal;
    fit.AxisU = Normalized(axis - Dot(axis, normal) * normal, u);
    fit.Flatness *= static_cast<float>(plane.Variance / VarianceOf(fit));
    fit.Sharp = true;
    return fit;
  }

private:
  /// Calls visit(j, way from i to j) for all neighbours of point i.
  template <class Visit>
  void ForNeighbors(int i, const Visit& visit) const
  {
    const Vector3 p = Load(this->Cloud.Position(i));
    const int* ids = this->Graph.Row(static_cast<std::size_t>(i));
    for (int k = 0; k < KeptNeighbors && ids[k] >= 0; ++k)
    {
      visit(ids[k], Load(this->Cloud.Position(ids[k])) - p);
    }
  }

  /// How far points of a plane may be off it, squared.
  double SquaredReach(int i, double variance) const
  {
    const double least = LeastReach * this->Fits[i].Spacing;
    return PlaneReach * PlaneReach * variance + least * least;
  }

  /// Of the neighbours' planes, that in which point i lies best. False if it lies in none.
  bool FindPlane(int i, SidePlane& best) const
  {
    const double most = PlaneShare * VarianceOf(this->Fits[i]);
    double least = std::numeric_limits<double>::infinity();
    this->ForNeighbors(i, [&](int j, const Vector3& way) {
      const PlaneFit& other = this->Fits[j];
      const double variance = VarianceOf(other);
      const double height = Dot(way, other.Normal), squared = height * height;
      // Both the point and the neighbour are off the plane.
      const bool isInside = squared < 2.0 * this->SquaredReach(i, variance);
      if (HasPlane(other) && variance < most && isInside && variance + squared < least)
      {
        least = variance + squared;
        best = { other.Normal, height, variance };
      }
    });
    return std::isfinite(least);
  }

  /// Fits the plane to the neighbours that lie in it. False if they, or the point, make no plane.
  bool FitToPoints(int i, SidePlane& plane)
  {
    const double reach = this->SquaredReach(i, plane.Variance);
    Vector3 sum{};
    this->InPlane.clear();
    this->ForNeighbors(i, [&](int j, const Vector3& way) {
      const double height = Dot(way, plane.Normal) - plane.Height;
      if (height * height < reach)
      {
        this->InPlane.push_back(j);
        sum = sum + way;
      }
    });
    const auto count = static_cast<int>(this->InPlane.size());
    if (count < FewestInPlane)
    {
      return false;
    }
    this->Points.Load(this->Cloud, i, this->InPlane.data(), count);
    const Principal principal(this->Points.Covariance());
    const Vector3 normal = Normalized(ToVector(principal.Normal), plane.Normal);
    plane.Normal = std::copysign(1.0, Dot(normal, plane.Normal)) * normal;
    plane.Height = Dot(sum, plane.Normal) / (count + 1.0);
    plane.Variance = std::max(principal.Variances[0], 0.0);
    return principal.Variances[1] > LeastRoundness * principal.Variances[2] &&
      plane.Height * plane.Height < this->SquaredReach(i, plane.Variance);
  }

  /// Variance of the points of the last plane about a quadric, over the mean plane, through point i
  /// and all neighbours.
  double VarianceAboutQuadric(int i) const
  {
    using Terms = Eigen::Matrix<double, 6, 1>;
    const PlaneFit& fit = this->Fits[i];
    const Vector3 p = Load(this->Cloud.Position(i)), normal = fit.Normal;
    const double scale = 1.0 / fit.Spacing;
    Vector3 u, v;
    TangentFrame(normal, u, v);
    const auto termsAt = [&](const Vector3& way) {
      const double x = scale * Dot(way, u), y = scale * Dot(way, v);
      return (Terms() << 1.0, x, y, x * x, x * y, y * y).finished();
    };
    Eigen::Matrix<double, 6, 6> products = termsAt({}) * termsAt({}).transpose();
    Terms climbs = Terms::Zero();
    this->ForNeighbors(i, [&](int, const Vector3& way) {
      const Terms terms = termsAt(way);
      products += terms * terms.transpose();
      climbs += scale * Dot(way, normal) * terms;
    });
    const Terms quadric = products.ldlt().solve(climbs);
    double rest = quadric[0] * quadric[0];
    for (const int j : this->InPlane)
    {
      const Vector3 way = Load(this->Cloud.Position(j)) - p;
      const double height = scale * Dot(way, normal) - quadric.dot(termsAt(way));
      rest += height * height;
    }
    return rest / (scale * scale * static_cast<double>(this->InPlane.size()));
  }

  const LocalCloud& Cloud;
  const NeighborGraph& Graph;
  const PlaneFits& Fits;
  Patch Points;
  std::vector<int> InPlane; // neighbours
};

/// Whether too many neighbours of point i lie in no plane.
bool IsRound(const NeighborGraph& graph, const PlaneFits& fits, int i)
{
  const int* ids = graph.Row(static_cast<std::size_t>(i));
  int count = 0;
  for (int k = 0; k < Voters && ids[k] >= 0; ++k)
  {
    count += !fits[ids[k]].Sharp && fits[ids[k]].Flatness > LeastFlatness ? 1 : 0;
  }
  return count > MostRound;
}

/// The points that may be beside an edge, and their fits.
struct EdgeFits
{
  std::vector<int> Ids;
  PlaneFits Fits;

  explicit EdgeFits(const PlaneFits& all)
  {
    for (std::size_t i = 0; i < all.size(); ++i)
    {
      if (MayBeAtEdge(all[i]))
      {
        this->Ids.push_back(static_cast<int>(i));
        this->Fits.push_back(all[i]);
      }
    }
  }

  void Write(PlaneFits& all) const
  {
    for (std::size_t k = 0; k < this->Ids.size(); ++k)
    {
      all[this->Ids[k]] = this->Fits[k];
    }
  }
};
}

bool SharpenNormals(const OrientedCloud& oriented, const StageProgress& progress, PlaneFits& fits)
{
  const EdgeFits round(fits);
  const auto count = static_cast<vtkIdType>(round.Ids.size());
  EdgeFits edges = round;
  for (int k = 0; k < SharpRounds; ++k)
  {
    const auto sharpen = [&](vtkIdType begin, vtkIdType end) {
      SideFinder finder(oriented, fits);
      for (vtkIdType e = begin; e < end; ++e)
      {
        edges.Fits[e] = finder.Sharpened(edges.Ids[e]);
      }
    };
    if (!ParallelFor(
          count, progress.Part(k / (SharpRounds + 1.0), (k + 1) / (SharpRounds + 1.0)), sharpen))
    {
      return false;
    }
    edges.Write(fits); // first all are read, then all are changed
  }
  const auto check = [&](vtkIdType begin, vtkIdType end) {
    for (vtkIdType e = begin; e < end; ++e)
    {
      const bool isRound = IsRound(oriented.Graph, fits, edges.Ids[e]);
      edges.Fits[e] = isRound ? round.Fits[e] : edges.Fits[e];
      // Of all neighbours, as before: it tells other steps where edges are.
      edges.Fits[e].Flatness = round.Fits[e].Flatness;
    }
  };
  if (!ParallelFor(count, progress.Part(SharpRounds / (SharpRounds + 1.0), 1.0), check))
  {
    return false;
  }
  edges.Write(fits);
  return true;
}
}
