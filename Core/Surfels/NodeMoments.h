// SPDX-License-Identifier: BSD-3-Clause
/**
 * The moments of the mixture of the surfels below a node of the hierarchy. A surfel is a node with
 * one leaf.
 */
#pragma once

#include "Core/Base/Geometry.h"

namespace SurfelSplatting
{
struct NodeMoments
{
  double Area = 0.0;             ///< sum a_i, a_i = |A_i|, world units squared
  Vector3 AreaVector{ 0, 0, 0 }; ///< sum A_i: coverage is the same at every level
  Vector3 Position{ 0, 0, 0 };   ///< sum a_i p_i / sum a_i
  Symmetric3 Covariance{};       ///< of the mixture: mean of S_i plus that of the positions
  double Opacity = 1.0;          ///< mean, weighted by a_i
  double Overlap = 0.0;          ///< mean SurfelCloud::OverlapOf, weighted by a_i
};

inline Symmetric3 Mix(const Symmetric3& a, double wa, const Symmetric3& b, double wb)
{
  return { wa * a.XX + wb * b.XX, wa * a.YY + wb * b.YY, wa * a.ZZ + wb * b.ZZ,
    wa * a.XY + wb * b.XY, wa * a.YZ + wb * b.YZ, wa * a.XZ + wb * b.XZ };
}

/// s += w d d'.
inline void AddOuterProduct(Symmetric3& s, const Vector3& d, double w)
{
  s.XX += w * d[0] * d[0];
  s.YY += w * d[1] * d[1];
  s.ZZ += w * d[2] * d[2];
  s.XY += w * d[0] * d[1];
  s.YZ += w * d[1] * d[2];
  s.XZ += w * d[0] * d[2];
}

/**
 * Moments of the union of two nodes.
 * @param twoSided the signs of their area vectors have no meaning and are made to agree
 */
inline NodeMoments Join(const NodeMoments& a, const NodeMoments& b, bool twoSided)
{
  NodeMoments node;
  node.Area = a.Area + b.Area;
  const double wa = node.Area > 0.0 ? a.Area / node.Area : 0.5;
  const double wb = 1.0 - wa;
  const double sign = twoSided && Dot(a.AreaVector, b.AreaVector) < 0.0 ? -1.0 : 1.0;
  const Vector3 d = b.Position - a.Position;
  node.AreaVector = a.AreaVector + sign * b.AreaVector;
  node.Position = a.Position + wb * d;
  node.Covariance = Mix(a.Covariance, wa, b.Covariance, wb);
  AddOuterProduct(node.Covariance, d, wa * wb);
  node.Opacity = wa * a.Opacity + wb * b.Opacity;
  node.Overlap = wa * a.Overlap + wb * b.Overlap;
  return node;
}

/// Length of a node's area vector over its area, [0, 1]: 1 for a flat patch, 0 for closed or double
/// surfaces, whose net area does not tell how much they hide.
inline double Coherence(const Vector3& areaVector, double area)
{
  return area > 0.0 ? std::fmin(1.0, Norm(areaVector) / area) : 1.0;
}
}
