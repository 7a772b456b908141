// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Estimation/VoronoiCell.h"

#include "Core/Simd/Multiversion.h"
#include "Filters/Estimation/CellPolygon.h"
#include "Filters/Estimation/FlatSheet.h"
#include "Filters/Estimation/NearSheet.h"
#include "Filters/Estimation/ScannerView.h"
#include "Filters/Estimation/SteeredPlane.h"
#include "Filters/Neighbors/AngularGap.h"
#include "Filters/Neighbors/LocalCloud.h"
#include "Filters/Neighbors/NeighborSearch.h"
#include "Filters/Neighbors/SurfaceFold.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>

namespace SurfelGeometry
{
namespace
{
/// Cells reach this many spacings at most, on sides without neighbours. In 20 000 random points,
/// the largest empty circle has a radius of about 1.7 spacings (exp(-pi r^2) = 1 / 20 000).
constexpr double CellReach = 2.0;

/// Between scan lines cells reach so many times as far, and their borders are smoothed so: where
/// the lines of several scanners fall together, nothing is for several spacings.
constexpr double BetweenLines = 2.0;

/// Where a neighbour is sparser, cells reach as many of its spacings, at most these times their
/// own: 16 to 1 in density. Beyond that a point is rather a stray one, unless it is among the
/// sparse ones beyond a gap: 100 to 1.
constexpr double MaximumSparsity = 4.0, MaximumBeyondGap = 10.0;

/// Distances, in spacings, at which sparser neighbours are looked for on a side that has none, and
/// how many times sparser they are at least: others are those of the other side of a hole.
constexpr double Lookouts[] = { 4.0, 8.0, 16.0 };
constexpr double LeastSparsity = 1.5;
constexpr std::size_t FewestSparse = 4; ///< fewer are the end of another thing

/// Where points become sparser towards a void, at least so many times on the way over which a cell
/// reaches, the cell reaches farther by as much. Windows stay open, as the points before them are
/// as dense as others.
constexpr double LeastGrowth = 1.1;
constexpr int GrowthSteps = 10;

/// So far only on surfaces: flatness, share of the near points that are on the sheet, and their
/// roundness. Twigs that cross, and the bars of a railing, have voids between them, too.
constexpr double FlatAtVoid = 0.03, ShareOfSheet = 0.95, RoundAtVoid = 0.1;

/// A void has another side, a border has none: so many points, on the plane (slope), in front
/// (squared cosine), and at most so many reaches away.
constexpr std::size_t FewestOverVoid = 2;
constexpr double SlopeOverVoid = 0.15, CosineOverVoid = 0.6, ReachesOverVoid = 4.0;

/// Where a scanner looks along a surface, cells reach this part of the way to its next line, the
/// corners included; the next is fewer steps away than this, and off the plane by less than this
/// part of what lies behind the point on the line of sight would be. Of leaves before each other,
/// others are next to each other, too.
constexpr double LineReach = 0.6, MostStepsApart = 1.5, MostBehind = 0.25;

/// So many of the nearest neighbours cut the cell without asking whether they reach it.
constexpr int SureCuts = 6;

/// Both sides of a fold have points within so many spacings of it. With 2, a paw grows onto the
/// floor beside it, and where both are blurred there is a seam.
constexpr float CellFoldReach = 1.75f;

/// Bisectors of the nearest neighbours; for SIMD loops.
struct NearBisectors
{
  alignas(32) float SX[NearSheet::Capacity] = {}, SY[NearSheet::Capacity] = {},
                    SZ[NearSheet::Capacity] = {}; // steering
  alignas(32) float CutX[NearSheet::Capacity], CutY[NearSheet::Capacity];
  alignas(32) float Offsets[NearSheet::Capacity];   // see FlatNeighbor
  alignas(32) float Distances[NearSheet::Capacity]; // squared; infinite: not beside the point
};

SURFEL_MULTIVERSION void FindBisectors(
  const NearSheet& near, const SteeredPlane& plane, NearBisectors& s)
{
  const Float3 u = plane.U, v = plane.V;
  for (int k = 0; k < NearSheet::Capacity; ++k)
  {
    const float sx = u.X * s.SX[k] + u.Y * s.SY[k] + u.Z * s.SZ[k];
    const float sy = v.X * s.SX[k] + v.Y * s.SY[k] + v.Z * s.SZ[k];
    const float squared = s.SX[k] * s.SX[k] + s.SY[k] * s.SY[k] + s.SZ[k] * s.SZ[k];
    const FlatNeighbor at = PlaceInMetric(plane, near.X[k], near.Y[k], sx, sy, squared);
    const float length = at.CutX * at.CutX + at.CutY * at.CutY, offset = at.Offset();
    s.CutX[k] = at.CutX;
    s.CutY[k] = at.CutY;
    s.Offsets[k] = offset;
    // What is not of the sheet is at (0, 0).
    s.Distances[k] =
      offset > 0.0f ? offset * offset / length : std::numeric_limits<float>::infinity();
  }
}

class CellMeasurer
{
public:
  CellMeasurer(const OrientedCloud& oriented, const CellMetric& metric, PlaneFits& fits,
    SurfaceHeights& heights)
    : Oriented(oriented)
    , Cloud(oriented.Cloud)
    , Tree(oriented.Tree)
    , Graph(oriented.Graph)
    , Steering(metric.Steering)
    , Blur(metric.Blur)
    , Fits(fits)
    , Heights(heights)
    , View(oriented.Cloud, oriented.ToScanner)
  {
  }

