// SPDX-License-Identifier: BSD-3-Clause
/**
 * Two planes that meet in a fold, through the points about a place: what a quadric cannot be, and
 * noise hides from fits to few points.
 *
 * Both normals point away from the other plane's points, so the surface is where the larger of the
 * two heights is zero, be it a ridge or a valley. (Fleishman, Cohen-Or and Silva 2005, "Robust
 * moving least-squares fitting with sharp features", join pieces of a surface alike.)
 */
#pragma once

#include "Filters/Cleaning/LocalQuadric.h"
#include "Filters/Common/VectorMath.h"

namespace SurfelGeometry
{
/// Of some points: what their plane follows from.
struct PlaneMoments
{
  double Count = 0.0;
  Vector3 Sum{};
  double XX = 0.0, XY = 0.0, XZ = 0.0, YY = 0.0, YZ = 0.0, ZZ = 0.0;

  /// @param weight 1, or -1 for one that leaves
  void Add(const Vector3& p, double weight);
  void Add(const PlaneMoments& other, double weight);
};

/// Unit normal, and the height of the point above the plane.
struct FoldPlane
{
  Vector3 Normal;
  double Height;
};

/// Each thread reuses one.
class FoldFit
{
public:
  /// Whether two planes that part the points have fewer squares than `most`: several times as fast
  /// as a fit, which hardly ever finds a fold where this says no.
  bool MayFit(const QuadricCloud& points, const LocalQuadric& middle, double most);

  /// Through the points of the quadric, by least squares of their distances. Returns false if there
  /// is no fold of 53 to 150 degrees inside, each side with a tenth of the points, whose squares
  /// are below `most`.
  bool Fit(const LocalQuadric& quadric, double most);

  /// Squared distances of the first points, summed. World units squared.
  double SquaresOf(const QuadricCloud& points, int count) const;

  /// Of all points from the surface, world units.
  double Deviation(const QuadricCloud& points) const;

  /// Whether the points at the fold are below it: the edge is not sharp.
  bool IsRounded(const QuadricCloud& points, double spacing) const;

  /// From the point to the line in which the planes meet, world units.
  double FoldDistance() const;

  /// From the point to the surface.
  Vector3 Shift() const;

private:
  struct Fold
  {
    FoldPlane Sides[2];
    double Squares;

    double Height(const Vector3& p) const;
  };

  void Resize(size_t points);
  void TryAcross(const QuadricCloud& points, const Vector3& way);
  double SplitAcross(const QuadricCloud& points, const Vector3& way, PlaneMoments sides[2]);
  bool Assign(const QuadricCloud& points, Fold& fold, PlaneMoments sides[2]);

  std::vector<float> Ways;     // [points] along the way across the fold; by which side is higher
  std::vector<double> Heights; // [points] over the fold
  std::vector<unsigned char> Side; // [points] 0 or 1
  Fold Best;
};
}
