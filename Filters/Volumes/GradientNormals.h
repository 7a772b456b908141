// SPDX-License-Identifier: BSD-3-Clause
/**
 * Normals of a volume's points: the directions in which the scalar falls.
 */
#pragma once

#include <array>

namespace SurfelVolumes
{
/**
 * Derivative of a scalar at a point along an axis of the image, per spacing: the central
 * difference, as VTK's ray casters have it, or the difference to the only neighbour that can be
 * used, or 0 without any.
 * @param low, high scalars of the neighbours; what is not finite or beyond LargestScalar, as beyond
 *                  the image, is not used
 */
double Difference(double low, double scalar, double high);

/// Turns derivatives along the axes of an image into normals in world coordinates.
class GradientNormals
{
public:
  /// @param axes the world from index coordinates, row by row, with a determinant that is not 0
  explicit GradientNormals(const double (&axes)[3][3]);

  /// Minus the gradient, unit length; 0 where the derivatives are 0. The gradient is a covector: in
  /// world coordinates, x = A i, it is A^-T times that in index coordinates.
  /// @param derivatives finite
  std::array<double, 3> operator()(const std::array<double, 3>& derivatives) const;

private:
  double Falling[3][3]; // -A^-T times a positive number
};
}
