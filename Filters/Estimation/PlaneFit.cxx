// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Estimation/PlaneFit.h"

#include "Filters/Common/Median.h"
#include "Filters/Common/ParallelFor.h"
#include "Filters/Estimation/PrincipalPlane.h"
#include "Filters/Estimation/ScanLines.h"
#include "Filters/Estimation/ScannerView.h"
#include "Filters/Neighbors/LocalCloud.h"
#include "Filters/Neighbors/NeighborSearch.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

namespace SurfelGeometry
{
namespace
{
/// Where the neighbours are on one line of a surface whose lines are far apart, the search takes so
/// many times more, to find the next line.
constexpr int LineGrowth = 4;

/// And so many times more to find the next lines of its scanner among those of others.
constexpr int ScannersGrowth = 8;

/// Neighbours that are so many times as far as those before them are on other things: a few far
/// returns of a scanner would else become discs as large as the space about them.
constexpr float GapRatio = 3.0f;

/// At the ends of rods, more neighbours than these are on other things.
constexpr int RodNeighbors = 8;

/// What is beside a rod, which has so many of its points, is at most so many times as large.
constexpr std::size_t FewestOnRod = 3;
constexpr float MostPerRodSpacing = 1.5f;

/// Neighbours are beside a line, not on it, if the sine of the angle between is above this.
constexpr double OffLine = 0.22;

/// Below this ratio of the two larger variances the neighbours are on a line, and the normal is
/// arbitrary.
constexpr double CollinearRatio = 1e-6;

/// A neighbourhood is mixed if this many of the GraphDegree nearest are on another sheet.
constexpr int MixedNeighbors = 3;

class Fitter
{
public:
  Fitter(const LocalCloud& cloud, const NeighborSearch& tree, const FitSettings& settings)
    : Cloud(cloud)
    , Tree(tree)
    , Settings(settings)
  {
  }

  /// Fits point i to its neighbours, and drops those beyond a gap.
  PlaneFit Fit(int i, const float* given, Neighbors& neighbors, Spread& spread)
  {
    PlaneFit fit;
    fit.Reach = ReachOf(neighbors);
    CutAtGap(neighbors);
    const Principal principal = this->FitTo(i, given, neighbors, fit);
    spread = neighbors.Count() < 3 ? Spread::Round
                                   : SpreadOf(principal.Variances[1], principal.Variances[2]);
    return fit;
  }

  /// Fits point i to the nearest neighbours, if these are those of a rod.
  void FitToRod(int i, const float* given, Neighbors& neighbors, PlaneFit& fit)
  {
    this->Tree.FindNearest(i, RodNeighbors, neighbors);
    const Principal principal(this->CovarianceAround(i, neighbors));
    fit.OnRod = SpreadOf(principal.Variances[1], principal.Variances[2]) >= Spread::Narrow;
    if (fit.OnRod)
    {
      this->FitTo(i, given, neighbors, fit);
    }
  }

  /// Whether the noise of point i's line is within a surface.
  bool IsWithinSurface(int i, Neighbors& neighbors)
  {
    this->FindLines(i, neighbors);
    const Eigen::Matrix3d around = this->CovarianceAround(i, neighbors);
    const int count = std::min(neighbors.Count(), this->Settings.NumberOfNeighbors);
    this->Around.Load(this->Cloud, i, neighbors.Ids.data(), count);
    return SurfelGeometry::IsWithinSurface(this->Around.Covariance(), around);
  }

  /// Whether the scanner of point i has seen the next lines of a surface on both sides of its own.
  /// @param neighbors those of FindLines
  bool IsBetweenLines(int i, const PlaneFit& fit, ScannerView& view, Neighbors& neighbors) const
  {
    if (!view.LookAt(i))
    {
      return false;
    }
    if (view.IsBetweenLines(fit.AxisU, neighbors))
    {
      return true;
    }
    if (!view.AreMostOfOthers(neighbors))
    {
      return false;
    }
    this->Find(i, ScannersGrowth, neighbors);
    return view.IsBetweenLines(fit.AxisU, neighbors);
  }

  /// Whether there are other lines on both sides of that of point i, wherever it was seen from.
  bool HasLinesBeside(int i, const PlaneFit& fit, Neighbors& neighbors)
  {
    this->Ways.clear();
    this->VisitBeside(
      i, fit, neighbors, [this](int, const Vector3& way) { this->Ways.push_back(way); });
    return std::any_of(this->Ways.begin(), this->Ways.end(), [this](const Vector3& a) {
      return std::any_of(this->Ways.begin(), this->Ways.end(),
        [&a](const Vector3& b) { return AreToNextLines(a, b); });
    });
  }

