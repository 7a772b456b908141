// SPDX-License-Identifier: BSD-3-Clause
/**
 * Camera space and its projection to the screen.
 *
 * Camera space: lens at the origin, x right, y up, z > 0 along the view direction, world units.
 * Screen: pixels, origin at the lower left corner of the picture, pixel (i, j) is centred at (i +
 * 1/2, j + 1/2).
 *
 *   perspective  X = Fx x/z + Cx      parallel  X = Fx x + Cx
 *                Y = Fy y/z + Cy                Y = Fy y + Cy
 */
#pragma once

#include "Core/Base/Geometry.h"
#include "Core/Simd/RealLanes.h"

namespace SurfelSplatting
{
struct View
{
  Affine3 WorldToCamera;
  bool Parallel = false;
  double Fx = 1.0; ///< px (perspective: focal length) or px per world unit (parallel)
  double Fy = 1.0;
  double Cx = 0.0; ///< principal point, px
  double Cy = 0.0;
  int Width = 0; ///< px
  int Height = 0;
  double Near = 0.0; ///< z-range of the centres of surfels that are drawn, world units
  double Far = 1e300;
};

/**
 * The perspective view of a camera as VTK and others describe one; the principal point is in the
 * middle of the picture.
 * @param viewAngle of the picture's height, degrees, (0, 180)
 * @throws std::invalid_argument if this is no view
 */
View LookAt(const Vector3& position, const Vector3& focalPoint, const Vector3& viewUp,
  double viewAngle, int width, int height);

/// Nonzero elements of the projection's Jacobian M at a point in camera space, px per world unit.
template <class Real>
struct ProjectionJacobian
{
  Real XX, XZ; ///< derivatives of X on the screen with respect to x and z
  Real YY, YZ; ///< derivatives of Y on the screen with respect to y and z

  ProjectionJacobian() = default;

  /// @param inverseZ 1 / p.Z
  SURFELSPLATTING_INLINE ProjectionJacobian(
    const View& view, const Vector3Of<Real>& p, const Real& inverseZ)
  {
    if (view.Parallel)
    {
      this->XX = Uniform<Real>(view.Fx);
      this->YY = Uniform<Real>(view.Fy);
      this->XZ = this->YZ = Real{};
      return;
    }
    this->XX = view.Fx * inverseZ;
    this->YY = view.Fy * inverseZ;
    this->XZ = -this->XX * p.X * inverseZ;
    this->YZ = -this->YY * p.Y * inverseZ;
  }

  /// M S M' of a covariance S, px^2.
  SURFELSPLATTING_INLINE Symmetric2Of<Real> Project(const Symmetric3Of<Real>& s) const
  {
    const Real sxx = s.XX * this->XX + s.XZ * this->XZ, sxz = s.XZ * this->XX + s.ZZ * this->XZ;
    const Real syx = s.XY * this->YY + s.XZ * this->YZ, syy = s.YY * this->YY + s.YZ * this->YZ;
    const Real syz = s.YZ * this->YY + s.ZZ * this->YZ;
    return { Larger(this->XX * sxx + this->XZ * sxz, Real{}),
      Larger(this->YY * syy + this->YZ * syz, Real{}), this->XX * syx + this->XZ * syz };
  }
};

/**
 * Signed area on the screen, px^2, of an infinitesimal surface with area vector a (world units
 * squared) at p: positive where a faces the lens. The formula f^2 (-a.p)/z^3 does not divide by a
 * Jacobian's determinant, so surfaces seen edge-on deposit nothing instead of infinity.
 */
template <class Real>
SURFELSPLATTING_INLINE Real ProjectedArea(
  const View& view, const Vector3Of<Real>& a, const Vector3Of<Real>& p, const Real& inverseZ)
{
  const double f2 = -view.Fx * view.Fy;
  return view.Parallel ? f2 * a.Z : f2 * Dot(a, p) * inverseZ * inverseZ * inverseZ;
}
}
