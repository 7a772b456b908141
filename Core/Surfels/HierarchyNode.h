// SPDX-License-Identifier: BSD-3-Clause
/**
 * A node of the hierarchy above the leaves, and its colour, as they are stored. They are packed, so
 * that large clouds fit into memory and a frame loads few bytes per node. The set-up's vector code
 * (Core/Splats/SetupBatch.h) unpacks them itself; all others use NodePacking.h.
 *
 * Precision: positions are floats; everything else is accurate to 1 / 32767 of its unit, 1e-4 px
 * for a node that is three pixels wide.
 */
#pragma once

#include <cstdint>

namespace SurfelSplatting
{
/// The packed value of one unit: x is stored as round(x / unit * PackedOne).
constexpr double PackedOne = 32767.0;

/// The packed value of a mean overlap of 1 (SurfelCloud::OverlapOf).
constexpr int PackedOverlap = 16383;

/// The mixture of the surfels below (NodeMoments.h) and their bounds.
struct HierarchyNode
{
  float Position[3];      ///< p
  float Deviation;        ///< unit of Factor, world units
  std::int16_t Factor[6]; ///< S = L L', the rows of L: L00, L10, L11, L20, L21, L22
  std::int16_t Normal[3]; ///< area vector A in units of Area; its length is the coherence.
                          ///< Of captures' Gaussians, the first is LeafScale (GaussianMass.h), of
                          ///< those of volumes the mean of SurfelCloud::Normals
  std::uint16_t Opacity;  ///< mean over the area, unit 1
  float Area;             ///< sum of the leaves' areas, world units squared
  float Bound;            ///< radius of a sphere about p that contains the leaves' centres
  std::int16_t Cone;      ///< cosine of a cone about A that contains the leaves' normals, unit 1
  std::uint16_t Sides;    ///< bit 0: two-sided; the others: the overlap (SurfelCloud::OverlapOf)
                          ///< times PackedOverlap
};
static_assert(sizeof(HierarchyNode) == 48, "as Documentation/DataContract.md says");

/// A node's colour and its first moment (NodeColors.h).
struct NodeColor
{
  float ColorUnit;           ///< of Color
  float MomentUnit;          ///< of Moment, world units
  std::int16_t Color[3];     ///< straight RGB
  std::uint16_t Opacity;     ///< unit 1
  std::int16_t Moment[3][3]; ///< H: three colours by three coordinates
};
}