  /// Whether most lines beside that of point i have others on both sides: all are of one surface.
  bool IsEdge(int i, const PlaneFit& fit, const ScanLines& lines,
    const std::vector<LineKind>& kinds, Neighbors& neighbors)
  {
    int between = 0;
    this->VisitBeside(i, fit, neighbors, [&](int j, const Vector3&) {
      between += lines.IsLine(j) && kinds[j] == LineKind::Other ? 1 : -1;
    });
    return between > 0;
  }

  /// Neighbours on the next lines of a surface, if point i is on one.
  void FindLines(int i, Neighbors& neighbors) const { this->Find(i, LineGrowth, neighbors); }

  /// Fits point i, on a line of a surface, to the next lines as well.
  void FitToLines(int i, const float* given, Neighbors& neighbors, PlaneFit& fit)
  {
    this->Find(i, LineGrowth, neighbors);
    this->FitTo(i, given, neighbors, fit);
  }

  /// Finds the neighbours of the fit and those that are stored, with one query.
  void FindAndKeep(int i, NeighborGraph& graph, Neighbors& neighbors) const
  {
    const int wanted = this->Settings.NumberOfNeighbors;
    if (this->Settings.UseRadius)
    {
      this->Find(i, 1, neighbors);
      graph.Keep(i, neighbors);
      return;
    }
    this->Tree.FindNearest(i, std::max(wanted, KeptNeighbors), neighbors);
    graph.Keep(i, neighbors);
    if (neighbors.Count() > wanted)
    {
      neighbors.Ids.resize(wanted);
      neighbors.SquaredDistances.resize(wanted);
    }
  }

  /// Spacing and extent of point i from the neighbours j with isOfSheet(j).
  template <typename Test>
  void Refit(int i, Neighbors& neighbors, PlaneFit& fit, Test&& isOfSheet)
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
      this->SetExtent(this->CovarianceAround(i, neighbors), neighbors, fit);
    }
  }

private:
  /// Calls visit(j, way) for the neighbours beside the line of point i, and the ways to them across
  /// this line.
  template <typename Visit>
  void VisitBeside(int i, const PlaneFit& fit, Neighbors& neighbors, Visit&& visit) const
  {
    this->FindLines(i, neighbors);
    const Vector3 point = Load(this->Cloud.Position(i)), along = fit.AxisU;
    for (const int j : neighbors.Ids)
    {
      const Vector3 d = Load(this->Cloud.Position(j)) - point;
      const Vector3 way = d - Dot(d, along) * along;
      if (Dot(way, way) > OffLine * OffLine * Dot(d, d))
      {
        visit(j, way);
      }
    }
  }

  Principal FitTo(int i, const float* given, const Neighbors& neighbors, PlaneFit& fit)
  {
    const Eigen::Matrix3d covariance = this->CovarianceAround(i, neighbors);
    const Principal principal(covariance);
    this->SetNormal(principal, given, fit);
    this->SetExtent(covariance, neighbors, fit);
    return principal;
  }