  VoronoiCell Measure(int i)
  {
    VoronoiCell cell;
    if (!this->CutByNearest(i))
    {
      return cell;
    }
    if (this->IsOpen(CellReach))
    {
      this->MeasureOpen(i, cell);
    }
    else
    {
      this->MeasureCell(i, cell);
    }
    return cell;
  }

private:
  /// Measures a cell that the nearest neighbours leave open, with what bounds it beyond these: in a
  /// random sampling, beyond a gap; where the density changes at once, the first of the sparse
  /// points.
  void MeasureOpen(int i, VoronoiCell& cell)
  {
    this->Tree.FindNearest(
      i, this->Fits[i].OnScanLines ? SheetCapacity : OpenNeighbors, this->Found);
    this->Sheet.Count = 0;
    double sparsest = this->Fits[i].Spacing;
    this->Scale = this->Fits[i].OnScanLines ? BetweenLines : 1.0;
    const double step = this->StepOfScanner(i);
    float nextLine = 0.0f; // squared distance
    int near = 0;
    for (int k = 0; k < this->Found.Count(); ++k)
    {
      const int j = this->Found.Ids[k];
      const float squared = this->Found.SquaredDistances[k];
      if (k < CellNeighbors || this->MayMeet(i, j, squared))
      {
        ++near;
        this->AddToSheet(i, j, sparsest);
      }
      else if (this->IsNextSeen(i, j, step) && this->AddToSheet(i, j, sparsest))
      {
        nextLine = squared;
      }
    }
    if (this->IsOnWideSheet(i, near))
    {
      this->Scale = this->GrowthIntoVoid(i, sparsest);
    }
    const double reach = std::max(this->ReachTo(i, sparsest, MaximumSparsity),
      std::min(LineReach * std::sqrt(nextLine) / this->Fits[i].Spacing, MaximumBeyondGap));
    if (this->CutAndMeasure(i, reach, cell) && this->HaveGap())
    {
      this->LookAcrossGap(i, cell);
    }
  }

  /// Whether the cells of two points may have a common border: those that end before it do not.
  bool MayMeet(int i, int j, float squaredDistance) const
  {
    const double reach =
      2.0 * this->Scale * CellReach * std::max(this->Fits[i].Spacing, this->Fits[j].Spacing);
    return squaredDistance <= reach * reach;
  }

  /// The angle between what the scanner of point i has seen around it; 0 if nothing tells.
  double StepOfScanner(int i)
  {
    const int nearest = std::min(CellNeighbors, this->Found.Count());
    const double step =
      this->View.LookAt(i) ? this->View.StepAmong(this->Found.Ids.data(), nearest) : 0.0;
    return std::isfinite(step) ? step : 0.0;
  }

