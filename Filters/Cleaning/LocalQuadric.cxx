// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Cleaning/LocalQuadric.h"

#include "Core/Simd/Multiversion.h"
#include "Filters/Common/ArrayTuples.h"

#include <pcl/surface/impl/mls.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace pcl
{
/// The sums of PCL's own in the same order. That one writes a number and at once reads it together
/// with the one after it, for which processors wait: a third of the time of a fit.
template <>
inline unsigned int computeCovarianceMatrix(const PointCloud<SurfelGeometry::QuadricPoint>& cloud,
  const Indices& indices, const Eigen::Vector4d& mean, Eigen::Matrix3d& covariance)
{
  double xx = 0.0, xy = 0.0, xz = 0.0, yy = 0.0, yz = 0.0, zz = 0.0;
  for (const index_t i : indices)
  {
    const double x = cloud[i].x - mean[0], y = cloud[i].y - mean[1], z = cloud[i].z - mean[2];
    xx += x * x;
    xy += x * y;
    xz += x * z;
    yy += y * y;
    yz += y * z;
    zz += z * z;
  }
  covariance << xx, xy, xz, xy, yy, yz, xz, yz, zz;
  return static_cast<unsigned int>(indices.size());
}
}

namespace SurfelGeometry
{
namespace
{
/// Variance of colours of 8 bits by noise alone.
constexpr double ColorNoise = 64.0;

constexpr int QuadricTerms = 6;

/// What is needed for heights above a quadric: PCL's getMLSCoordinates() and getPolynomialValue().
struct HeightFormula
{
  static constexpr int MostPoints = 64; // at a time

  Vector3 Mean, U, V, W;
  double Terms[QuadricTerms];

  explicit HeightFormula(const pcl::MLSResult& s)
    : Mean(ToVector(s.mean))
    , U(ToVector(s.u_axis))
    , V(ToVector(s.v_axis))
    , W(ToVector(s.plane_normal))
  {
    std::copy_n(s.c_vec.data(), QuadricTerms, this->Terms);
  }

  static Vector3 ToVector(const Eigen::Vector3d& a) { return { a[0], a[1], a[2] }; }
};

/// A place on the plane's axes, and the height above the quadric there.
struct PlaceAboveQuadric
{
  double U, V, Height;
};

inline PlaceAboveQuadric PlaceAbove(const float* point, const HeightFormula& formula)
{
  const auto& [mean, a, b, c, terms] = formula;
  const double x = point[0] - mean[0], y = point[1] - mean[1], z = point[2] - mean[2];
  const double u = x * a[0] + (y * a[1] + z * a[2]), v = x * b[0] + (y * b[1] + z * b[2]);
  const double w = x * c[0] + (y * c[1] + z * c[2]);
  return { u, v,
    w -
      (terms[0] + terms[1] * v + terms[2] * (v * v) + terms[3] * u + terms[4] * u * v +
        terms[5] * (u * u)) };
}

/// @param points [4 count] x, y, z, and something else
SURFEL_MULTIVERSION void FindHeights(const float* __restrict points, int count,
  const HeightFormula& formula, double* __restrict heights)
{
  for (int k = 0; k < count; ++k)
  {
    heights[k] = PlaceAbove(points + 4 * k, formula).Height;
  }
}

/// @param squares [count] squared distances from the quadric, to first order
SURFEL_MULTIVERSION void FindSquares(const float* __restrict points, int count,
  const HeightFormula& formula, double* __restrict squares)
{
  const double* terms = formula.Terms;
  for (int k = 0; k < count; ++k)
  {
    const auto [u, v, height] = PlaceAbove(points + 4 * k, formula);
    const double alongU = terms[3] + terms[4] * v + 2.0 * terms[5] * u;
    const double alongV = terms[1] + 2.0 * terms[2] * v + terms[4] * u;
    squares[k] = height * height / (1.0 + alongU * alongU + alongV * alongV);
  }
}

/// Second derivatives of a quadric along its axes.
struct Curvatures
{
  double UU, VV, UV;

  explicit Curvatures(const Eigen::VectorXd& terms)
    : UU(2.0 * terms[5])
    , VV(2.0 * terms[2])
    , UV(terms[4])
  {
  }

