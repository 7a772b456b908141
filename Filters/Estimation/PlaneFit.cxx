// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Estimation/PlaneFit.h"

#include "Filters/Common/LocalCloud.h"
#include "Filters/Common/NeighborSearch.h"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>

namespace SurfelGeometry
{
namespace
{
/// Below this ratio of the two larger variances the neighbours are a line: one scan line of a
/// cloud whose lines are far apart. More neighbours are asked for, to see the next line.
constexpr double LineRatio = 0.02;
constexpr int LineGrowth = 4;

/// Below this ratio they are a line even so, and the normal about it is arbitrary.
constexpr double CollinearRatio = 1e-6;

/// A line of points of pitch p gets the area p^2 a point if its variance across is this many
/// p^2: along, n points have p^2 n^2 / 12, and area = 4 pi sqrt(product) / n gives
/// 12 / (16 pi^2).
constexpr double LineVariance = 12.0 / (16.0 * 9.8696044);

/// A neighbour is of the same sheet if the normals' cosine is at least this (signed between
/// one-sided points) and the edge to it climbs no more than this out of the tangent plane (sine).
constexpr double SheetCosine = 0.3;
constexpr double SheetClimb = 0.6;

/// A neighbourhood is mixed if this many of the GraphDegree nearest are of another sheet.
constexpr int MixedNeighbors = 3;

/// Covariance of point i and its neighbours, de-meaned, over the number of neighbours: an
/// unbiased estimate, and with the point itself, which sits in the middle, and the outermost
/// neighbour, which sits on the rim, exactly r^2/4 an axis in a disc of radius r.
Eigen::Matrix3d Covariance(const LocalCloud& cloud, int i, const Neighbors& neighbors)
{
  const Vector3 p = Load(cloud.Position(i));
  const int count = neighbors.Count();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  for (const int j : neighbors.Ids)
  {
    // Differences to the point itself: exact where neighbours are near each other.
    const Vector3 d = Load(cloud.Position(j)) - p;
    const Eigen::Vector3d e(d[0], d[1], d[2]);
    sum += e;
    squares.noalias() += e * e.transpose();
  }
  return (squares - sum * sum.transpose() / (count + 1.0)) / std::max(count, 1);
}

Vector3 ToVector(const Eigen::Vector3d& a)
{
  return { a[0], a[1], a[2] };
}

class Fitter
{
public:
  Fitter(const LocalCloud& cloud, const NeighborSearch& tree, const FitSettings& settings)
    : Cloud(cloud)
    , Tree(tree)
    , Settings(settings)
  {
  }

  PlaneFit Fit(int i, const float* given, int* graph, Neighbors& neighbors) const
  {
    this->FindAndKeep(i, graph, neighbors);
    Eigen::Matrix3d covariance = Covariance(this->Cloud, i, neighbors);
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
    eigen.computeDirect(covariance);
    PlaneFit fit;
    fit.Reach = ReachOf(neighbors);
    if (neighbors.Count() >= 3 && eigen.eigenvalues()[1] < LineRatio * eigen.eigenvalues()[2])
    {
      this->Find(i, LineGrowth, neighbors);
      covariance = Covariance(this->Cloud, i, neighbors);
      eigen.computeDirect(covariance);
    }
    this->SetNormal(eigen, given, fit);
    this->SetExtent(covariance, neighbors, fit);
    return fit;
  }

  /// Spacing and extent of point i from the neighbours for which isOfSheet(j).
  template <typename Test>
  void Refit(int i, Neighbors& neighbors, PlaneFit& fit, Test&& isOfSheet) const
  {
    const int wanted = this->Settings.NumberOfNeighbors;
    this->Find(i, 2, neighbors);
    int kept = 0;
    for (int k = 0; k < neighbors.Count() && kept < wanted; ++k)
    {
      if (isOfSheet(neighbors.Ids[k]))
      {
        neighbors.Ids[kept] = neighbors.Ids[k];
        neighbors.SquaredDistances[kept] = neighbors.SquaredDistances[k];
        ++kept;
      }
    }
    if (kept >= ReachRank)
    {
      neighbors.Ids.resize(kept);
      neighbors.SquaredDistances.resize(kept);
      this->SetExtent(Covariance(this->Cloud, i, neighbors), neighbors, fit);
    }
  }

private:
  void Find(int i, int growth, Neighbors& neighbors) const
  {
    const int count = growth * this->Settings.NumberOfNeighbors;
    if (!this->Settings.UseRadius)
    {
      this->Tree.FindNearest(i, count, neighbors);
      return;
    }
    this->Tree.FindWithin(
      i, growth * this->Settings.Radius, this->Settings.MaximumNumberOfNeighbors, neighbors);
    if (neighbors.Count() < ReachRank)
    {
      // A radius too small for this place: a plane still needs some points.
      this->Tree.FindNearest(i, ReachRank, neighbors);
    }
  }

