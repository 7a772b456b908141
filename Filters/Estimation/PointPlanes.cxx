// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Estimation/PointPlanes.h"

#include "Filters/Common/ParallelFor.h"
#include "Filters/Neighbors/LocalCloud.h"
#include "Filters/Neighbors/NeighborGraph.h"

#include <algorithm>
#include <cstddef>

namespace SurfelGeometry
{
namespace
{
/// The nearest points that tell the tilt. With 12, fewer gaps of a scanned lion remain, but blurred
/// by 100 px it has 1.4 times as many seams.
constexpr int TiltNeighbors = KeptNeighbors;

/// With fewer points, the point itself among them, next to nothing is known about chance.
constexpr double FewestPoints = 6.0;

/// Points that are nearer to a line than this, determinant over squared trace of their covariance,
/// have no tilt.
constexpr double LeastSpreadOfTilt = 0.01;

/// A slope counts as chance up to so many times its variance: of random ones exp(-3), 5 %, turn
/// normals at all. With 1 instead, those of leaves turn more, and there are more seams.
constexpr double Doubt = 3.0;

/// Sums over a point, at the origin, and its neighbours in its tangent plane.
struct ClimbMoments
{
  double Count = 1.0;
  double X = 0.0, Y = 0.0, Z = 0.0;
  double XX = 0.0, XY = 0.0, YY = 0.0, XZ = 0.0, YZ = 0.0, ZZ = 0.0;

  /// @param z how far a neighbour climbs
  void Add(double x, double y, double z)
  {
    this->Count += 1.0;
    this->X += x;
    this->Y += y;
    this->Z += z;
    this->XX += x * x;
    this->XY += x * y;
    this->YY += y * y;
    this->XZ += x * z;
    this->YZ += y * z;
    this->ZZ += z * z;
  }
};

/// How fast points climb over a tangent plane.
struct Tilt
{
  double X = 0.0, Y = 0.0;
};

/// The slope by regression, shrunk (Stein 1956): its expected square is that of the true slope plus
/// its variance.
Tilt FitTilt(const ClimbMoments& m)
{
  const double inverse = 1.0 / m.Count;
  const double xx = m.XX - inverse * m.X * m.X;
  const double xy = m.XY - inverse * m.X * m.Y;
  const double yy = m.YY - inverse * m.Y * m.Y;
  const double determinant = xx * yy - xy * xy;
  if (m.Count < FewestPoints || !(determinant > LeastSpreadOfTilt * (xx + yy) * (xx + yy)))
  {
    return {};
  }
  const double xz = m.XZ - inverse * m.X * m.Z;
  const double yz = m.YZ - inverse * m.Y * m.Z;
  const double zz = m.ZZ - inverse * m.Z * m.Z;
  const double x = (yy * xz - xy * yz) / determinant;
  const double y = (xx * yz - xy * xz) / determinant;
  const double rest = std::max(0.0, zz - x * xz - y * yz) / (m.Count - 3.0);
  const double chance = Doubt * rest * (xx + yy) / determinant;
  const double squared = x * x + y * y;
  const double share = squared > chance ? 1.0 - chance / squared : 0.0;
  return { share * x, share * y };
}

Vector3 TurnedNormal(const OrientedCloud& oriented, const PlaneFits& fits, int i)
{
  const PlaneFit& fit = fits[i];
  if (!fit.Given || fit.Isolated)
  {
    return fit.Normal;
  }
  const Vector3 point = Load(oriented.Cloud.Position(i)), normal = fit.Normal;
  Vector3 u, v;
  TangentFrame(normal, u, v);
  ClimbMoments moments;
  const int* ids = oriented.Graph.Row(static_cast<std::size_t>(i));
  for (int k = 0; k < TiltNeighbors && ids[k] >= 0; ++k)
  {
    const int j = ids[k];
    const Vector3 d = Load(oriented.Cloud.Position(j)) - point;
    if (AreOfOneSheet(fit, fits[j], oriented.TwoSided[i] || oriented.TwoSided[j], d))
    {
      // A chord of a circle is across the mean of the normals at its ends: curves do not climb.
      const Vector3 other = fits[j].Normal;
      const double sign = Dot(normal, other) < 0.0 ? -1.0 : 1.0;
      moments.Add(Dot(d, u), Dot(d, v), 0.5 * (Dot(d, normal) + sign * Dot(d, other)));
    }
  }
  const Tilt tilt = FitTilt(moments);
  return Normalized(normal + (-tilt.X) * u + (-tilt.Y) * v, normal);
}
}

bool TurnToPoints(const OrientedCloud& oriented, const StageProgress& progress, PlaneFits& fits)
{
  const vtkIdType count = oriented.Cloud.Size();
  RawVector<Float3> normals(fits.size()); // first all are read, then all are changed
  const auto find = [&](vtkIdType i, vtkIdType end) {
    for (; i < end; ++i)
    {
      normals[i] = TurnedNormal(oriented, fits, static_cast<int>(i));
    }
  };
  if (!ParallelFor(count, progress, find))
  {
    return false;
  }
  ParallelFor(0, count, [&](vtkIdType i, vtkIdType end) {
    for (; i < end; ++i)
    {
      fits[i].Normal = normals[i];
    }
  });
  return true;
}
}
