// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Estimation/VoronoiCell.h"

#include "Filters/Common/AngularGap.h"
#include "Filters/Common/LocalCloud.h"
#include "Filters/Common/Multiversion.h"
#include "Filters/Common/NeighborSearch.h"
#include "Filters/Estimation/CellPolygon.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace SurfelGeometry
{
namespace
{
/// Neighbours whose bisectors may bound a cell. In a random sampling a cell has 6 on average,
/// hardly ever one that is not among the 20 nearest points.
constexpr int CellNeighbors = KeptNeighbors;

/// Neighbours that may bound a cell which those leave open: beside a border or a step of density
/// they fill half a disc of a radius of 7 spacings, where 10 times sparser points have 7 in the
/// other.
constexpr int SheetCapacity = 4 * CellNeighbors;

/// Cells reach this many spacings at most, on sides without neighbours. In 20 000 random points,
/// the largest empty circle has a radius of about 1.7 spacings (exp(-pi r^2) = 1 / 20 000).
constexpr double CellReach = 2.0;

/// Where a neighbour is sparser, cells reach as many of its spacings, at most these times their
/// own: 16 to 1 in density. Beyond that a point is rather a stray one, unless it is among the
/// sparse ones beyond a gap: 100 to 1.
constexpr double MaximumSparsity = 4.0, MaximumBeyondGap = 10.0;

/// Distances, in spacings, at which sparser neighbours are looked for on a side that has none, and
/// how many times sparser they are at least: others are those of the other side of a hole.
constexpr double Lookouts[] = { 4.0, 8.0, 16.0 };
constexpr double LeastSparsity = 1.5;
constexpr std::size_t FewestSparse = 4; ///< fewer are the end of another thing

/// So many of the nearest neighbours cut the cell without asking whether they reach it.
constexpr int SureCuts = 6;

/// The surface ends where the surrounding areas, smoothed by a Gaussian of this many spacings,
/// cover half of the plane. Areas fitted near a border are a seventh too large (PlaneFit.cxx,
/// SetExtent), hence 0.57 instead of 0.5: squares of regular, jittered and random points then get
/// their area within 0.3 %.
constexpr double BorderSmoothing = 1.0;
constexpr double BorderCoverage = 0.57;
constexpr int BorderSteps = 12;

/// Neighbours of a point in its tangent plane, nearest first. Lengths in spacings of the point.
struct FlatSheet
{
  int Count;
  float X[SheetCapacity], Y[SheetCapacity];
  float Areas[SheetCapacity];

  void Add(float x, float y, float area)
  {
    this->X[this->Count] = x;
    this->Y[this->Count] = y;
    this->Areas[this->Count] = area;
    ++this->Count;
  }
};

/// The nearest neighbours of a point as a structure of arrays for SIMD loops. Lengths in spacings
/// of the point; differences to it are exact in float where neighbours are near each other.
struct NearSheet
{
  static constexpr int Capacity = (CellNeighbors + 7) / 8 * 8;

  alignas(32) float DX[Capacity] = {}, DY[Capacity] = {}, DZ[Capacity] = {};
  alignas(32) float NX[Capacity] = {}, NY[Capacity] = {}, NZ[Capacity] = {};
  alignas(32) int EitherTwoSided[Capacity] = {};
  alignas(32) float Spacings[Capacity] = {};
  alignas(32) float X[Capacity], Y[Capacity]; // see FlatSheet
  alignas(32) int IsOfSheet[Capacity];
};

/// Maps the neighbours to the tangent plane, as CellMeasurer::AddToSheet does.
SURFEL_MULTIVERSION void Flatten(
  const Float3& normal, const Float3& u, const Float3& v, NearSheet& s)
{
  constexpr auto leastCosine = static_cast<float>(SheetCosine);
  constexpr auto mostClimb = static_cast<float>(SheetClimb * SheetClimb);
  for (int k = 0; k < NearSheet::Capacity; ++k)
  {
    const float dx = s.DX[k], dy = s.DY[k], dz = s.DZ[k];
    const float cosine = normal.X * s.NX[k] + normal.Y * s.NY[k] + normal.Z * s.NZ[k];
    const float climb = normal.X * dx + normal.Y * dy + normal.Z * dz;
    const float squared = dx * dx + dy * dy + dz * dz;
    const float x = u.X * dx + u.Y * dy + u.Z * dz;
    const float y = v.X * dx + v.Y * dy + v.Z * dz;
    const float flat = x * x + y * y;
    const float scale = std::sqrt(squared / (flat > 0.0f ? flat : 1.0f));
    s.X[k] = scale * x;
    s.Y[k] = scale * y;
    const float agreement = s.EitherTwoSided[k] != 0 ? std::abs(cosine) : cosine;
    s.IsOfSheet[k] = (agreement >= leastCosine) & (climb * climb <= mostClimb * squared) ? 1 : 0;
  }
}

/// The point's cell among its neighbours.
void CutCell(const FlatSheet& sheet, double reach, CellPolygon& cell)
{
  cell.Reset(reach);
  for (int k = 0; k < sheet.Count; ++k)
  {
    const float x = sheet.X[k], y = sheet.Y[k];
    const float squared = x * x + y * y;
    if (squared < 4.0f * cell.SquaredRadius() && squared > 0.0f)
    {
      cell.Cut(x, y, 0.5f * squared);
    }
  }
}

class CellMeasurer
{
public:
  CellMeasurer(const OrientedCloud& oriented, PlaneFits& fits)
    : Cloud(oriented.Cloud)
    , Tree(oriented.Tree)
    , Graph(oriented.Graph)
    , TwoSided(oriented.TwoSided)
    , Fits(fits)
  {
  }

  VoronoiCell Measure(int i)
  {
    VoronoiCell cell;
    if (this->CutByNearest(i) && this->MeasureCell(i, CellReach, cell))
    {
      this->MeasureAgain(i, cell);
    }
    return cell;
  }

private:
  /// Measures an open cell again, with what bounds it beyond the nearest neighbours: in a random
  /// sampling, beyond a gap; where the density changes at once, the first of the sparse points.
  void MeasureAgain(int i, VoronoiCell& cell)
  {
    this->Tree.FindNearest(i, SheetCapacity, this->Found);
    this->Sheet.Count = 0;
    double sparsest = this->Fits[i].Spacing;
    for (int k = 0; k < this->Found.Count(); ++k)
    {
      const int j = this->Found.Ids[k];
      if (k < CellNeighbors || this->MayMeet(i, j, this->Found.SquaredDistances[k]))
      {
        sparsest =
          this->AddToSheet(i, j) ? std::max<double>(sparsest, this->Fits[j].Spacing) : sparsest;
      }
    }
    const double reach = this->ReachTo(i, sparsest, MaximumSparsity);
    if (this->CutAndMeasure(i, reach, cell) && this->HaveGap())
    {
      this->LookAcrossGap(i, cell);
    }
  }

  /// Whether the cells of two points may have a common border: those that end before it do not.
  bool MayMeet(int i, int j, float squaredDistance) const
  {
    const double reach = 2.0 * CellReach * std::max(this->Fits[i].Spacing, this->Fits[j].Spacing);
    return squaredDistance <= reach * reach;
  }

  double ReachTo(int i, double sparsest, double most) const
  {
    return CellReach * std::min(sparsest / this->Fits[i].Spacing, most);
  }

  /// Whether point j is one of the sparse points beyond a gap, within 60 degrees of its middle.
  bool IsSparse(int i, int j, const Vector3& outward) const
  {
    const Vector3 d = Load(this->Cloud.Position(j)) - Load(this->Cloud.Position(i));
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
    if (!this->FindOutward(x, y))
    {
      return;
    }
    const Vector3 point = Load(this->Cloud.Position(i));
    const Vector3 outward = x * this->U + y * this->V;
    this->Sheet.Count = std::min(this->Sheet.Count, CellNeighbors);
    double sparsest = this->Fits[i].Spacing;
    for (const double distance : Lookouts)
    {
      const Vector3 place = point + (distance * this->Fits[i].Spacing) * outward;
      this->Tree.nearestKSearch(pcl::PointXYZ(static_cast<float>(place[0]),
                                  static_cast<float>(place[1]), static_cast<float>(place[2])),
        CellNeighbors, this->Seen, this->SeenDistances);
      this->Sparse.clear();
      for (const int j : this->Seen)
      {
        if (this->IsSparse(i, j, outward))
        {
          this->Sparse.push_back(j);
        }
      }
      if (this->Sparse.size() < FewestSparse)
      {
        continue;
      }
      for (const int j : this->Sparse)
      {
        sparsest =
          this->AddToSheet(i, j) ? std::max<double>(sparsest, this->Fits[j].Spacing) : sparsest;
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
    CutCell(this->Sheet, reach, this->Cell);
    return this->MeasureCell(i, reach, cell);
  }

  /// @return whether the cell is open
  bool MeasureCell(int i, double reach, VoronoiCell& cell)
  {
    // A cell that its neighbours bound is inside the surface, whatever the angles between them.
    const bool open = this->IsOpen(reach);
    if (open && this->HaveGap())
    {
      this->CutAtBorder(reach);
    }
    double area, first[2], second[3];
    this->Cell.Moments(area, first, second);
    if (!(area > 0.0))
    {
      cell = VoronoiCell();
      return open;
    }
    const double mx = first[0] / area, my = first[1] / area;
    const double xx = second[0] / area - mx * mx;
    const double yy = second[1] / area - my * my;
    const double xy = second[2] / area - mx * my;
    const double half = 0.5 * std::sqrt((xx - yy) * (xx - yy) + 4.0 * xy * xy);
    double cosine, sine;
    PrincipalAxis(xx, yy, xy, cosine, sine);
    PlaneFit& fit = this->Fits[i];
    const double spacing = fit.Spacing, square = spacing * spacing;
    const Vector3 u = this->U, v = this->V;
    cell.Area = static_cast<float>(square * area);
    cell.Centroid = (spacing * mx) * u + (spacing * my) * v;
    fit.AxisU = cosine * u + sine * v; // which measuring other cells does not read
    fit.VarianceU = static_cast<float>(square * std::max(0.0, 0.5 * (xx + yy) + half));
    fit.VarianceV = static_cast<float>(square * std::max(0.0, 0.5 * (xx + yy) - half));
    return open;
  }

  /// Maps the nearest neighbours on the same sheet to the tangent plane and cuts the cell by them:
  /// as far as they reach, or all of them if they leave the cell open. Returns false if the point
  /// has no cell.
  bool CutByNearest(int i)
  {
    const PlaneFit& fit = this->Fits[i];
    if (fit.Isolated || fit.Degenerate || !(fit.Spacing > 0.0))
    {
      return false;
    }
    TangentFrame(fit.Normal, this->U, this->V);
    const int* ids = this->Graph.Row(static_cast<std::size_t>(i));
    if (!this->Graph.AreNearest)
    {
      this->Tree.FindNearest(i, CellNeighbors, this->Found);
      this->Found.Ids.resize(CellNeighbors, -1);
      ids = this->Found.Ids.data();
    }
    const int count = static_cast<int>(std::find(ids, ids + CellNeighbors, -1) - ids);
    this->LoadNear(i, ids, count);
    Flatten(fit.Normal, this->U, this->V, this->Near);
    this->Sheet.Count = 0;
    this->Cell.Reset(CellReach);
    constexpr auto open = static_cast<float>(CellReach * CellReach);
    float radius = std::numeric_limits<float>::infinity(); // squared; of the cell so far
    bool reaches = true;
    for (int k = 0; k < count && (reaches || radius >= open); ++k)
    {
      if (this->Near.IsOfSheet[k])
      {
        const float x = this->Near.X[k], y = this->Near.Y[k], spacing = this->Near.Spacings[k];
        const float squared = x * x + y * y;
        reaches = squared < 4.0f * radius;
        const bool isCut = reaches && squared > 0.0f && this->Cell.Cut(x, y, 0.5f * squared);
        this->Sheet.Add(x, y, spacing * spacing);
        // The first ones always reach; to find that out would take longer.
        if (isCut && this->Sheet.Count >= SureCuts)
        {
          radius = this->Cell.SquaredRadius();
        }
      }
    }
    return true;
  }

  /// Loads the nearest neighbours of point i.
  void LoadNear(int i, const int* ids, int count)
  {
    const float* p = this->Cloud.Position(i);
    const float inverse = 1.0f / this->Fits[i].Spacing;
    NearSheet& near = this->Near;
    for (int k = 0; k < count; ++k)
    {
      const int j = ids[k];
      const float* q = this->Cloud.Position(j);
      const PlaneFit& fit = this->Fits[j];
      near.DX[k] = inverse * (q[0] - p[0]);
      near.DY[k] = inverse * (q[1] - p[1]);
      near.DZ[k] = inverse * (q[2] - p[2]);
      near.NX[k] = fit.Normal.X;
      near.NY[k] = fit.Normal.Y;
      near.NZ[k] = fit.Normal.Z;
      near.EitherTwoSided[k] = this->TwoSided[i] | this->TwoSided[j];
      near.Spacings[k] = inverse * fit.Spacing;
    }
  }

  bool IsOpen(double reach) const
  {
    return this->Cell.SquaredRadius() >= static_cast<float>(reach * reach);
  }

  /// @param d from point i to point j
  bool AreOfSheet(int i, int j, const Vector3& d) const
  {
    return AreOfOneSheet(this->Fits[i], this->Fits[j], this->TwoSided[i] || this->TwoSided[j], d);
  }

  /// Adds point j, if it is on the same sheet, at its distance in space: the surface is unrolled,
  /// so that far points of a thin tube do not come too near.
  /// @return whether it is
  bool AddToSheet(int i, int j)
  {
    const Vector3 d = Load(this->Cloud.Position(j)) - Load(this->Cloud.Position(i));
    if (!this->AreOfSheet(i, j, d))
    {
      return false;
    }
    FlatSheet& sheet = this->Sheet;
    if (sheet.Count == SheetCapacity)
    {
      return false;
    }
    const double inverse = 1.0 / this->Fits[i].Spacing;
    const double x = Dot(d, this->U), y = Dot(d, this->V);
    const double flat = x * x + y * y;
    const double scale = flat > 0.0 ? inverse * std::sqrt(Dot(d, d) / flat) : 0.0;
    const double spacing = inverse * this->Fits[j].Spacing;
    sheet.Add(static_cast<float>(scale * x), static_cast<float>(scale * y),
      static_cast<float>(spacing * spacing));
    return true;
  }

  /// Whether all neighbours are on one side.
  bool HaveGap()
  {
    const FlatSheet& sheet = this->Sheet;
    this->Around.Clear();
    for (int k = 0; k < sheet.Count; ++k)
    {
      if (sheet.X[k] != 0.0f || sheet.Y[k] != 0.0f)
      {
        this->Around.Add(sheet.X[k], sheet.Y[k]);
      }
    }
    return this->Around.HaveGap();
  }

  /// The direction, a unit vector, in which there are the fewest neighbours; false if all are
  /// alike.
  bool FindOutward(double& x, double& y) const
  {
    x = y = 0.0;
    for (int k = 0; k < this->Sheet.Count; ++k)
    {
      x -= this->Sheet.X[k];
      y -= this->Sheet.Y[k];
    }
    const double length = std::sqrt(x * x + y * y);
    x /= length;
    y /= length;
    return length > 0.0;
  }

  /// Cuts the cell where the surface ends on the side without neighbours.
  void CutAtBorder(double reach)
  {
    double outward[2];
    if (!this->FindOutward(outward[0], outward[1]))
    {
      return;
    }
    double inside = 0.0, outside = reach;
    for (int step = 0; step < BorderSteps; ++step)
    {
      const double middle = 0.5 * (inside + outside);
      const bool covered =
        this->Coverage(middle * outward[0], middle * outward[1]) >= BorderCoverage;
      (covered ? inside : outside) = middle;
    }
    this->Cell.Cut(static_cast<float>(outward[0]), static_cast<float>(outward[1]),
      static_cast<float>(std::max(inside, 0.05)));
  }

  /// Share of the plane around (x, y) that the surrounding areas cover.
  double Coverage(double x, double y) const
  {
    const FlatSheet& sheet = this->Sheet;
    constexpr double variance = BorderSmoothing * BorderSmoothing;
    double sum = std::exp(-0.5 * (x * x + y * y) / variance);
    for (int k = 0; k < sheet.Count; ++k)
    {
      const double dx = sheet.X[k] - x, dy = sheet.Y[k] - y;
      sum += sheet.Areas[k] * std::exp(-0.5 * (dx * dx + dy * dy) / variance);
    }
    return sum / (2.0 * Pi * variance);
  }

  const LocalCloud& Cloud;
  const NeighborSearch& Tree;
  const NeighborGraph& Graph;
  const std::vector<unsigned char>& TwoSided;
  PlaneFits& Fits;
  Neighbors Found;
  pcl::Indices Seen;
  std::vector<int> Sparse;
  std::vector<float> SeenDistances;
  Vector3 U, V;
  NearSheet Near;
  FlatSheet Sheet;
  Directions Around;
  CellPolygon Cell;
};
}

bool MeasureCells(const OrientedCloud& oriented, const StageProgress& progress, PlaneFits& fits,
  VoronoiCells& cells)
{
  cells.resize(fits.size());
  return ParallelFor(oriented.Cloud.Size(), progress, [&](vtkIdType begin, vtkIdType end) {
    CellMeasurer measurer(oriented, fits);
    for (vtkIdType i = begin; i < end; ++i)
    {
      cells[i] = measurer.Measure(static_cast<int>(i));
    }
  });
}
}