  /// The neighbours of the fit, and those that are kept: one query for both.
  void FindAndKeep(int i, int* graph, Neighbors& neighbors) const
  {
    const int wanted = this->Settings.NumberOfNeighbors;
    const bool nearest = !this->Settings.UseRadius;
    if (nearest)
    {
      this->Tree.FindNearest(i, std::max(wanted, KeptNeighbors), neighbors);
    }
    else
    {
      this->Find(i, 1, neighbors);
    }
    for (int k = 0; k < KeptNeighbors; ++k)
    {
      graph[k] = k < neighbors.Count() ? neighbors.Ids[k] : -1;
    }
    if (nearest && neighbors.Count() > wanted)
    {
      neighbors.Ids.resize(wanted);
      neighbors.SquaredDistances.resize(wanted);
    }
  }

  static float ReachOf(const Neighbors& neighbors)
  {
    const int rank = std::min(ReachRank, neighbors.Count());
    return rank > 0 ? std::sqrt(neighbors.SquaredDistances[rank - 1]) : 0.0f;
  }

  void SetNormal(const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>& eigen, const float* given,
    PlaneFit& fit) const
  {
    const Eigen::Vector3d values = eigen.eigenvalues().cwiseMax(0.0);
    fit.Flatness = values[1] > 0.0 ? static_cast<float>(values[0] / values[1]) : 1.0f;
    fit.Degenerate = !(values[1] > CollinearRatio * values[2]);
    fit.Normal = Normalized(ToVector(eigen.eigenvectors().col(0)), { 0.0, 0.0, 1.0 });
    if (given)
    {
      const Vector3 normal = Load(given);
      fit.Given = Dot(normal, normal) > 0.0;
      fit.Normal = Normalized(normal, fit.Normal);
    }
  }

  /// Principal variances in the tangent plane, and from them the area per point: k neighbours in
  /// a disc of radius r have the variance r^2/4, so pi r^2 / k = 4 pi sqrt(lu lv) / k. With the
  /// mean taken out, this holds within 7 % on borders and corners and in narrow strips as well,
  /// where pi r^2 / k is wrong by factors.
  void SetExtent(const Eigen::Matrix3d& covariance, const Neighbors& neighbors, PlaneFit& fit) const
  {
    Vector3 u, v;
    TangentFrame(fit.Normal, u, v);
    const Eigen::Vector3d eu(u[0], u[1], u[2]);
    const Eigen::Vector3d ev(v[0], v[1], v[2]);
    const double uu = eu.dot(covariance * eu);
    const double vv = ev.dot(covariance * ev);
    const double uv = eu.dot(covariance * ev);
    const double half = 0.5 * std::sqrt((uu - vv) * (uu - vv) + 4.0 * uv * uv);
    double cosine, sine;
    PrincipalAxis(uu, vv, uv, cosine, sine);
    fit.AxisU = cosine * u + sine * v;

    const int count = neighbors.Count();
    if (count < 3)
    {
      // One or two points: their distance is all there is. A lone point has no scale at all.
      fit.Degenerate = true;
      fit.Spacing = count > 0 ? fit.Reach : 0.0f;
      fit.VarianceU = fit.VarianceV = fit.Spacing * fit.Spacing;
      return;
    }
    const double pitch2 = neighbors.SquaredDistances[1];
    const double larger = std::max(0.5 * (uu + vv) + half, LineVariance * pitch2);
    const double smaller = std::max(0.5 * (uu + vv) - half, LineVariance * pitch2);
    const double scale = 4.0 * Pi / count;
    fit.VarianceU = static_cast<float>(scale * larger);
    fit.VarianceV = static_cast<float>(scale * smaller);
    fit.Spacing = static_cast<float>(std::sqrt(scale * std::sqrt(larger * smaller)));
  }

