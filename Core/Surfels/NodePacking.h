// SPDX-License-Identifier: BSD-3-Clause
/**
 * Values of nodes to and from the form in which they are stored (HierarchyNode.h).
 */
#pragma once

#include "Core/Base/Geometry.h"
#include "Core/Surfels/HierarchyNode.h"
#include "Core/Surfels/NodeMoments.h"

namespace SurfelSplatting
{
/// Moments but the leaves' covariance; bounds are still to be set.
HierarchyNode PackNode(const NodeMoments& moments, bool twoSided);

/// Outwards to what can be stored, so that they hold.
/// @param radius of the sphere about the node's position, as it is stored
/// @param cosine of the cone about the node's area vector, as it is stored
void SetBounds(double radius, double cosine, HierarchyNode& node);

Vector3 PositionOf(const HierarchyNode& node);
Symmetric3 CovarianceOf(const HierarchyNode& node);
Vector3 AreaVectorOf(const HierarchyNode& node);
double OpacityOf(const HierarchyNode& node);
double ConeOf(const HierarchyNode& node); ///< its cosine

/// A node's colour in numbers.
struct ColorMoments
{
  double Color[3] = { 0, 0, 0 }; ///< c_0, straight RGB
  double Opacity = 0.0;
  double First[3][3] = {}; ///< H
};

NodeColor PackColor(const ColorMoments& moments);
ColorMoments UnpackColor(const NodeColor& color);
}
