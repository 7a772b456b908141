// SPDX-License-Identifier: BSD-3-Clause
/**
 * How far from its point a kernel lies, so that kernels lie on the surface that the normals
 * describe.
 *
 * Normals are means over a neighbourhood, points are not: what is left of noise makes the slopes
 * between points differ from those of their tangent planes. Where a slope faces the viewer more
 * than its planes do, kernels cover too little. At grazing angles that leaves holes.
 *
 * On a circle, d.(n + m) = 0 for any two points with normals n and m, d from the one to the other.
 * Elsewhere half of it is how far the first point must rise to be on an arc with the second one. A
 * point rises by the mean over itself and its neighbours on the sheet, then once more by the mean
 * where these have risen. Noise shrinks; what is smooth at the size of a neighbourhood stays, to
 * third order.
 */
#pragma once

#include "Filters/Common/RawVector.h"
#include "Filters/Estimation/NearSheet.h"
#include "Filters/Estimation/PlaneFit.h"

namespace SurfelGeometry
{
/// How far the surface is above the points, along their normals, world units. 0 where the points
/// are flat or beside a fold, and without a plane.
struct SurfaceHeights
{
  RawVector<float> First; // [n] after the first step
  RawVector<float> Final; // [n]

  void Resize(std::size_t count);

  /// The first step of point i. Others that have loaded its neighbours take it along.
  void Rise(int i, const PlaneFit& fit, const NearSheet& sheet);

  /// The first step of all points. Returns false if stopped.
  bool RiseAll(const OrientedCloud& oriented, const PlaneFits& fits, const StageProgress& progress);

  /// The second step of point i, after the first one of all.
  /// @param ids [count] of the sheet
  void RiseAgain(int i, const PlaneFit& fit, const NearSheet& sheet, const int* ids, int count);
};
}