  const LocalCloud& Cloud;
  const NeighborSearch& Tree;
  const FitSettings& Settings;
};

double Median(std::vector<float>& values)
{
  if (values.empty())
  {
    return 0.0;
  }
  const auto middle = values.begin() + values.size() / 2;
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

void MakeRound(double spacing, PlaneFit& fit)
{
  fit.Spacing = static_cast<float>(spacing);
  fit.VarianceU = fit.VarianceV = fit.Spacing * fit.Spacing;
}

/// A point far from everything would become a giant disc. Far: its reach exceeds `factor` times
/// the median reach of its neighbours, or factor^2 times that of the whole cloud (a group of
/// outliers, whose reaches are all large). It gets the median spacing of its neighbours, or of
/// the cloud.
class IsolationTest
{
public:
  IsolationTest(const std::vector<PlaneFit>& fits, double factor)
    : Fits(fits)
    , Factor(factor)
  {
    std::vector<float> values(fits.size());
    std::transform(
      fits.begin(), fits.end(), values.begin(), [](const PlaneFit& fit) { return fit.Reach; });
    this->MedianReach = Median(values);
    std::transform(
      fits.begin(), fits.end(), values.begin(), [](const PlaneFit& fit) { return fit.Spacing; });
    this->MedianSpacing = Median(values);
  }

  /// Spacing to use for an isolated point; negative if it is not isolated.
  double Spacing(int i, const int* graph, std::vector<float>& reaches) const
  {
    const PlaneFit& fit = this->Fits[i];
    if (fit.Reach > this->Factor * this->Factor * this->MedianReach)
    {
      return std::min<double>(fit.Spacing, this->MedianSpacing);
    }
    reaches.clear();
    for (int k = 0; k < ReachRank && graph[k] >= 0; ++k)
    {
      reaches.push_back(this->Fits[graph[k]].Reach);
    }
    const double local = Median(reaches);
    if (reaches.empty() || fit.Reach <= this->Factor * local)
    {
      return -1.0;
    }
    reaches.clear();
    for (int k = 0; k < ReachRank && graph[k] >= 0; ++k)
    {
      reaches.push_back(this->Fits[graph[k]].Spacing);
    }
    return std::min<double>(fit.Spacing, Median(reaches));
  }

private:
  const std::vector<PlaneFit>& Fits;
  double Factor;
  double MedianReach = 0.0;
  double MedianSpacing = 0.0;
};

void BoundIsolated(double factor, const NeighborGraph& graph, std::vector<PlaneFit>& fits)
{
  const int count = static_cast<int>(fits.size());
  const IsolationTest test(fits, factor);
  std::vector<double> spacings(count); // first all tests, then all changes
  vtkSMPTools::For(0, count, [&](vtkIdType begin, vtkIdType end) {
    std::vector<float> scratch;
    for (vtkIdType i = begin; i < end; ++i)
    {
      spacings[i] = test.Spacing(static_cast<int>(i), graph.Row(i), scratch);
    }
  });
  for (int i = 0; i < count; ++i)
  {
    if (spacings[i] >= 0.0)
    {
      fits[i].Isolated = true;
      MakeRound(spacings[i], fits[i]);
    }
  }
}
}

bool AreOfOneSheet(const PlaneFit& a, const PlaneFit& b, bool eitherTwoSided, const Vector3& d)
{
  const double cosine = Dot(a.Normal, b.Normal);
  const double climb = Dot(a.Normal, d);
  return (eitherTwoSided ? std::abs(cosine) : cosine) >= SheetCosine &&
    climb * climb <= SheetClimb * SheetClimb * Dot(d, d);
}

bool FitSurfels(const LocalCloud& cloud, const NeighborSearch& tree, const FitSettings& settings,
  const std::vector<float>& given, const StageProgress& monitor, std::vector<PlaneFit>& fits,
  NeighborGraph& graph)
{
  const size_t count = static_cast<size_t>(cloud.Size());
  fits.resize(count);
  graph.Ids.resize(KeptNeighbors * count);
  graph.AreNearest = !settings.UseRadius;
  const Fitter fitter(cloud, tree, settings);
  const bool finished = ParallelFor(cloud.Size(), monitor, [&](vtkIdType begin, vtkIdType end) {
    Neighbors neighbors;
    for (vtkIdType i = begin; i < end; ++i)
    {
      fits[i] = fitter.Fit(static_cast<int>(i), given.empty() ? nullptr : given.data() + 3 * i,
        graph.Row(i), neighbors);
    }
  });
  if (!finished)
  {
    return false;
  }
  BoundIsolated(settings.IsolationFactor, graph, fits);
  for (PlaneFit& fit : fits)
  {
    if (!(fit.Spacing > 0.0))
    {
      // A lone point: any radius is as good as another.
      MakeRound(settings.UseRadius && settings.Radius > 0.0 ? settings.Radius : 1.0, fit);
    }
  }
  return true;
}

bool RefineExtents(const LocalCloud& cloud, const NeighborSearch& tree, const FitSettings& settings,
  const std::vector<unsigned char>& twoSided, const NeighborGraph& graph,
  const StageProgress& monitor, std::vector<PlaneFit>& fits)
{
  const auto isOfSheet = [&](int i, int j) {
    return AreOfOneSheet(fits[i], fits[j], twoSided[i] || twoSided[j],
      Load(cloud.Position(j)) - Load(cloud.Position(i)));
  };
  const Fitter fitter(cloud, tree, settings);
  return ParallelFor(cloud.Size(), monitor, [&](vtkIdType begin, vtkIdType end) {
    Neighbors neighbors;
    for (vtkIdType i = begin; i < end; ++i)
    {
      const int self = static_cast<int>(i);
      const auto isOfMySheet = [&](int j) { return isOfSheet(self, j); };
      const int* nearest = graph.Row(i);
      const auto others = std::count_if(
        nearest, nearest + GraphDegree, [&](int j) { return j >= 0 && !isOfMySheet(j); });
      if (others >= MixedNeighbors && !fits[i].Isolated && !fits[i].Degenerate)
      {
        fitter.Refit(self, neighbors, fits[i], isOfMySheet);
      }
    }
  });
}
}
