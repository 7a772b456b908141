// SPDX-License-Identifier: BSD-3-Clause
/**
 * Kernels that are long along the edges of a texture and narrow across them, as in steering kernel
 * regression (Takeda, Farsiu, Milanfar 2007, "Kernel regression for image processing and
 * reconstruction", sec. III): what is between the points is interpolated along an edge, so that it
 * is not blurred, and not jagged between sparse points. It costs nothing when drawing.
 *
 * Here the metric of the tangent plane is steered, not the kernel: in it, lengths across an edge
 * count r times and lengths along it 1 / r times, and areas stay. Cells and their blur are round
 * there (VoronoiCell.h), so that kernels still sum to one. Kernels that are stretched themselves
 * leave holes and heaps.
 *
 * r^4 = (l2 + n) / (l1 + n), where l2 >= l1 are the eigenvalues of the structure tensor: of g g',
 * with the gradient g of a plane fitted to the colours, summed over red, green and blue. So the
 * colour changes as much across a kernel as along it, unless that may be noise or a texture too
 * fine for the points: n = LeastGradient^2 + VarianceShare times the variance of the colours. At a
 * crease of two things of different colours, the edge is not one of a texture, and a long kernel of
 * one thing would show through the other: n also has CreaseShare times the flatness of the plane
 * fit times l2.
 */
#pragma once

#include "Filters/Common/RawVector.h"
#include "Filters/Common/VectorMath.h"

#include <cmath>

namespace SurfelGeometry
{
struct ColorMoments;

/// For each point the tangential direction that its kernel is stretched in, of length
/// sqrt(r^2 - 1 / r^2). Zero: round.
using KernelSteering = RawVector<Float3>;

/// r^2 of such a vector's squared length.
inline float SquaredStretch(float squaredLength)
{
  return 0.5f * (squaredLength + std::sqrt(squaredLength * squaredLength + 4.0f));
}

/// The steering of a point.
/// @param flatness of its plane fit: 0 = plane
/// @param u, v     of the tangent plane, unit: x and y of the moments
Float3 SteeringFrom(
  const ColorMoments& moments, float flatness, const Vector3& u, const Vector3& v);
}
