// SPDX-License-Identifier: BSD-3-Clause
/**
 * The quadric through the points about a place: PCL's moving least squares (pcl::MLSResult; Alexa
 * et al. 2003, "Computing and rendering point set surfaces"), whose code is in PCL's headers: no
 * library of PCL with another VTK comes along.
 */
#pragma once

#include "Filters/Cleaning/PointSpread.h"
#include "Filters/Common/VectorMath.h"
#include "Filters/Neighbors/LocalCloud.h"
#include "Filters/Neighbors/Neighbors.h"

#include <pcl/surface/mls.h>

class vtkDataArray;

namespace SurfelGeometry
{
/// Residuals below this part of the spacing are not noise; a surface with a radius of two spacings
/// has 0.04.
constexpr double CleanResidual = 0.06;

/// Two sheets have the same colours if the squared difference of their means is below this part of
/// the variance in a sheet: of two samples of 32 from one distribution it is a sixteenth, and more
/// where a pattern is shifted a little.
constexpr double SameColors = 0.5;

/// The colours of a cloud's points, few of which are asked for.
struct SampledColors
{
  vtkDataArray* Array; // of three components at least; null: unknown
  const LocalCloud& Cloud;

  Vector3 Get(int i) const;
};

/// An area per point of radius^2 pi / count, as on a surface.
double SpacingOf(const Neighbors& neighbors);

/// Distances of the points to the quadric, in spacings.
struct Residuals
{
  double Deviation = 0.0;
  double Kurtosis = 0.0;
};

/// The quadric at a place: its unit normal there, and how far the place is above it, world units.
struct SurfaceFoot
{
  Vector3 Normal;
  double Height;
};

/// A point for which the quadric's source file has some functions of PCL anew.
struct QuadricPoint : pcl::PointXYZ
{
  using PointXYZ::PointXYZ;
};
using QuadricCloud = pcl::PointCloud<QuadricPoint>;

/// A shade on the quadric, and how it changes along it.
struct LocalShade
{
  double Value = 0.0;
  Vector3 Gradient = { 0.0, 0.0, 0.0 }; // 1 / world units
};

/// The neighbourhood of one point. Places are relative to that point. Each thread reuses one.
class LocalQuadric
{
public:
  /// The places alone: Fit(neighbors) may follow.
  void Load(const LocalCloud& cloud, int i, const Neighbors& neighbors);
  void Fit(const Neighbors& neighbors) { this->FitTo(0, neighbors); }

  /// Through the point and its neighbours.
  void Fit(const LocalCloud& cloud, int i, const Neighbors& neighbors);

  /// Through the neighbours without the point.
  void FitOthers(const LocalCloud& cloud, int i, const Neighbors& neighbors);

  bool IsValid() const { return this->Surface.valid && this->Surface.c_vec.allFinite(); }

  Residuals Measure(double spacing) const;

  /// Their deviation alone, several times as fast.
  double Deviation(double spacing) const;

  /// Squared distances of the points to the quadric, summed. World units squared.
  double Squares() const;

  /// For the degrees of freedom of the quadric, times count / (count - 6).
  double UnbiasedSquares() const;

  /// How much the slope of the quadric changes from its middle to the farthest point, at most.
  double Bend() const;

  /// The direction in which it changes most: across a fold.
  Vector3 WayAcross() const;

  Vector3 PlaneNormal() const;

  /// The point itself, then its neighbours, relative to it.
  const QuadricCloud& Points() const { return this->Near; }

  /// From the point to the surface, along the normal of the plane below it.
  Vector3 Shift() const;

  SurfaceFoot FootOf(const Vector3& place) const;

  /// The line through the neighbours' shades, weighted by a Gaussian about the place.
  /// @param shades [neighbours]
  /// @param width standard deviation of the Gaussian, world units
  LocalShade ShadeAt(const Vector3& place, const std::vector<float>& shades, double width) const;

  /// On which side the point and its neighbours are: 1 above the quadric.
  /// @param sides [1 + neighbours] the point's own first
  void FindSides(std::vector<char>& sides) const;

  /// Squared difference of the mean colours above and below the surface over the variance there.
  double ColorContrast(int i, const Neighbors& neighbors, const SampledColors& colors) const;

  /// Of the neighbours, whatever was fitted: their smallest variance over the middle one.
  static double Thickness(const LocalCloud& cloud, int i, const Neighbors& neighbors);

  /// Place k, of the point itself (0) and its neighbours in their order, in the plane below.
  void Project(int k, double& u, double& v) const;

private:
  double DeviationOf(double squares) const;

  /// Calls visit(residual) for the point and its neighbours.
  template <typename Visit>
  void ForResiduals(double spacing, Visit&& visit) const;

  void FitTo(size_t first, const Neighbors& neighbors);

  QuadricCloud Near; // the point itself, then its neighbours
  pcl::Indices Indices;
  pcl::MLSResult Surface;
  double Reach = 0.0; // of the farthest neighbour, world units
};
}
