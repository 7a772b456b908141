// SPDX-License-Identifier: BSD-3-Clause
/**
 * Colours of the nodes of captures, from their mean c_0 and first moment H (NodeColors.h). Volumes,
 * whose Gaussians hide little of one another and tile the space, have the mean.
 *
 * - Gaussians hide those of the same node that lie behind: a leaf shows the side that faces the
 *   viewer, and a wall not what fills it. With the covariance S of the node and the unit direction
 *   v to the viewer, a Gaussian at x lies d = (x - p)' S^-1 v / sqrt(v' S^-1 v) deviations in front
 *   of what is beside it. Where colours change linearly with d, those that are seen have the mean
 *
 *     c = c_0 + m H S^-1 v / sqrt(v' S^-1 v)
 *
 *   with m, the mean of d over what is seen: for two sheets of together the optical depth t it is
 *   tanh(t / 4), here (t / 4) / sqrt(1 + (t / 4)^2).
 *
 * - Through the lens the colour changes over the footprint W by H M' W^-1 (dx, dy), whose first
 *   moment is M H' for every kernel. Without it blurred textures lose contrast.
 */
#pragma once

#include "Core/Lens/LensVisibility.h"
#include "Core/Splats/SetupOutput.h"

namespace SurfelSplatting
{
/// H of a batch in camera space, as shading leaves it.
template <class Real>
struct NodeColorMoments
{
  Vector3Of<Real> H[3];
};

template <class Real>
SURFELSPLATTING_INLINE NodeColorMoments<Real> MomentsInCamera(
  const SetupJob& job, const BatchIndices<Real>& index, const SurfelColors<Real>& colors)
{
  NodeColorMoments<Real> moments{};
  GatherColorMoments(job.Cloud, index, moments.H);
  for (int c = 0; c < 3; ++c)
  {
    const Real& share = colors.Shaded.Share[c];
    const Vector3Of<Real> h = Multiply(job.Linear, moments.H[c]);
    moments.H[c] = { share * h.X, share * h.Y, share * h.Z };
  }
  return moments;
}

/// adj(S) v.
template <class Real>
SURFELSPLATTING_INLINE Vector3Of<Real> MultiplyAdjugate(
  const Symmetric3Of<Real>& s, const Vector3Of<Real>& v)
{
  const Real xy = s.XZ * s.YZ - s.XY * s.ZZ, xz = s.XY * s.YZ - s.XZ * s.YY,
             yz = s.XY * s.XZ - s.YZ * s.XX;
  return { (s.YY * s.ZZ - s.YZ * s.YZ) * v.X + xy * v.Y + xz * v.Z,
    xy * v.X + (s.XX * s.ZZ - s.XZ * s.XZ) * v.Y + yz * v.Z,
    xz * v.X + yz * v.Y + (s.XX * s.YY - s.XY * s.XY) * v.Z };
}

/// Gives the nodes of captures the colours of the side that faces the viewer.
/// @param depth t, the optical depth at the centre in focus
template <class Real>
SURFELSPLATTING_INLINE void ShowNearSide(const SetupJob& job, const PlacedSurfels<Real>& s,
  const Real& depth, const NodeColorMoments<Real>& moments, SurfelColors<Real>& colors)
{
  // Deviations in depth of less than a thousandth of the node's size are rounded away.
  constexpr double rounding = 1e-6;
  const Symmetric3Of<Real>& covariance = s.Covariance;
  const Vector3Of<Real> v = DirectionToViewer(job, s), n = MultiplyAdjugate(covariance, v);
  const Vector3Of<Real> row{ covariance.XX, covariance.XY, covariance.XZ };
  const Vector3Of<Real> x{ Uniform<Real>(1.0), Real{}, Real{} };
  const Real determinant = Dot(row, MultiplyAdjugate(covariance, x)), along = Dot(n, v);
  const Real trace = covariance.Trace(), m = 0.25 * depth;
  const Real squared = along * (determinant + rounding * trace * along);
  const Real scale = m / SquareRoot((1.0 + m * m) * squared);
  Real* const color[] = { &colors.Red, &colors.Green, &colors.Blue };
  for (int c = 0; c < 3; ++c)
  {
    const Real shift = scale * Dot(n, moments.H[c]); // NaN of points
    *color[c] = IsFinite(shift) ? ClampColor(*color[c] + shift, MaxSplatColor) : *color[c];
  }
}

/// How the colours of a batch change over the footprints, per px.
template <class Real>
struct ColorSlopes
{
  Real X[3]{}, Y[3]{};

  SURFELSPLATTING_INLINE void Set(
    const ScreenFootprints<Real>& f, const NodeColorMoments<Real>& moments)
  {
    const Real inverse = f.W.InverseRoot * f.W.InverseRoot;
    for (int c = 0; c < 3; ++c)
    {
      const ColorSlope<Real> slope(f, moments.H[c], inverse);
      const MaskOf<Real> isFinite = Within(slope.X, MaxSplatColor) & Within(slope.Y, MaxSplatColor);
      this->X[c] = isFinite ? slope.X : Real{};
      this->Y[c] = isFinite ? slope.Y : Real{};
    }
  }
};

/// What the colours of a batch of nodes depend on.
template <class Real>
struct SeenNodes
{
  const PlacedSurfels<Real>& Surfels;
  const ScreenFootprints<Real>& Footprints;
  const Real& Depth; ///< t, the optical depth at the centre in focus
};

/// Completes the colours of nodes; those of leaves stay.
/// @param onLens whether the slopes are wanted
template <class Real>
SURFELSPLATTING_INLINE ColorSlopes<Real> FinishNodeColors(const SetupJob& job,
  const BatchIndices<Real>& index, const SeenNodes<Real>& nodes, bool onLens,
  SurfelColors<Real>& colors)
{
  ColorSlopes<Real> slopes;
  if (!index.HasNodes() || job.Cloud.Kind != CloudKind::Capture || !job.Cloud.NodeColors ||
    job.Colors != Paint::Own)
  {
    return slopes;
  }
  const NodeColorMoments<Real> moments = MomentsInCamera(job, index, colors);
  ShowNearSide(job, nodes.Surfels, nodes.Depth, moments, colors);
  if (onLens)
  {
    slopes.Set(nodes.Footprints, moments);
  }
  return slopes;
}
}
