// SPDX-License-Identifier: BSD-3-Clause
/**
 * Normals of a volume's points: the directions in which the scalar falls.
 */
#pragma once

#include <array>

class vtkPiecewiseFunction;

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

/**
 * The same across a face of the whole image, where objects are cut: the central difference, as if
 * there were a point on the outside. Inside of an object the face then has the normal of a face; a
 * surface beside the face keeps its own. Half of the step to the outside counts at least, so that a
 * layer of one voxel, from which the scalar falls on both sides, has a normal, too.
 * @param inner, scalar, outside from the inside to the outside, the latter as of OutsideScalar
 */
double FaceDifference(double inner, double scalar, double outside);

/**
 * What the place beyond the faces of an image counts as: nothing is there, so that it is
 * transparent. Of the scalars without opacity it has the nearest one. They must be an interval:
 * where opacities have several transparent ranges, what is between them are layers, which are not
 * the surfaces of an object on one side of the face.
 */
class OutsideScalar
{
public:
  /// @param opacity null: nothing is known
  explicit OutsideScalar(vtkPiecewiseFunction* opacity);

  /// Of a finite scalar at a face; NaN if nothing is known.
  double operator()(double scalar) const;

private:
  double Low, High; // the scalars without opacity; NaN if nothing is known
};

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
