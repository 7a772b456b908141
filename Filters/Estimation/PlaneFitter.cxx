// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Estimation/PlaneFitter.h"

#include "Filters/Estimation/ScannerView.h"
#include "Filters/Neighbors/LocalCloud.h"
#include "Filters/Neighbors/NeighborSearch.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace SurfelGeometry
{
namespace
{
/// To find the next lines of its scanner among those of others, the search takes so many times more
/// neighbours.
constexpr int ScannersGrowth = 8;

/// Scales at which lines may be spread evenly: the sixteen nearest of three scanners may be on
/// lines that have come together by chance.
constexpr int EvenGrowths[EvenScales] = { 4, 16 };

/// There the spacing is less than this times that of the scale before, as nothing is between lines.
constexpr double MostGrown = 1.1;

/// Neighbours with more of the smaller tangential variance across their plane lie in none.
constexpr double MostBent = 0.1;

/// Neighbours that are so many times as far as those before them are on other things: a few far
/// returns of a scanner would else become discs as large as the space about them.
constexpr float GapRatio = 3.0f;

/// At the ends of rods, more neighbours than these are on other things.
constexpr int RodNeighbors = 8;

/// Below this ratio of the two larger variances the neighbours are on a line, and the normal is
/// arbitrary.
constexpr double CollinearRatio = 1e-6;
}

PlaneFit PlaneFitter::Fit(int i, const float* given, Neighbors& neighbors, Spread& spread)
{
  PlaneFit fit;
  fit.Reach = ReachOf(neighbors);
  CutAtGap(neighbors);
  const Principal principal = this->FitTo(i, given, neighbors, fit);
  spread = neighbors.Count() < 3 ? Spread::Round
                                 : SpreadOf(principal.Variances[1], principal.Variances[2]);
  return fit;
}

void PlaneFitter::FitToRod(int i, const float* given, Neighbors& neighbors, PlaneFit& fit)
{
  this->Tree.FindNearest(i, RodNeighbors, neighbors);
  const Principal principal(this->CovarianceAround(i, neighbors));
  fit.OnRod = SpreadOf(principal.Variances[1], principal.Variances[2]) >= Spread::Narrow;
  if (fit.OnRod)
  {
    this->FitTo(i, given, neighbors, fit);
  }
}

bool PlaneFitter::IsWithinSurface(int i, Neighbors& neighbors)
{
  this->FindLines(i, neighbors);
  const Eigen::Matrix3d around = this->CovarianceAround(i, neighbors);
  const int count = std::min(neighbors.Count(), this->Settings.NumberOfNeighbors);
  this->Around.Load(this->Cloud, i, neighbors.Ids.data(), count);
  return SurfelGeometry::IsWithinSurface(this->Around.Covariance(), around);
}

bool PlaneFitter::IsBetweenLines(
  int i, const PlaneFit& fit, ScannerView& view, Neighbors& neighbors) const
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

bool PlaneFitter::HasLinesBeside(int i, const PlaneFit& fit, Neighbors& neighbors)
{
  this->Ways.clear();
  this->VisitBeside(
    i, fit, neighbors, [this](int, const Vector3& way) { this->Ways.push_back(way); });
  return std::any_of(this->Ways.begin(), this->Ways.end(), [this](const Vector3& a) {
    return std::any_of(this->Ways.begin(), this->Ways.end(),
      [&a](const Vector3& b) { return AreToNextLines(a, b); });
  });
}

bool PlaneFitter::IsEdge(int i, const PlaneFit& fit, const ScanLines& lines,
  const std::vector<LineKind>& kinds, Neighbors& neighbors)
{
  int between = 0;
  this->VisitBeside(i, fit, neighbors, [&](int j, const Vector3&) {
    between += lines.IsLine(j) && kinds[j] == LineKind::Other ? 1 : -1;
  });
  return between > 0;
}

void PlaneFitter::FitToLines(int i, const float* given, Neighbors& neighbors, PlaneFit& fit)
{
  this->Find(i, LineGrowth, neighbors);
  this->FitTo(i, given, neighbors, fit);
}

void PlaneFitter::FitEvenly(
  int i, const float* given, Spread spread, EvenNeighbors& found, PlaneFit& fit)
{
  for (std::size_t k = 0; k < EvenScales; ++k)
  {
    Neighbors& neighbors = found[k];
    this->Find(i, EvenGrowths[k], neighbors);
    PlaneFit wider = fit;
    const Eigen::Vector3d v = this->FitTo(i, given, neighbors, wider).Variances;
    const Spread wide = SpreadOf(v[1], v[2]);
    if (!(v[0] < MostBent * v[1]))
    {
      if (wide < Spread::Narrow)
      {
        return;
      }
      continue; // still one line: its noise says nothing of a plane
    }
    const bool isEven = spread == Spread::Round && wider.Spacing < MostGrown * fit.Spacing;
    fit.OnScanLines = wider.OnScanLines = true;
    // Noise makes planes of more neighbours flatter, and what is round makes them less flat.
    if (!isEven || wider.Flatness < fit.Flatness)
    {
      fit = wider;
    }
    if (isEven)
    {
      return;
    }
    spread = wide;
  }
}

void PlaneFitter::FindAndKeep(int i, NeighborGraph& graph, Neighbors& neighbors) const
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

Principal PlaneFitter::FitTo(int i, const float* given, const Neighbors& neighbors, PlaneFit& fit)
{
  const Eigen::Matrix3d covariance = this->CovarianceAround(i, neighbors);
  const Principal principal(covariance);
  this->SetNormal(principal, given, fit);
  this->SetExtent(covariance, neighbors, fit);
  return principal;
}

Eigen::Matrix3d PlaneFitter::CovarianceAround(int i, const Neighbors& neighbors)
{
  this->Around.Load(this->Cloud, i, neighbors.Ids.data(), neighbors.Count());
  return this->Around.Covariance();
}

void PlaneFitter::Find(int i, int growth, Neighbors& neighbors) const
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

float PlaneFitter::ReachOf(const Neighbors& neighbors)
{
  const int rank = std::min(ReachRank, neighbors.Count());
  return rank > 0 ? std::sqrt(neighbors.SquaredDistances[rank - 1]) : 0.0f;
}

void PlaneFitter::CutAtGap(Neighbors& neighbors)
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

void PlaneFitter::SetNormal(const Principal& principal, const float* given, PlaneFit& fit) const
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

void PlaneFitter::SetExtent(
  const Eigen::Matrix3d& covariance, const Neighbors& neighbors, PlaneFit& fit) const
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
}
