// SPDX-License-Identifier: BSD-3-Clause
/**
 * What Gaussians in space keep when they are projected, or joined into nodes of a hierarchy. Real
 * is double or lanes of doubles.
 *
 * - Volumes have an extinction s exp(-d' S^-1 d / 2) per world unit. Its integral over space is the
 *   mass s (2 pi)^(3/2) sqrt(det S). Projected, it is the integral of the optical depth over the
 *   screen, from every side (EWA volume splatting: Zwicker, Pfister, van Baar, Gross 2001). A node
 *   has the mass of its Gaussians.
 *
 * - Captures (3D Gaussian splatting: Kerbl, Kopanas, Leimkuehler, Drettakis 2023) have an opacity o
 *   on the screen, from every side. They hide o times the area of their footprint, which depends on
 *   the side. Nodes keep the mean over all sides of the optical depth: the mass Li2(o) sqrt(tr adj
 *   S), where the root is proportional to that mean within 15 %, for needles, discs and spheres
 *   alike. Opacities would make surfaces of many Gaussians translucent.
 */
#pragma once

#include "Core/Base/Geometry.h"
#include "Core/Simd/RealLanes.h"

namespace SurfelSplatting
{
/**
 * The optical depth that a footprint of opacity o exp(-q/2) takes part in, over the opacity: the
 * ratio of the integrals of -ln(1 - o exp(-q/2)) and of o exp(-q/2), Li2(o) / o. By Li2's series to
 * its fifth term, and three powers fitted to the rest: off by 0.003. @param o [0, 1]
 */
template <class Real>
SURFELSPLATTING_INLINE Real DepthOverOpacity(const Real& o)
{
  const Real o2 = o * o, o4 = o2 * o2, o8 = o4 * o4, o24 = o8 * o8 * o8, o48 = o24 * o24;
  return 1.0 + o / 4.0 + o2 / 9.0 + o2 * o / 16.0 + o4 / 25.0 + 0.1278 * o8 + 0.0285 * o24 +
    0.025 * o48 * o48;
}

/**
 * Optical depth at the centre of a Gaussian that the lens has spread, so that it keeps its opacity.
 * That of t exp(-q/2), the integral of 1 - exp(-t exp(-q/2)), is Ein(t) times the kernel's area,
 * Ein(t) = integral of (1 - exp(-s)) / s from 0 to t. Hence Ein(t') = Ein(t) r with r, the ratio of
 * the areas, and w = t r, what would keep the depth:
 *
 *   t' = w / (1 + (t / Ein(t) - 1) (1 - r)),  t / Ein(t) = 1 + t (0.14 + 0.12 / (1 + t / 60))
 *
 * The opacity is off by 0.016 of itself for t up to 6, and for any t up to 200 where r is small.
 * Light that passes beside a spread Gaussian has not passed through it: with the depth kept,
 * borders of dense captures grow.
 * @param depth t @param spread w, at most t
 */
template <class Real>
SURFELSPLATTING_INLINE Real KeepOpacity(const Real& depth, const Real& spread)
{
  const Real slope = 0.14 + 0.12 / (1.0 + depth * (1.0 / 60.0));
  return spread / (1.0 + slope * Larger(depth - spread, Real{}));
}

/// Smallest scale of leaves that is distinguished (HierarchyNode.h), squared.
constexpr double LeastLeafScale = 1e-9;

/**
 * sqrt(det W) of a footprint W once the prefilter h has dilated each of its leaves, as it is
 * published, and not W as a whole. The leaves are taken to have the shape of W, e^2 W each:
 *
 *   sqrt(det(e^2 W + h)) / e^2
 *
 * e is LeafScale, the root of the leaves' mean kernel area (harmonic, weighted with their masses)
 * over the own one.
 * @param scale e^2, (0, 1]; 1 for a leaf
 */
template <class Real>
SURFELSPLATTING_INLINE Real DilatedArea(
  const Real& xx, const Real& yy, const Real& xy, const Real& scale, double h)
{
  const Real determinant = (scale * xx + h) * (scale * yy + h) - scale * xy * (scale * xy);
  return SquareRoot(Larger(determinant, Real{})) / scale;
}

/// Integral of exp(-d' S^-1 d / 2) over space.
template <class Real>
SURFELSPLATTING_INLINE Real KernelVolume(const Symmetric3Of<Real>& s)
{
  constexpr double scale = 15.749609945722419; // (2 pi)^(3/2)
  const Real determinant = s.XX * (s.YY * s.ZZ - s.YZ * s.YZ) - s.XY * (s.XY * s.ZZ - s.YZ * s.XZ) +
    s.XZ * (s.XY * s.YZ - s.YY * s.XZ);
  return scale * SquareRoot(Larger(determinant, Real{}));
}

/// Mean over all sides of the area of its footprint, up to a factor; positive for points as well,
/// so that a mass divided by it is the opacity again.
template <class Real>
SURFELSPLATTING_INLINE Real MeanKernelArea(const Symmetric3Of<Real>& s)
{
  const Real trace = s.Trace();
  const Real least = 1e-8 * trace * trace + 1e-60; // needles
  return SquareRoot(Larger(s.SumOfMinors(), least));
}
}
