// SPDX-License-Identifier: BSD-3-Clause
#include "SurfelCell.h"

#include "LocalCloud.h"
#include "SurfelNeighborhood.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace SurfelGeometry
{
namespace
{
constexpr double Pi = 3.14159265358979323846;

/// Neighbours whose bisectors may bound a cell: in a random sampling a cell has 6 on average and
/// hardly ever one that is not among the 20 nearest.
constexpr int CellNeighbors = KeptNeighbors;

/// Cells end at this many spacings, where a point has no neighbours on one side.
constexpr double CellReach = 2.0;
constexpr int ReachCorners = 12;

/// The surface ends where the areas about, smoothed by a Gaussian of this many spacings, cover half
/// of the plane. Areas fitted near a border are a seventh too large (SurfelFit.cxx, SetExtent),
/// hence 0.57 instead of 0.5: squares of regular, jittered and random points then get their area
/// within 0.3 %.
constexpr double BorderSmoothing = 1.0;
constexpr double BorderCoverage = 0.57;
constexpr int BorderSteps = 12;

struct Point2
{
  double X, Y;
};

/// A convex polygon that is cut by half-planes.
class Polygon
{
public:
  void Reset(double radius)
  {
    static const std::array<Point2, ReachCorners> corners = UnitCorners();
    this->Count = ReachCorners;
    for (int k = 0; k < ReachCorners; ++k)
    {
      this->Corners[k] = { radius * corners[k].X, radius * corners[k].Y };
    }
    this->Measure();
  }

  /// Keeps what has n.x <= d.
  void Cut(const Point2& n, double d)
  {
    double distances[MostCorners];
    bool cuts = false;
    for (int k = 0; k < this->Count; ++k)
    {
      distances[k] = n.X * this->Corners[k].X + n.Y * this->Corners[k].Y - d;
      cuts = cuts || distances[k] > 0.0;
    }
    if (!cuts)
    {
      return;
    }
    Point2 kept[MostCorners];
    int count = 0;
    for (int k = 0; k < this->Count; ++k)
    {
      const int next = k + 1 < this->Count ? k + 1 : 0;
      const Point2 a = this->Corners[k], b = this->Corners[next];
      const double da = distances[k], db = distances[next];
      if (da <= 0.0)
      {
        kept[count++] = a;
      }
      if ((da < 0.0 && db > 0.0) || (da > 0.0 && db < 0.0))
      {
        const double t = da / (da - db);
        kept[count++] = { a.X + t * (b.X - a.X), a.Y + t * (b.Y - a.Y) };
      }
    }
    std::copy(kept, kept + count, this->Corners);
    this->Count = count;
    this->Measure();
  }

  double SquaredRadius() const { return this->Squared; }

  /// Area, first and second moments about the origin, as sums over the triangles with the origin.
  void Moments(double& area, Point2& first, double second[3]) const
  {
    area = 0.0;
    first = { 0.0, 0.0 };
    second[0] = second[1] = second[2] = 0.0;
    for (int k = 0; k < this->Count; ++k)
    {
      const Point2& a = this->Corners[k];
      const Point2& b = this->Corners[k + 1 < this->Count ? k + 1 : 0];
      const double cross = a.X * b.Y - a.Y * b.X;
      area += cross / 2.0;
      first.X += cross * (a.X + b.X) / 6.0;
      first.Y += cross * (a.Y + b.Y) / 6.0;
      second[0] += cross * (a.X * a.X + a.X * b.X + b.X * b.X) / 12.0;
      second[1] += cross * (a.Y * a.Y + a.Y * b.Y + b.Y * b.Y) / 12.0;
      second[2] += cross * (2.0 * a.X * a.Y + a.X * b.Y + b.X * a.Y + 2.0 * b.X * b.Y) / 24.0;
    }
  }

private:
  /// A cut adds a corner at most; all neighbours cut, and the border.
  static constexpr int MostCorners = ReachCorners + CellNeighbors + 2;

  static std::array<Point2, ReachCorners> UnitCorners()
  {
    std::array<Point2, ReachCorners> corners;
    const double outer = 1.0 / std::cos(Pi / ReachCorners);
    for (int k = 0; k < ReachCorners; ++k)
    {
      const double angle = 2.0 * Pi * k / ReachCorners;
      corners[k] = { outer * std::cos(angle), outer * std::sin(angle) };
    }
    return corners;
  }

  void Measure()
  {
    this->Squared = 0.0;
    for (int k = 0; k < this->Count; ++k)
    {
      const Point2& c = this->Corners[k];
      this->Squared = std::max(this->Squared, c.X * c.X + c.Y * c.Y);
    }
  }

  Point2 Corners[MostCorners];
  int Count = 0;
  double Squared = 0.0; // radius
};

class CellMeasurer
{
public:
  CellMeasurer(const LocalCloud& cloud, const SurfelNeighborhood& tree, const NeighborGraph& graph,
    const std::vector<unsigned char>& twoSided, const std::vector<SurfelFit>& fits)
    : Cloud(cloud)
    , Tree(tree)
    , Graph(graph)
    , TwoSided(twoSided)
    , Fits(fits)
  {
  }

  SurfelCell Measure(int i)
  {
    const SurfelFit& fit = this->Fits[i];
    SurfelCell cell;
    if (fit.Isolated || fit.Degenerate || !(fit.Spacing > 0.0))
    {
      return cell;
    }
    Vector3 u, v;
    TangentFrame(fit.Normal, u, v);
    this->Unfold(i, u, v);
    this->Cell.Reset(CellReach * fit.Spacing);
    for (const Point2& p : this->Sheet)
    {
      const double squared = p.X * p.X + p.Y * p.Y;
      if (squared < 4.0 * this->Cell.SquaredRadius() && squared > 0.0)
      {
        this->Cell.Cut(p, 0.5 * squared);
      }
    }
    this->CutAtBorder(fit.Spacing);

    double area, second[3];
    Point2 first;
    this->Cell.Moments(area, first, second);
    if (!(area > 0.0))
    {
      return cell;
    }
    const double mx = first.X / area, my = first.Y / area;
    const double xx = second[0] / area - mx * mx;
    const double yy = second[1] / area - my * my;
    const double xy = second[2] / area - mx * my;
    const double half = 0.5 * std::sqrt((xx - yy) * (xx - yy) + 4.0 * xy * xy);
    double cosine, sine;
    PrincipalAxis(xx, yy, xy, cosine, sine);
    cell.Area = static_cast<float>(area);
    cell.Centroid = mx * u + my * v;
    cell.AxisU = cosine * u + sine * v;
    cell.VarianceU = static_cast<float>(std::max(0.0, 0.5 * (xx + yy) + half));
    cell.VarianceV = static_cast<float>(std::max(0.0, 0.5 * (xx + yy) - half));
    return cell;
  }

private:
  /// Neighbours of one's own sheet in the tangent plane, nearest first, at their distance in space:
  /// the plane is unrolled around the point, so that a thin tube's far points do not come too near.
  void Unfold(int i, const Vector3& u, const Vector3& v)
  {
    const int* ids = this->Graph.Row(static_cast<std::size_t>(i));
    if (!this->Graph.AreNearest)
    {
      this->Tree.FindNearest(i, CellNeighbors, this->Found);
      this->Found.Ids.resize(CellNeighbors, -1);
      ids = this->Found.Ids.data();
    }
    this->Sheet.clear();
    this->Areas.clear();
    const Vector3 p = Load(this->Cloud.Position(i));
    for (int k = 0; k < CellNeighbors && ids[k] >= 0; ++k)
    {
      const int j = ids[k];
      const Vector3 d = Load(this->Cloud.Position(j)) - p;
      if (!AreOfOneSheet(this->Fits[i], this->Fits[j], this->TwoSided[i] || this->TwoSided[j], d))
      {
        continue;
      }
      const double x = Dot(d, u), y = Dot(d, v);
      const double flat = x * x + y * y;
      const double scale = flat > 0.0 ? std::sqrt(Dot(d, d) / flat) : 0.0;
      this->Sheet.push_back({ scale * x, scale * y });
      const double spacing = this->Fits[j].Spacing;
      this->Areas.push_back(spacing * spacing);
    }
  }

  /// Where all neighbours are on one side: cuts the cell where the surface ends on the other.
  void CutAtBorder(double spacing)
  {
    this->Gap.Clear();
    Point2 mean{ 0.0, 0.0 };
    for (const Point2& p : this->Sheet)
    {
      this->Gap.Add(p.X, p.Y);
      mean.X += p.X;
      mean.Y += p.Y;
    }
    const double length = std::hypot(mean.X, mean.Y);
    if (!(length > 0.0) || !this->Gap.Exists())
    {
      return;
    }
    const Point2 outward{ -mean.X / length, -mean.Y / length };
    double inside = 0.0, outside = CellReach * spacing;
    for (int step = 0; step < BorderSteps; ++step)
    {
      const double middle = 0.5 * (inside + outside);
      const bool covered =
        this->Coverage({ middle * outward.X, middle * outward.Y }, spacing) >= BorderCoverage;
      (covered ? inside : outside) = middle;
    }
    this->Cell.Cut(outward, std::max(inside, 0.05 * spacing));
  }

  /// Share of the plane that the areas about cover at a place.
  double Coverage(const Point2& at, double spacing) const
  {
    const double sigma = BorderSmoothing * spacing;
    double sum = spacing * spacing * std::exp(-0.5 * (at.X * at.X + at.Y * at.Y) / (sigma * sigma));
    for (std::size_t k = 0; k < this->Sheet.size(); ++k)
    {
      const double dx = this->Sheet[k].X - at.X, dy = this->Sheet[k].Y - at.Y;
      sum += this->Areas[k] * std::exp(-0.5 * (dx * dx + dy * dy) / (sigma * sigma));
    }
    return sum / (2.0 * Pi * sigma * sigma);
  }

  const LocalCloud& Cloud;
  const SurfelNeighborhood& Tree;
  const NeighborGraph& Graph;
  const std::vector<unsigned char>& TwoSided;
  const std::vector<SurfelFit>& Fits;
  Neighbors Found;
  std::vector<Point2> Sheet;
  std::vector<double> Areas;
  DirectionGap Gap;
  Polygon Cell;
};
}

bool MeasureCells(const LocalCloud& cloud, const SurfelNeighborhood& tree,
  const NeighborGraph& graph, const std::vector<unsigned char>& twoSided,
  const std::vector<SurfelFit>& fits, const SurfelMonitor& monitor, std::vector<SurfelCell>& cells)
{
  cells.resize(fits.size());
  return ParallelFor(cloud.Size(), monitor, [&](vtkIdType begin, vtkIdType end) {
    CellMeasurer measurer(cloud, tree, graph, twoSided, fits);
    for (vtkIdType i = begin; i < end; ++i)
    {
      cells[i] = measurer.Measure(static_cast<int>(i));
    }
  });
}
}
