// SPDX-License-Identifier: BSD-3-Clause
/**
 * Where the leaves of a hierarchy are, as seen from its nodes. Filters that move points, such as
 * VTK's transforms, leave nodes and kernels as they were.
 */
#pragma once

#include "Core/Base/Geometry.h"
#include "Core/Hierarchy/HierarchyLayout.h"
#include "Core/Surfels/SurfelCloud.h"

namespace SurfelSplatting
{
struct LeafPlacement
{
  enum MoveKind
  {
    None,
    Translation,
    AffineMap,
    Other ///< no affine map, or one that flattens the cloud
  };
  MoveKind Kind = None;
  Affine3 Map;               ///< from the places that the nodes know to the points
  Affine3 Back;              ///< the inverse
  bool MovedVectors = false; ///< whether the area vectors of leaves were multiplied with Map.L
};

/**
 * Compares some nodes of the lowest level with the leaves below them, which are float or double.
 * Takes less than a millisecond. A cloud in one plane is taken to be turned, not mirrored; one on a
 * line can only be translated.
 * @param tree leaves and nodes
 */
LeafPlacement FindLeafPlacement(const SurfelCloud& tree, const HierarchyLayout& layout);
}
