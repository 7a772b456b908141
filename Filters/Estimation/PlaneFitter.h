// SPDX-License-Identifier: BSD-3-Clause
/**
 * Fits the plane of one point to its neighbours, or to those of one line or sheet.
 *
 * PCL computes the covariance of a neighbourhood and its principal directions: the functions that
 * pcl::NormalEstimation calls, as instances in double. The class itself
 * - computes in float, relative to the cloud's origin. The variances across a line of points, which
 *   decide whether a normal exists, are then noise;
 * - drops the variances, of which spacing and extent are made, and returns one curvature;
 * - takes the same number of neighbours everywhere, and runs without progress and abort.
 *
 * PCL has no area or radius per point: SetExtent computes the area from the variances, and
 * VoronoiCell.h the cell. (pcl::PrincipalCurvaturesEstimation and pcl::RSDEstimation give radii of
 * curvature.)
 */
#pragma once

#include "Filters/Estimation/PlaneFit.h"
#include "Filters/Estimation/PrincipalPlane.h"
#include "Filters/Estimation/ScanLines.h"

#include <array>
#include <cstddef>
#include <vector>

namespace SurfelGeometry
{
class ScannerView;

/// Neighbours at the scales of FitEvenly, each of its own: queries for as many neighbours as the
/// last one are answered together with it (NeighborSearch.h).
constexpr std::size_t EvenScales = 2;
using EvenNeighbors = std::array<Neighbors, EvenScales>;

class PlaneFitter
{
public:
  PlaneFitter(const LocalCloud& cloud, const NeighborSearch& tree, const FitSettings& settings)
    : Cloud(cloud)
    , Tree(tree)
    , Settings(settings)
  {
  }

  /// Fits point i to its neighbours, and drops those beyond a gap.
  PlaneFit Fit(int i, const float* given, Neighbors& neighbors, Spread& spread);

  /// Fits point i to the nearest neighbours, if these are those of a rod.
  void FitToRod(int i, const float* given, Neighbors& neighbors, PlaneFit& fit);

  /// Whether the noise of point i's line is within a surface.
  bool IsWithinSurface(int i, Neighbors& neighbors);

  /// Whether the scanner of point i has seen the next lines of a surface on both sides of its own.
  /// @param neighbors those of FindLines
  bool IsBetweenLines(int i, const PlaneFit& fit, ScannerView& view, Neighbors& neighbors) const;

  /// Whether there are other lines on both sides of that of point i, wherever it was seen from.
  bool HasLinesBeside(int i, const PlaneFit& fit, Neighbors& neighbors);

  /// Whether most lines beside that of point i have others on both sides: all are of one surface.
  bool IsEdge(int i, const PlaneFit& fit, const ScanLines& lines,
    const std::vector<LineKind>& kinds, Neighbors& neighbors);

  /// Neighbours on the next lines of a surface, if point i is on one.
  void FindLines(int i, Neighbors& neighbors) const { this->Find(i, LineGrowth, neighbors); }

  /// Fits point i, on a line of a surface, to the next lines as well.
  void FitToLines(int i, const float* given, Neighbors& neighbors, PlaneFit& fit);

  /// Fits point i, of a cloud of scan lines, to more neighbours, until these are spread evenly: not
  /// on one line, nor on several that have come together. Nothing changes where they lie in no
  /// plane.
  void FitEvenly(int i, const float* given, Spread spread, EvenNeighbors& found, PlaneFit& fit);

  /// Finds the neighbours of the fit and those that are stored, with one query.
  void FindAndKeep(int i, NeighborGraph& graph, Neighbors& neighbors) const;

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
  /// Where the neighbours are on one line of a surface whose lines are far apart, the search takes
  /// so many times more, to find the next line.
  static constexpr int LineGrowth = 4;

  /// Neighbours are beside a line, not on it, if the sine of the angle between is above this.
  static constexpr double OffLine = 0.22;

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

  Principal FitTo(int i, const float* given, const Neighbors& neighbors, PlaneFit& fit);

  Eigen::Matrix3d CovarianceAround(int i, const Neighbors& neighbors);

  void Find(int i, int growth, Neighbors& neighbors) const;

  static float ReachOf(const Neighbors& neighbors);

  /// Drops the neighbours beyond a gap.
  static void CutAtGap(Neighbors& neighbors);

  void SetNormal(const Principal& principal, const float* given, PlaneFit& fit) const;

  /// Principal variances lu, lv in the tangent plane, and from them the area per point: k
  /// neighbours in a disc of radius r have the variance r^2/4, so pi r^2 / k = 4 pi sqrt(lu lv) /
  /// k. About the mean, this also holds within 7 % on borders, corners and narrow strips, where pi
  /// r^2 / k is wrong by factors.
  void SetExtent(
    const Eigen::Matrix3d& covariance, const Neighbors& neighbors, PlaneFit& fit) const;

  const LocalCloud& Cloud;
  const NeighborSearch& Tree;
  const FitSettings& Settings;
  Patch Around;
  std::vector<Vector3> Ways; // across a line
};
}