  Eigen::Matrix3d CovarianceAround(int i, const Neighbors& neighbors)
  {
    this->Around.Load(this->Cloud, i, neighbors.Ids.data(), neighbors.Count());
    return this->Around.Covariance();
  }

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
      // The radius is too small here: a plane still needs some points.
      this->Tree.FindNearest(i, ReachRank, neighbors);
    }
  }

  static float ReachOf(const Neighbors& neighbors)
  {
    const int rank = std::min(ReachRank, neighbors.Count());
    return rank > 0 ? std::sqrt(neighbors.SquaredDistances[rank - 1]) : 0.0f;
  }

  /// Drops the neighbours beyond a gap.
  static void CutAtGap(Neighbors& neighbors)
  {
    const std::vector<float>& squares = neighbors.SquaredDistances;
    constexpr float ratio = GapRatio * GapRatio;
    const int count = neighbors.Count();
    if (count <= ReachRank || squares[count - 1] <= ratio * squares[ReachRank - 1])
    {
      return;
    }
    int kept = ReachRank;
    while (kept < count && squares[kept] <= ratio * squares[kept - 1])
    {
      ++kept;
    }
    neighbors.Ids.resize(kept);
    neighbors.SquaredDistances.resize(kept);
  }

  void SetNormal(const Principal& principal, const float* given, PlaneFit& fit) const
  {
    const Eigen::Vector3d values = principal.Variances.cwiseMax(0.0);
    fit.Flatness = values[1] > 0.0 ? static_cast<float>(values[0] / values[1]) : 1.0f;
    fit.Degenerate = !(values[1] > CollinearRatio * values[2]);
    fit.Normal = Normalized(ToVector(principal.Normal), { 0.0, 0.0, 1.0 });
    if (given)
    {
      const Vector3 normal = Load(given);
      fit.Given = Dot(normal, normal) > 0.0;
      fit.Normal = Normalized(normal, fit.Normal);
    }
  }

  /// Principal variances lu, lv in the tangent plane, and from them the area per point: k
  /// neighbours in a disc of radius r have the variance r^2/4, so pi r^2 / k = 4 pi sqrt(lu lv) /
  /// k. About the mean, this also holds within 7 % on borders, corners and narrow strips, where pi
  /// r^2 / k is wrong by factors.
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
      // One or two neighbours give only a distance; a single point has no scale at all.
      fit.Degenerate = true;
      fit.Spacing = count > 0 ? fit.Reach : 0.0f;
      fit.VarianceU = fit.VarianceV = fit.Spacing * fit.Spacing;
      return;
    }
    const double least = LineVariance * neighbors.SquaredDistances[1];
    const double larger = std::max(0.5 * (uu + vv) + half, least);
    const double smaller = std::max(0.5 * (uu + vv) - half, least);
    const double scale = 4.0 * Pi / count;
    fit.VarianceU = static_cast<float>(scale * larger);
    fit.VarianceV = static_cast<float>(scale * smaller);
    fit.Spacing = static_cast<float>(std::sqrt(AreaPerPoint(larger, smaller, count)));
  }

  const LocalCloud& Cloud;
  const NeighborSearch& Tree;
  const FitSettings& Settings;
  Patch Around;
  std::vector<Vector3> Ways; // across a line
};

const float* GivenNormal(const FitInput& input, int i)
{
  const std::vector<float>& given = input.GivenNormals;
  return given.empty() ? nullptr : given.data() + 3 * static_cast<size_t>(i);
}

/// Fits all points to their nearest neighbours. Returns false if stopped.
bool FitToNearest(const FitInput& input, const StageProgress& progress, PlaneFits& fits,
  NeighborGraph& graph, Spreads& spreads)
{
  const LocalCloud& cloud = input.Cloud;
  const FitSettings& settings = input.Settings;
  const bool isKnown = !graph.Ids.empty() && graph.AreNearest && !settings.UseRadius &&
    settings.NumberOfNeighbors <= KeptNeighbors;
  graph.Ids.resize(KeptNeighbors * fits.size());
  graph.AreNearest = !settings.UseRadius;
  return ParallelFor(cloud.Size(), progress, [&](vtkIdType begin, vtkIdType end) {
    Fitter fitter(cloud, input.Tree, settings);
    Neighbors neighbors;
    for (vtkIdType i = begin; i < end; ++i)
    {
      const int self = static_cast<int>(i);
      if (isKnown)
      {
        graph.Get(cloud, self, settings.NumberOfNeighbors, neighbors);
      }
      else
      {
        fitter.FindAndKeep(self, graph, neighbors);
      }
      fits[i] = fitter.Fit(self, GivenNormal(input, self), neighbors, spreads[i]);
    }
  });
}

/// Tells which of the points on lines may be those of rods. Returns false if stopped.
bool JudgeLines(const FitInput& input, const ScanLines& lines, const NeighborGraph& graph,
  const PlaneFits& fits, const StageProgress& progress, std::vector<LineKind>& kinds)
{
  const std::vector<int>& points = lines.Points();
  return ParallelFor(
    static_cast<vtkIdType>(points.size()), progress, [&](vtkIdType k, vtkIdType end) {
      Fitter fitter(input.Cloud, input.Tree, input.Settings);
      ScannerView view(input.Cloud, input.ToScanner);
      ScanLines::Query query;
      Neighbors neighbors;
      for (; k < end; ++k)
      {
        const int i = points[static_cast<size_t>(k)];
        if (!lines.IsAmongStrips(i, graph))
        {
          continue;
        }
        const bool isOfSurface = lines.IsOfSurface(i, query);
        if (!isOfSurface || lines.MayBeAlone(i))
        {
          kinds[i] = isOfSurface && fitter.HasLinesBeside(i, fits[i], neighbors) ? LineKind::Other
            : fitter.IsWithinSurface(i, neighbors)               ? LineKind::WithinSurface
            : fitter.IsBetweenLines(i, fits[i], view, neighbors) ? LineKind::BetweenLines
            : isOfSurface                                        ? LineKind::Alone
                                                                 : LineKind::Rod;
        }
      }
    });
}

