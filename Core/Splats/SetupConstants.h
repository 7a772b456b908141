// SPDX-License-Identifier: BSD-3-Clause
/**
 * Constants of the set-up and how they were measured.
 */
#pragma once

namespace SurfelSplatting
{
/// Half of a splat's z-range: a multiple of the standard deviation along z plus a multiple of the
/// standard deviation along the kernel's longest axis. It is the depth difference that neighbours
/// on one rough surface may have. Both were chosen on ray-traced scenes, where larger values give
/// the same pictures, and by eye on scans. With smaller values, blurred slopes get dark notches and
/// depth images tear; with larger values, things that lie on a surface merge with it.
constexpr double DepthExtentAlongZ = 2.0;
constexpr double DepthExtentIsotropic = 0.5;

/// Two sheets that are close to one another are one layer where they are seen from the side. There
/// the splats that come first fill it. So those of the sheet behind come later, as if they began
/// o^2 times this many halves of their z-range farther back, o what of their overlap
/// (SurfelCloud::OverlapOf) the lens does not leave out (CoveredShare). (Cards and plates one to
/// seven spacings above a chequered cloth gain 2.3 and 3.8 dB in focus. With 6 o they gain up to
/// 0.7 more, but a pixel of a lion in a dolly pops by 5 levels, since noise has overlaps, too.)
constexpr double DepthBehindSheet = 4.0;

/// The sum of the weights ripples about 1. min(1, sum) loses the part above 1, which would make an
/// opaque surface slightly dark. The loss decreases with the share of the footprint that comes from
/// lens and pixel filter, smooth = (h + V_I) / sqrt(det W) in [0, 1]: surfels smaller than a pixel
/// do not ripple and keep their mass. Near silhouettes there is no compensation, because it would
/// make them grow. The loss is RippleLoss (1 - smooth) cos^2(theta), measured against ray-traced
/// scenes.
constexpr double RippleLoss = 0.2;

/// The normals of a node's leaves are taken as spread evenly along the line of sight, over +- the
/// root of this many times their variance, the mean of two cases: a node of a sphere has half of
/// the variance along any direction, 3 / 2; one of a tube, where its silhouette is, all of it, 3.
constexpr double NormalSpread = 2.25;

/// Nodes are blurred by at least this share of their spacing (the square root of their area), as
/// the kernels of the leaves are: then neighbouring nodes sum to one. A cut selected by the default
/// error is blurred more than this anyway; a coarser cut, for interaction, would have holes.
constexpr double MinNodeBlur = 0.28;

/// Variance of a surfel's kernel over its area: that of a square and of the kernels' common blur.
constexpr double VariancePerArea = 1.0 / 12.0 + MinNodeBlur * MinNodeBlur;

/// A z-buffer uses the plane of a surfel unless the surfel is seen nearly edge-on. Minimum of det /
/// (var_x var_y) of its covariance on the screen.
constexpr double MinPlaneShare = 1e-3;

/// The border of a kernel is about 4.5 standard deviations of node and pixel wide. It must span two
/// cells of a coarse grid, so a cell is at most this many deviations wide.
constexpr double GridCellsPerDeviation = 2.25;

/// Splats go from the picture to the lowest grid over this share of the blur's deviation, not all
/// at one. A surface that did so at once would flash where it covers another: in focus pulls of a
/// lion, 12 px, 5 to 8 pixels of a frame would step by more than 4.5 levels instead of 2. (Ours.
/// With 0.2, one pixel does, but frames take 4 % longer instead of 2. If each splat had a blur of
/// its own, bars with level of detail would pop by 1.0 instead of 0.69 levels. Coarser grids do not
/// do it: a scene of 100 px lost 0.1 to 0.4 dB, and pixels flashed as before.)
constexpr float GridStagger = 0.15f;

/// Minimum standard deviation of a kernel's border on a coarse grid, in cells, including the tents.
/// A sharper border is softened without changing the kernel's variance: the grid's samples cannot
/// resolve it.
constexpr double MinBorderDeviation = 0.55;

/// Limits that keep the raster's float sums finite: 2^32 splats of weight 1e12 and colour 1e12, or
/// depth 1e16, sum to less than 3e38. Infinity times a transmittance of zero would be NaN.
constexpr float MaxSplatWeight = 1e12f, MaxSplatColor = 1e12f, MaxSplatDepth = 1e16f;
constexpr float MaxSplatCoordinate = 1e30f; // px
/// 2^32 splats of this weight are invisible, and e^-20 of it is not yet denormal.
constexpr float MinSplatWeight = 1e-20f;

/// Colour gradients of nodes of less standard deviation are not drawn.
constexpr double LeastColorDeviation = 1.0 / 512.0;
}