  /// The eigenvalues are Mean() + Half() and Mean() - Half().
  double Mean() const { return 0.5 * (this->UU + this->VV); }
  double Half() const
  {
    const double half = 0.5 * (this->UU - this->VV);
    return std::sqrt(half * half + this->UV * this->UV); // std::hypot would need glibc 2.35
  }
};
}

Vector3 SampledColors::Get(int i) const
{
  double color[4]; // with an opacity perhaps
  ReadTuple(this->Array, this->Cloud.InputIds[static_cast<size_t>(i)], color);
  return { color[0], color[1], color[2] };
}

double SpacingOf(const Neighbors& neighbors)
{
  return std::sqrt(Pi * neighbors.SquaredDistances.back() / neighbors.Count());
}

void LocalQuadric::Load(const LocalCloud& cloud, int i, const Neighbors& neighbors)
{
  const float* p = cloud.Position(i);
  this->Near.resize(neighbors.Ids.size() + 1);
  this->Near[0] = QuadricPoint(0.0f, 0.0f, 0.0f);
  for (size_t k = 0; k < neighbors.Ids.size(); ++k)
  {
    const float* q = cloud.Position(neighbors.Ids[k]);
    this->Near[k + 1] = QuadricPoint(q[0] - p[0], q[1] - p[1], q[2] - p[2]);
  }
}

void LocalQuadric::FitTo(size_t first, const Neighbors& neighbors)
{
  this->Indices.resize(this->Near.size() - first);
  for (size_t k = 0; k < this->Indices.size(); ++k)
  {
    this->Indices[k] = static_cast<pcl::index_t>(k + first);
  }
  this->Reach = std::sqrt(neighbors.SquaredDistances.back());
  this->Surface.computeMLSSurface(this->Near, 0, this->Indices, this->Reach, 2);
}

void LocalQuadric::Fit(const LocalCloud& cloud, int i, const Neighbors& neighbors)
{
  this->Load(cloud, i, neighbors);
  this->Fit(neighbors);
}

void LocalQuadric::FitOthers(const LocalCloud& cloud, int i, const Neighbors& neighbors)
{
  this->Load(cloud, i, neighbors);
  this->FitTo(1, neighbors);
}

template <typename Visit>
void LocalQuadric::ForResiduals(double spacing, Visit&& visit) const
{
  const HeightFormula formula(this->Surface);
  double heights[HeightFormula::MostPoints];
  for (size_t first = 0; first < this->Near.size(); first += HeightFormula::MostPoints)
  {
    const auto count = std::min<size_t>(HeightFormula::MostPoints, this->Near.size() - first);
    FindHeights(this->Near[first].data, static_cast<int>(count), formula, heights);
    std::for_each(heights, heights + count, [&](double height) { visit(height / spacing); });
  }
}

double LocalQuadric::DeviationOf(double squares) const
{
  const double count = static_cast<double>(this->Near.size());
  return std::sqrt(squares / std::max(1.0, count - QuadricTerms));
}

Residuals LocalQuadric::Measure(double spacing) const
{
  double squares = 0.0, fourths = 0.0;
  this->ForResiduals(spacing, [&](double residual) {
    squares += residual * residual;
    fourths += std::pow(residual, 4);
  });
  const double count = static_cast<double>(this->Near.size());
  return { this->DeviationOf(squares),
    squares > 0.0 ? count * fourths / (squares * squares) : 0.0 };
}

double LocalQuadric::Deviation(double spacing) const
{
  double squares = 0.0;
  this->ForResiduals(spacing, [&](double residual) { squares += residual * residual; });
  return this->DeviationOf(squares);
}

double LocalQuadric::Squares() const
{
  const HeightFormula formula(this->Surface);
  double values[HeightFormula::MostPoints], sum = 0.0;
  for (size_t first = 0; first < this->Near.size(); first += HeightFormula::MostPoints)
  {
    const auto count = std::min<size_t>(HeightFormula::MostPoints, this->Near.size() - first);
    FindSquares(this->Near[first].data, static_cast<int>(count), formula, values);
    sum = std::accumulate(values, values + count, sum);
  }
  return sum;
}

double LocalQuadric::UnbiasedSquares() const
{
  const double count = static_cast<double>(this->Near.size());
  return count / std::max(1.0, count - QuadricTerms) * this->Squares();
}

double LocalQuadric::Bend() const
{
  const Curvatures curvatures(this->Surface.c_vec);
  return this->Reach * (std::abs(curvatures.Mean()) + curvatures.Half());
}

Vector3 LocalQuadric::WayAcross() const
{
  const Curvatures curvatures(this->Surface.c_vec);
  double cosine, sine;
  PrincipalAxis(curvatures.UU, curvatures.VV, curvatures.UV, cosine, sine);
  const Vector3 u = HeightFormula::ToVector(this->Surface.u_axis);
  const Vector3 v = HeightFormula::ToVector(this->Surface.v_axis);
  return curvatures.Mean() >= 0.0 ? cosine * u + sine * v : cosine * v - sine * u;
}

Vector3 LocalQuadric::PlaneNormal() const
{
  return HeightFormula::ToVector(this->Surface.plane_normal);
}

Vector3 LocalQuadric::Shift() const
{
  const auto found = this->Surface.projectQueryPoint(pcl::MLSResult::SIMPLE, QuadricTerms);
  return { found.point[0], found.point[1], found.point[2] };
}

SurfaceFoot LocalQuadric::FootOf(const Vector3& place) const
{
  const pcl::MLSResult& s = this->Surface;
  double u, v, w;
  s.getMLSCoordinates(Eigen::Vector3d(place[0], place[1], place[2]), u, v, w);
  const auto at = s.getPolynomialPartialDerivative(u, v);
  const Eigen::Vector3d normal = s.plane_normal - at.z_u * s.u_axis - at.z_v * s.v_axis;
  const double length = normal.norm();
  return { { normal[0] / length, normal[1] / length, normal[2] / length }, (w - at.z) / length };
}

LocalShade LocalQuadric::ShadeAt(
  const Vector3& place, const std::vector<float>& shades, double width) const
{
  const pcl::MLSResult& s = this->Surface;
  double atU, atV, w;
  s.getMLSCoordinates(Eigen::Vector3d(place[0], place[1], place[2]), atU, atV, w);
  Eigen::Matrix3d normals = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (size_t k = 0; k < shades.size(); ++k)
  {
    double u, v;
    this->Project(static_cast<int>(k) + 1, u, v);
    const Eigen::Vector3d row(1.0, (u - atU) / width, (v - atV) / width);
    const double weight = std::exp(-0.5 * row.tail<2>().squaredNorm());
    normals += weight * row * row.transpose();
    right += weight * shades[k] * row;
  }
  normals.diagonal() += Eigen::Vector3d::Constant(1e-9 * normals.trace() + 1e-30);
  const Eigen::Vector3d line = normals.ldlt().solve(right);
  const Eigen::Vector3d gradient = (line[1] * s.u_axis + line[2] * s.v_axis) / width;
  return { line[0], { gradient[0], gradient[1], gradient[2] } };
}

void LocalQuadric::FindSides(std::vector<char>& sides) const
{
  sides.resize(this->Near.size());
  for (size_t k = 0; k < sides.size(); ++k)
  {
    double u, v, w;
    this->Surface.getMLSCoordinates(this->Near[k].getVector3fMap().cast<double>(), u, v, w);
    sides[k] = w > this->Surface.getPolynomialValue(u, v) ? 1 : 0;
  }
}

double LocalQuadric::ColorContrast(
  int i, const Neighbors& neighbors, const SampledColors& colors) const
{
  std::vector<char> sides;
  this->FindSides(sides);
  Eigen::Vector3d sums[2] = { Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero() };
  double counts[2] = { 0.0, 0.0 }, squares = 0.0;
  for (size_t k = 0; k < sides.size(); ++k)
  {
    const Vector3 rgb = colors.Get(k == 0 ? i : neighbors.Ids[k - 1]);
    const Eigen::Vector3d color(rgb[0], rgb[1], rgb[2]);
    sums[static_cast<size_t>(sides[k])] += color;
    squares += color.squaredNorm();
    ++counts[static_cast<size_t>(sides[k])];
  }
  if (counts[0] < 1.0 || counts[1] < 1.0)
  {
    return 0.0;
  }
  const double within =
    squares - sums[0].squaredNorm() / counts[0] - sums[1].squaredNorm() / counts[1];
  const double variance = std::max(0.0, within) / (counts[0] + counts[1]) + ColorNoise;
  return (sums[0] / counts[0] - sums[1] / counts[1]).squaredNorm() / variance;
}

double LocalQuadric::Thickness(const LocalCloud& cloud, int i, const Neighbors& neighbors)
{
  NearCloud near;
  LoadNear(cloud, i, neighbors, near);
  const Eigen::Vector3d variances = VariancesOf(near);
  return variances[1] > 0.0 ? variances[0] / variances[1] : 0.0;
}

void LocalQuadric::Project(int k, double& u, double& v) const
{
  double w;
  this->Surface.getMLSCoordinates(
    this->Near[static_cast<size_t>(k)].getVector3fMap().cast<double>(), u, v, w);
}
}
