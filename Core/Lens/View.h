// SPDX-License-Identifier: BSD-3-Clause
/**
 * Camera space and its projection.
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
  double Near =
    0.0; ///< surfels with centres outside [Near, Far] are not drawn; world units along z
  double Far = 1e300;
};

/// Two rows of the Jacobian of the projection at a point of camera space, px per world unit.
struct ProjectionJacobian
{
  Vector3 X, Y;

  ProjectionJacobian(const View& view, const Vector3& p)
  {
    if (view.Parallel)
    {
      this->X = { view.Fx, 0.0, 0.0 };
      this->Y = { 0.0, view.Fy, 0.0 };
      return;
    }
    const double inverse = 1.0 / p[2];
    this->X = { view.Fx * inverse, 0.0, -view.Fx * p[0] * inverse * inverse };
    this->Y = { 0.0, view.Fy * inverse, -view.Fy * p[1] * inverse * inverse };
  }
};

/**
 * Signed area on the screen, px^2, of an infinitesimal surface with area vector a (world units
 * squared) at p: positive where a faces the lens. Projected area f^2 (-a.p)/z^3 needs no division
 * by a Jacobian's determinant, so that surfaces seen edge-on deposit nothing instead of infinity.
 */
inline double ProjectedArea(const View& view, const Vector3& a, const Vector3& p)
{
  return view.Parallel ? -view.Fx * view.Fy * a[2]
                       : -view.Fx * view.Fy * Dot(a, p) / (p[2] * p[2] * p[2]);
}
}