  /// Whether the scanner of point i has seen point j next to it, and in the plane of both rather
  /// than behind it.
  bool IsNextSeen(int i, int j, double step) const
  {
    if (!(step > 0.0 && this->View.AngleTo(j) < MostStepsApart * step))
    {
      return false;
    }
    const Vector3 d = this->Between(i, j);
    const auto isInPlane = [&](const Vector3& normal) {
      return std::abs(Dot(normal, d)) <= MostBehind * this->View.Facing(normal) * Norm(d);
    };
    return isInPlane(this->Fits[i].Normal) && isInPlane(this->Fits[j].Normal);
  }

  double ReachTo(int i, double sparsest, double most) const
  {
    return this->Scale * CellReach * std::min(sparsest / this->Fits[i].Spacing, most);
  }

  /// Whether point i is on a surface rather than on something thin.
  /// @param near number of points that could have been on its sheet
  bool IsOnWideSheet(int i, int near) const
  {
    const PlaneFit& fit = this->Fits[i];
    return !fit.OnScanLines && fit.Flatness < FlatAtVoid &&
      !(this->Sheet.Count < ShareOfSheet * near || this->Sheet.Roundness() < RoundAtVoid);
  }

  /// How many times as far as others the cell reaches into a void of an uneven sampling, whose
  /// other side is added to the sheet.
  double GrowthIntoVoid(int i, double& sparsest)
  {
    double x, y;
    if (!this->Sheet.FindOutward(x, y))
    {
      return 1.0;
    }
    const double perReach = CellReach * this->Sheet.Growth(x, y);
    double growth = 1.0; // exp(perReach * growth); the largest such number is e
    for (int step = 0; step < GrowthSteps; ++step)
    {
      growth = std::exp(std::min(1.0, perReach * growth));
    }
    return growth > LeastGrowth && this->AddOtherSide(i, { x, y }, growth, sparsest) ? growth : 1.0;
  }

  /// Adds the other side of a void to the sheet. Returns false if there is none.
  bool AddOtherSide(int i, const std::array<double, 2>& way, double growth, double& sparsest)
  {
    const Vector3 outward = this->Outward(way[0], way[1]);
    const double most = ReachesOverVoid * CellReach * growth * this->Fits[i].Spacing;
    const auto isOpposite = [&](int j) {
      const Vector3 d = this->Between(i, j);
      const double along = Dot(d, outward), squared = Dot(d, d);
      const double climb =
        std::max(std::abs(Dot(d, this->Fits[i].Normal)), std::abs(Dot(d, this->Fits[j].Normal)));
      return along > 0.0 && along * along > CosineOverVoid * squared && squared < most * most &&
        this->Fits[j].Flatness < FlatAtVoid &&
        climb * climb < SlopeOverVoid * SlopeOverVoid * squared && this->AreOfSheet(i, j, d);
    };
    this->Beyond.clear();
    this->FindBeyond(i, 0.5 * most * outward, isOpposite);
    this->FindBeyond(i, most * outward, isOpposite);
    std::vector<int>& ids = this->Beyond;
    std::sort(ids.begin(), ids.end());
    ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
    if (ids.size() < FewestOverVoid)
    {
      return false;
    }
    for (const int j : ids)
    {
      this->AddToSheet(i, j, sparsest);
    }
    return true;
  }

  /// Adds the points around a place, relative to point i, that pass a test to those beyond.
  template <class Test>
  void FindBeyond(int i, const Vector3& place, Test&& isWanted)
  {
    const Vector3 at = Load(this->Cloud.Position(i)) + place;
    this->Tree.nearestKSearch(pcl::PointXYZ(static_cast<float>(at[0]), static_cast<float>(at[1]),
                                static_cast<float>(at[2])),
      CellNeighbors, this->Seen, this->SeenDistances);
    std::copy_if(this->Seen.begin(), this->Seen.end(), std::back_inserter(this->Beyond), isWanted);
  }

  Vector3 Outward(double x, double y) const
  {
    return Normalized(this->Plane.At(x, y), this->Plane.U);
  }

