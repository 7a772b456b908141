// SPDX-License-Identifier: BSD-3-Clause
/**
 * Constants of the set-up, with what they were measured by.
 */
#pragma once

namespace SurfelSplatting
{
/// Half of the z-range in standard deviations along z, and in those of the kernel's longest axis:
/// what neighbours of one surface may differ by where it is rough. Measured on ray-traced scenes,
/// which do not tell these from larger ones, and by eye on scans: with less, blurred slopes get
/// dark notches and depth images tear; with more, what lies on a surface merges with it.
constexpr double DepthExtentAlongZ = 2.0;
constexpr double DepthExtentIsotropic = 0.5;

/// Where weights ripple about 1, min(1, sum) loses the part above 1, and an opaque surface would be
/// slightly dark. The loss falls with the share of the footprint that lens and pixel filter have
/// smoothed, (h + V_I) / sqrt(det W) in [0, 1]: surfels below a pixel ripple no more and keep their
/// mass. It is left alone towards silhouettes, which a correction would make grow: this times (1 -
/// smooth) cos^2(theta), measured against ray-traced scenes.
constexpr double RippleLoss = 0.2;

/// Neighbouring nodes sum to one where they are blurred by at least this share of their spacing
/// (the root of their area), as the leaves' kernels are. Detail that is chosen by the default error
/// is blurred more; coarser detail, for interaction, would have holes.
constexpr double LeastNodeBlur = 0.28;

/// A z-buffer takes a surfel's own plane where it is seen less edge-on than this: share of the
/// determinant of its covariance on the screen in the product of the variances.
constexpr double LeastPlane = 1e-3;

/// A kernel's border is about 4.5 standard deviations of node and pixel wide: two cells of a coarse
/// grid that are at most this many deviations each.
constexpr double GridCellsPerDeviation = 2.25;

/// Standard deviation of a kernel's border on a coarse grid, in cells, that of the tents included:
/// a sharper one is made softer, of the same variance; samples would not tell it apart.
constexpr double LeastSoftness = 0.55;

/// What the raster's float sums hold: 2^32 splats of weight 1e12 and colour 1e12, or depth 1e16,
/// stay below 3e38, so that no infinity arises that could become NaN under a transmittance of zero.
constexpr float LargestWeight = 1e12f, LargestColor = 1e12f, LargestDepth = 1e16f;
constexpr float LargestCoordinate = 1e30f; // px
constexpr float SmallestWeight =
  1e-20f; // 2^32 of them are invisible; e^-20 of it is not yet denormal
}