/// Tells rods from the edges of surfaces among lines that are alone. Returns false if stopped.
bool JudgeAlone(const FitInput& input, const ScanLines& lines, const PlaneFits& fits,
  const StageProgress& progress, std::vector<LineKind>& kinds)
{
  std::vector<int> alone;
  std::copy_if(lines.Points().begin(), lines.Points().end(), std::back_inserter(alone),
    [&kinds](int i) { return kinds[i] == LineKind::Alone; });
  std::vector<LineKind> found(alone.size());
  const auto count = static_cast<vtkIdType>(alone.size());
  const bool done = ParallelFor(count, progress, [&](vtkIdType k, vtkIdType end) {
    Fitter fitter(input.Cloud, input.Tree, input.Settings);
    Neighbors neighbors;
    for (; k < end; ++k)
    {
      const int i = alone[static_cast<size_t>(k)];
      found[k] =
        fitter.IsEdge(i, fits[i], lines, kinds, neighbors) ? LineKind::Other : LineKind::Rod;
    }
  });
  for (size_t k = 0; k < alone.size(); ++k)
  {
    kinds[alone[k]] = found[k];
  }
  return done;
}

/// Marks the points on rods, and fits those on lines of surfaces again. Returns false if stopped.
bool FitScanLines(const FitInput& input, const ScanLines& lines, const std::vector<LineKind>& kinds,
  const NeighborGraph& graph, const StageProgress& progress, PlaneFits& fits)
{
  const std::vector<int>& points = lines.Points();
  return ParallelFor(
    static_cast<vtkIdType>(points.size()), progress, [&](vtkIdType k, vtkIdType end) {
      Fitter fitter(input.Cloud, input.Tree, input.Settings);
      Neighbors neighbors;
      for (; k < end; ++k)
      {
        const int i = points[static_cast<size_t>(k)];
        fits[i].OnRod = IsOnRod(i, kinds, graph);
        if (!fits[i].OnRod && lines.IsLine(i))
        {
          fitter.FitToLines(i, GivenNormal(input, i), neighbors, fits[i]);
        }
      }
    });
}

/// Marks the ends of rods, and fits them. Returns false if stopped.
/// @param points beside rods
bool FitEnds(const FitInput& input, const std::vector<int>& points, const StageProgress& progress,
  PlaneFits& fits)
{
  const auto count = static_cast<vtkIdType>(points.size());
  return ParallelFor(count, progress, [&](vtkIdType k, vtkIdType end) {
    Fitter fitter(input.Cloud, input.Tree, input.Settings);
    ScannerView view(input.Cloud, input.ToScanner);
    Neighbors neighbors;
    for (; k < end; ++k)
    {
      const int i = points[static_cast<size_t>(k)];
      const PlaneFit before = fits[i];
      fitter.FitToRod(i, GivenNormal(input, i), neighbors, fits[i]);
      if (fits[i].OnRod)
      {
        fitter.FindLines(i, neighbors);
        fits[i] = fitter.IsBetweenLines(i, fits[i], view, neighbors) ? before : fits[i];
      }
    }
  });
}

/// The most that point i may have as its spacing, if some neighbours are on rods: a stray point
/// beside a rod is on a line, or in a plane, with the rod's points. Infinite for others.
float LargestBesideRods(int i, const PlaneFits& fits, const NeighborGraph& graph)
{
  const int* ids = graph.Row(i);
  std::vector<float> spacings;
  for (int k = 0; k < CountIds(ids, KeptNeighbors); ++k)
  {
    if (fits[ids[k]].OnRod)
    {
      spacings.push_back(fits[ids[k]].Spacing);
    }
  }
  return spacings.size() >= FewestOnRod ? MostPerRodSpacing * Median(spacings)
                                        : std::numeric_limits<float>::infinity();
}