  /// Whether point j is one of the sparse points beyond a gap, within 60 degrees of its middle.
  bool IsSparse(int i, int j, const Vector3& outward) const
  {
    const Vector3 d = this->Between(i, j);
    const double along = Dot(d, outward), squared = Dot(d, d);
    return along > 0.0 && along * along > 0.25 * squared &&
      this->Fits[j].Spacing > LeastSparsity * this->Fits[i].Spacing &&
      this->MayMeet(i, j, static_cast<float>(squared)) && this->AreOfSheet(i, j, d);
  }

  /// Beside a step of density, a hundred dense points can be nearer than the first sparse one. So
  /// these are looked for around places on the side that has no neighbours. Beside a border there
  /// are none: the cell stays.
  void LookAcrossGap(int i, VoronoiCell& cell)
  {
    double x, y;
    if (!this->Sheet.FindOutward(x, y))
    {
      return;
    }
    const Vector3 outward = this->Outward(x, y);
    this->Sheet.Count = std::min(this->Sheet.Count, CellNeighbors);
    double sparsest = this->Fits[i].Spacing;
    for (const double distance : Lookouts)
    {
      this->Beyond.clear();
      this->FindBeyond(i, (distance * this->Fits[i].Spacing) * outward,
        [&](int j) { return this->IsSparse(i, j, outward); });
      if (this->Beyond.size() < FewestSparse)
      {
        continue;
      }
      for (const int j : this->Beyond)
      {
        this->AddToSheet(i, j, sparsest);
      }
      if (!this->CutAndMeasure(i, this->ReachTo(i, sparsest, MaximumBeyondGap), cell))
      {
        return;
      }
    }
  }

  /// @return whether the cell is open: the neighbours do not bound it on all sides
  bool CutAndMeasure(int i, double reach, VoronoiCell& cell)
  {
    FlatSheet& sheet = this->Sheet;
    FindFoldSides(this->Plane, sheet.Folds, sheet.Count,
      [&](int k, const CellSide& side) { sheet.Sides[k] = side; });
    CutCell(sheet, reach, this->Cell);
    // A cell that its neighbours bound is inside the surface, whatever the angles between them.
    const bool open = this->IsOpen(reach);
    if (open && this->HaveGap())
    {
      CutAtBorder(this->Sheet, reach, this->Scale, this->Cell);
    }
    this->MeasureCell(i, cell);
    return open;
  }

  void MeasureCell(int i, VoronoiCell& cell)
  {
    double area, first[2], second[3];
    this->Cell.Moments(area, first, second);
    if (!(area > 0.0))
    {
      cell = VoronoiCell();
      return;
    }
    const double mx = first[0] / area, my = first[1] / area;
    const double blur = this->Blur * this->Blur;
    this->SetKernel(i, second[0] / area - mx * mx + blur, second[2] / area - mx * my,
      second[1] / area - my * my + blur);
    const double spacing = this->Fits[i].Spacing;
    cell.Area = static_cast<float>(spacing * spacing * area);
    cell.Centroid = spacing * this->Plane.At(mx, my);
  }

  /// Makes the kernel from its covariance in the round metric, spacings squared.
  void SetKernel(int i, double rxx, double rxy, double ryy)
  {
    const double a = this->Plane.Back.XX, b = this->Plane.Back.XY, c = this->Plane.Back.YY;
    const double xx = a * a * rxx + 2.0 * a * b * rxy + b * b * ryy;
    const double xy = a * b * rxx + (a * c + b * b) * rxy + b * c * ryy;
    const double yy = b * b * rxx + 2.0 * b * c * rxy + c * c * ryy;
    const double half = 0.5 * std::sqrt((xx - yy) * (xx - yy) + 4.0 * xy * xy);
    double cosine, sine;
    PrincipalAxis(xx, yy, xy, cosine, sine);
    PlaneFit& fit = this->Fits[i];
    const double square = static_cast<double>(fit.Spacing) * fit.Spacing;
    // Measuring other cells reads none of these.
    fit.AxisU = cosine * this->Plane.U + sine * this->Plane.V;
    fit.VarianceU = static_cast<float>(square * std::max(0.0, 0.5 * (xx + yy) + half));
    fit.VarianceV = static_cast<float>(square * std::max(0.0, 0.5 * (xx + yy) - half));
  }

