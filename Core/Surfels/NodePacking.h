// SPDX-License-Identifier: BSD-3-Clause
/**
 * Packs and unpacks the nodes of the hierarchy (HierarchyNode.h).
 */
#pragma once

#include "Core/Base/Geometry.h"
#include "Core/Surfels/HierarchyNode.h"
#include "Core/Surfels/NodeMoments.h"

namespace SurfelSplatting
{
/// Packs the moments. The bounds must still be set (SetBounds).
HierarchyNode PackNode(const NodeMoments& moments, bool twoSided);

/// Stores the bounds, rounded outwards.
/// @param radius of the sphere about the node's position, as it is stored
/// @param cosine of the cone about the node's area vector, as it is stored
void SetBounds(double radius, double cosine, HierarchyNode& node);

Vector3 PositionOf(const HierarchyNode& node);
Symmetric3 CovarianceOf(const HierarchyNode& node);
Vector3 AreaVectorOf(const HierarchyNode& node);
double OpacityOf(const HierarchyNode& node);
double ConeOf(const HierarchyNode& node); ///< its cosine
bool IsTwoSided(const HierarchyNode& node);
double OverlapOf(const HierarchyNode& node);
/// @param overlap [0, 1]
void SetOverlap(double overlap, HierarchyNode& node);

/// A node's colour, unpacked.
struct ColorMoments
{
  double Color[3] = { 0, 0, 0 }; ///< c_0, straight RGB
  double Opacity = 0.0;
  double First[3][3] = {}; ///< H
};

NodeColor PackColor(const ColorMoments& moments);
ColorMoments UnpackColor(const NodeColor& color);
}