/// Points of rods, and stray points beside them, are no larger than the rods' points around.
/// @param points on rods and beside them
void BoundBesideRods(const LocalCloud& cloud, const std::vector<int>& points,
  const NeighborGraph& graph, PlaneFits& fits)
{
  std::vector<float> bounds(points.size()); // first all of them, then all changes
  std::transform(points.begin(), points.end(), bounds.begin(),
    [&](int i) { return LargestBesideRods(i, fits, graph); });
  for (size_t k = 0; k < points.size(); ++k)
  {
    const int i = points[k];
    PlaneFit& fit = fits[i];
    const Vector3 way = Load(cloud.Position(graph.Row(i)[0])) - Load(cloud.Position(i));
    if (fit.Spacing > bounds[k] && (fit.OnRod || Norm(way) > bounds[k]))
    {
      fit.OnRod = true;
      fit.MakeRound(bounds[k]);
    }
  }
}

/// Fits points on lines again, and the ends of rods. Returns false if stopped.
bool FitLines(const FitInput& input, const Spreads& spreads, const NeighborGraph& graph,
  const StageProgress& progress, PlaneFits& fits)
{
  const ScanLines lines(input.Cloud, spreads);
  std::vector<LineKind> kinds(lines.Points().empty() ? 0 : fits.size(), LineKind::Other);
  if (!JudgeLines(input, lines, graph, fits, progress.Part(0.0, 0.3), kinds) ||
    !JudgeAlone(input, lines, fits, progress.Part(0.3, 0.4), kinds) ||
    !FitScanLines(input, lines, kinds, graph, progress.Part(0.4, 0.8), fits))
  {
    return false;
  }
  std::vector<int> rods;
  std::copy_if(lines.Points().begin(), lines.Points().end(), std::back_inserter(rods),
    [&fits](int i) { return fits[i].OnRod; });
  const std::vector<int> beside = PointsBeside(rods, graph);
  if (!FitEnds(input, beside, progress.Part(0.8, 1.0), fits))
  {
    return false;
  }
  rods.insert(rods.end(), beside.begin(), beside.end());
  BoundBesideRods(input.Cloud, rods, graph, fits);
  return true;
}
}

bool FitPlanes(
  const FitInput& input, const StageProgress& progress, PlaneFits& fits, NeighborGraph& graph)
{
  const size_t count = static_cast<size_t>(input.Cloud.Size());
  Spreads spreads(count);
  fits.resize(count);
  if (!FitToNearest(input, progress.Part(0.0, 0.9), fits, graph, spreads) ||
    !FitLines(input, spreads, graph, progress.Part(0.9, 1.0), fits))
  {
    return false;
  }
  const FitSettings& settings = input.Settings;
  ParallelFor(0, input.Cloud.Size(), [&](vtkIdType i, vtkIdType end) {
    for (; i < end; ++i)
    {
      if (!(fits[i].Spacing > 0.0))
      {
        // A single point: any radius will do.
        fits[i].MakeRound(settings.UseRadius && settings.Radius > 0.0 ? settings.Radius : 1.0);
      }
    }
  });
  return true;
}

bool RefineExtents(const OrientedCloud& oriented, const FitSettings& settings,
  const StageProgress& progress, PlaneFits& fits)
{
  const LocalCloud& cloud = oriented.Cloud;
  const std::vector<unsigned char>& twoSided = oriented.TwoSided;
  const auto isOfSheet = [&](int i, int j) {
    return AreOfOneSheet(fits[i], fits[j], twoSided[i] || twoSided[j],
      Load(cloud.Position(j)) - Load(cloud.Position(i)));
  };
  return ParallelFor(cloud.Size(), progress, [&](vtkIdType begin, vtkIdType end) {
    Fitter fitter(cloud, oriented.Tree, settings);
    Neighbors neighbors;
    for (vtkIdType i = begin; i < end; ++i)
    {
      const int self = static_cast<int>(i);
      const auto isOfMySheet = [&](int j) { return isOfSheet(self, j); };
      const int* nearest = oriented.Graph.Row(i);
      const auto onOtherSheets = std::count_if(
        nearest, nearest + GraphDegree, [&](int j) { return j >= 0 && !isOfMySheet(j); });
      if (onOtherSheets >= MixedNeighbors && fits[i].HasPlane())
      {
        fitter.Refit(self, neighbors, fits[i], isOfMySheet);
      }
    }
  });
}
}