  /// Cuts the cell by the nearest neighbours on the same sheet. Returns false if the point has no
  /// cell.
  bool CutByNearest(int i)
  {
    const PlaneFit& fit = this->Fits[i];
    if (!fit.HasPlane() || !(fit.Spacing > 0.0))
    {
      this->Heights.Final[i] = 0.0f;
      return false;
    }
    const int* ids = this->Graph.Row(static_cast<std::size_t>(i));
    if (!this->Graph.AreNearest)
    {
      this->Tree.FindNearest(i, CellNeighbors, this->Found);
      this->Found.Ids.resize(CellNeighbors, -1);
      ids = this->Found.Ids.data();
    }
    const int count = CountIds(ids, CellNeighbors);
    this->LoadNear(i, ids, count);
    this->Heights.RiseAgain(i, fit, this->Near, ids, count);
    this->Cell.Reset(CellReach);
    float radius = std::numeric_limits<float>::infinity(); // squared; of the cell so far
    int cuts = 0;
    for (int k = 0; k < count; ++k)
    {
      const NearBisectors& near = this->Bisectors;
      if (near.Distances[k] < radius)
      {
        const bool isCut = this->Cell.Cut(near.CutX[k], near.CutY[k], near.Offsets[k]);
        ++cuts;
        // The first ones always reach; to find that out would take longer.
        if (isCut && cuts >= SureCuts)
        {
          radius = this->Cell.SquaredRadius();
        }
      }
    }
    return true;
  }

  /// @param d from point i to point j
  bool AreOfSheet(int i, int j, const Vector3& d) const
  {
    const std::vector<unsigned char>& twoSided = this->Oriented.TwoSided;
    return AreOfOneSheet(this->Fits[i], this->Fits[j], twoSided[i] || twoSided[j], d);
  }

  /// Loads the nearest neighbours of point i into its plane.
  void LoadNear(int i, const int* ids, int count)
  {
    this->Near.Load(this->Oriented, this->Fits, i, ids, count, CellFoldReach);
    this->Plane = SteeredPlane(this->Near.U, this->Near.V, this->SteeringOf(i));
    for (int k = 0; k < count && !this->Steering.empty(); ++k)
    {
      const Float3& steering = this->Steering[static_cast<std::size_t>(ids[k])];
      this->Bisectors.SX[k] = steering.X;
      this->Bisectors.SY[k] = steering.Y;
      this->Bisectors.SZ[k] = steering.Z;
    }
    FindBisectors(this->Near, this->Plane, this->Bisectors);
    if (LaneSum(this->Near.Folded) > 0.0f)
    {
      this->UseFolds(i, ids, count);
    }
  }

  /// Of the nearest neighbours.
  void UseFolds(int i, const int* ids, int count)
  {
    FoldLine folds[NearSheet::Capacity] = {};
    for (int k = 0; k < count; ++k)
    {
      if (this->Near.Folded[k] != 0.0f)
      {
        folds[k] =
          this->FoldBetween(i, ids[k], this->SeenFrom(i, ids[k], this->Between(i, ids[k])));
      }
    }
    NearBisectors& s = this->Bisectors;
    FindFoldSides(this->Plane, folds, count, [&](int k, const CellSide& side) {
      s.CutX[k] = side.X;
      s.CutY[k] = side.Y;
      s.Offsets[k] = side.Offset;
      s.Distances[k] = side.Offset * side.Offset / (side.X * side.X + side.Y * side.Y);
    });
  }

  bool IsOpen(double reach) const
  {
    return this->Cell.SquaredRadius() >= static_cast<float>(reach * reach);
  }

  Float3 SteeringOf(int i) const
  {
    return this->Steering.empty() ? Float3() : this->Steering[static_cast<std::size_t>(i)];
  }

