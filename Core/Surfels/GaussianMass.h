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
 *   the side. Nodes keep the mean over all sides: the mass o sqrt(tr adj S), where the root is
 *   proportional to that mean within 15 %, for needles, discs and spheres alike.
 */
#pragma once

#include "Core/Base/Geometry.h"
#include "Core/Simd/RealLanes.h"

namespace SurfelSplatting
{
/// Sum of the principal minors of S, tr adj S.
template <class Real>
SURFELSPLATTING_INLINE Real SumOfMinors(const Symmetric3Of<Real>& s)
{
  return s.XX * s.YY - s.XY * s.XY + s.YY * s.ZZ - s.YZ * s.YZ + s.XX * s.ZZ - s.XZ * s.XZ;
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
  const Real trace = s.XX + s.YY + s.ZZ;
  const Real least = 1e-8 * trace * trace + 1e-60; // needles
  return SquareRoot(Larger(SumOfMinors(s), least));
}
}