  /// Adds point j, if it is on the same sheet or behind a fold, where it is on the unrolled
  /// surface, so that far points of a thin tube do not come too near.
  /// @param sparsest is raised to its spacing then
  /// @return whether it was added
  bool AddToSheet(int i, int j, double& sparsest)
  {
    FlatSheet& sheet = this->Sheet;
    const Vector3 d = this->Between(i, j);
    FoldedNeighbor at = this->SeenFrom(i, j, d);
    if (sheet.Count == SheetCapacity ||
      !(this->AreOfSheet(i, j, d) || at.HasFoldWithin(CellFoldReach)))
    {
      return false;
    }
    const FoldLine fold = this->FoldBetween(i, j, at);
    at.Unroll();
    const Float3 steering = this->SteeringOf(j);
    const float spacing = this->Fits[j].Spacing / this->Fits[i].Spacing;
    sheet.Add(
      PlaceInMetric(this->Plane, at.X, at.Y, static_cast<float>(Dot(steering, this->Plane.U)),
        static_cast<float>(Dot(steering, this->Plane.V)), SingleDot(steering, steering)),
      fold, spacing * spacing);
    sparsest = std::max<double>(sparsest, this->Fits[j].Spacing);
    return true;
  }

  /// Whether the normal is that of one side of a fold: others are means over it.
  static bool IsOfOneSide(const PlaneFit& fit) { return fit.Given || fit.Sharp; }

  /// The fold in front of point j, if it is known where.
  FoldLine FoldBetween(int i, int j, const FoldedNeighbor& at) const
  {
    return IsOfOneSide(this->Fits[i]) && IsOfOneSide(this->Fits[j]) ? at.Line() : FoldLine();
  }

  Vector3 Between(int i, int j) const
  {
    return Load(this->Cloud.Position(j)) - Load(this->Cloud.Position(i));
  }

  /// Point j in the plane of point i, in spacings of i.
  /// @param between from point i to point j
  FoldedNeighbor SeenFrom(int i, int j, const Vector3& between) const
  {
    const Vector3 n = this->Fits[i].Normal;
    Vector3 m = this->Fits[j].Normal;
    const Vector3& u = this->Plane.U;
    const Vector3& v = this->Plane.V;
    const Vector3 d = (1.0 / this->Fits[i].Spacing) * between;
    const auto dot = [](const Vector3& a, const Vector3& b) {
      return static_cast<float>(Dot(a, b));
    };
    if (this->Oriented.TwoSided[i] || this->Oriented.TwoSided[j])
    {
      m = AgreeingSign(dot(n, m), dot(d, n), dot(d, m)) * m;
    }
    return { dot(d, u), dot(d, v), dot(d, n), dot(d, m), dot(n, m), dot(m, u), dot(m, v) };
  }

  /// Whether all neighbours are on one side.
  bool HaveGap()
  {
    const FlatSheet& sheet = this->Sheet;
    this->Around.Clear();
    for (int k = 0; k < sheet.Count; ++k)
    {
      if (sheet.At[k].X != 0.0f || sheet.At[k].Y != 0.0f)
      {
        this->Around.Add(sheet.At[k].X, sheet.At[k].Y);
      }
    }
    return this->Around.HaveGap();
  }

  const OrientedCloud& Oriented;
  const LocalCloud& Cloud;
  const NeighborSearch& Tree;
  const NeighborGraph& Graph;
  const KernelSteering& Steering;
  const double Blur; // spacings
  PlaneFits& Fits;
  SurfaceHeights& Heights;
  ScannerView View;
  double Scale = 1.0; ///< of an open cell's reach and border
  Neighbors Found;
  pcl::Indices Seen;
  std::vector<int> Beyond;
  std::vector<float> SeenDistances;
  SteeredPlane Plane;
  NearSheet Near;
  NearBisectors Bisectors;
  FlatSheet Sheet;
  Directions Around;
  CellPolygon Cell;
};
}

bool MeasureCells(const OrientedCloud& oriented, const CellMetric& metric,
  const StageProgress& progress, PlaneFits& fits, VoronoiCells& cells, SurfaceHeights& heights)
{
  cells.resize(fits.size());
  return ParallelFor(oriented.Cloud.Size(), progress, [&](vtkIdType begin, vtkIdType end) {
    CellMeasurer measurer(oriented, metric, fits, heights);
    for (vtkIdType i = begin; i < end; ++i)
    {
      cells[i] = measurer.Measure(static_cast<int>(i));
    }
  });
}
}
