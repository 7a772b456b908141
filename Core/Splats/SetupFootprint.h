// SPDX-License-Identifier: BSD-3-Clause
/**
 * Second stage of the set-up: computes a surfel's footprint on the screen from lens, pixel filter
 * and level of detail, and chooses the grid that it is drawn on.
 */
#pragma once

#include "Core/Base/CoarseLevels.h"
#include "Core/Lens/Lens.h"
#include "Core/Splats/SetupBatch.h"
#include "Core/Splats/SetupConstants.h"

namespace SurfelSplatting
{
template <class Real>
struct LensBlur
{
  Real ConfusionX, ConfusionY; ///< C in x and y, px
  Real Signed;                 ///< C / f, negative in front of the focus
  Symmetric2Of<Real> Smooth;   ///< h I + V_I, px^2
};

/// V_I, px^2.
template <class Real>
SURFELSPLATTING_INLINE Symmetric2Of<Real> LensVariance(
  const SetupJob& job, const LensBlur<Real>& blur)
{
  const LensShape& shape = job.Shape;
  return { (job.DefocusFactor * shape.XX) * blur.ConfusionX * blur.ConfusionX,
    (job.DefocusFactor * shape.YY) * blur.ConfusionY * blur.ConfusionY,
    (job.DefocusFactor * shape.XY) * blur.ConfusionX * blur.ConfusionY };
}

template <class Real>
SURFELSPLATTING_INLINE LensBlur<Real> Blur(
  const SetupJob& job, const BatchIndices<Real>& index, const PlacedSurfels<Real>& s)
{
  const View& view = job.Camera;
  const double fx = __builtin_fabs(view.Fx), fy = __builtin_fabs(view.Fy);
  LensBlur<Real> b;
  b.ConfusionX = b.ConfusionY = b.Signed = Real{};
  b.Smooth = { Uniform<Real>(job.Prefilter), Uniform<Real>(job.Prefilter), Real{} };
  if (!view.Parallel && job.LensRadius > 0.0)
  {
    b.Signed = SignedConfusion(job.LensRadius, job.InverseFocalDistance, s.InverseZ);
    b.ConfusionX = fx * Magnitude(b.Signed);
    b.ConfusionY = fy * Magnitude(b.Signed);
    const Symmetric2Of<Real> lens = LensVariance(job, b);
    b.Smooth.XX += lens.XX;
    b.Smooth.YY += lens.YY;
    b.Smooth.XY = lens.XY;
  }
  if (index.HasNodes())
  {
    const Real perDepth = MinNodeBlur * s.InverseZ;
    const Real spacing = perDepth * perDepth * Norm(s.Area) * s.Patch;
    b.Smooth.XX = Larger(b.Smooth.XX, fx * fx * spacing);
    b.Smooth.YY = Larger(b.Smooth.YY, fy * fy * spacing);
  }
  return b;
}

/// The share of a surfel's weight that is left out, because surfels of other sheets cover the same:
/// their overlap times l^2, l the lens's share of the footprint of a leaf, of area |A| / 2^level of
/// a node. In focus the layers of the sheets are apart, and the nearest one hides the others.
/// (Ours; Documentation/Method.md. With l instead of l^2 seven cells lose 0.8 dB on a lion with
/// foliage.)
template <class Real>
SURFELSPLATTING_INLINE Real CoveredShare(const SetupJob& job, const BatchIndices<Real>& index,
  const PlacedSurfels<Real>& s, const LensBlur<Real>& blur)
{
  const double leaves = static_cast<double>(std::size_t{ 1 } << index.Level);
  const double perArea = VariancePerArea / leaves * __builtin_fabs(job.Camera.Fx * job.Camera.Fy);
  const Real lens = job.DefocusFactor * blur.ConfusionX * blur.ConfusionY;
  const Real own = perArea * s.InverseZ * s.InverseZ * Norm(s.Area) + job.Prefilter;
  const Real share = lens / Larger(lens + own, Uniform<Real>(1e-30));
  return s.Overlap * share * share;
}

/**
 * Variance matrix of the smallest ellipse around two ellipses with the same centre (Krivanek and
 * Zara 2003, DC-TR-2003). Both are diagonal in the axes of the generalised eigenproblem A x = l B
 * x; the result takes the larger variance along each axis. B is V_I.
 */
template <class Real>
SURFELSPLATTING_INLINE Symmetric2Of<Real> Circumellipse(
  const Symmetric2Of<Real>& a, const Symmetric2Of<Real>& b)
{
  // With B = L L', L = (p, 0; s p, r): in the coordinates where B is the identity, A' = L^-1 A
  // L'^-1 = R diag(l) R'.
  const Real s = b.XY / b.XX, rr = b.YY - s * b.XY, root = SquareRoot(b.XX * rr);
  const Real sheared = a.XY - s * a.XX;
  const Real x = a.XX / b.XX, y = (a.YY - s * (a.XY + sheared)) / rr, xy = sheared / root;
  const Real mean = 0.5 * (x + y), half = 0.5 * (x - y);
  const Real radius = SquareRoot(half * half + xy * xy), one = Uniform<Real>(1.0);
  const Real low = Larger(mean - radius, one), high = Larger(mean + radius, one);
  const Real cosine = radius > 0.0 ? half / radius : one; // of the doubled angle
  const Real sine = radius > 0.0 ? xy / radius : Real{};
  const Real m = 0.5 * (low + high), d = 0.5 * (high - low);
  const Real xx = (m + d * cosine) * b.XX, cross = d * sine * root;
  return { xx, (m - d * cosine) * rr + s * (s * xx + 2.0 * cross), cross + s * xx };
}

/// V_r of nodes: the mean covariance of the leaves below.
template <class Real>
SURFELSPLATTING_INLINE Symmetric3Of<Real> GatherLeafCovariances(
  const SurfelCloud& cloud, const BatchIndices<Real>& index)
{
  return GatherCovariances<Real>(
    [&](int l) { return cloud.LeafCovariances + 6 * (index[l] - cloud.NumberOfSurfels); });
}

/// W of a node as in the paper: M V_r M' + h I + V_diff, V_diff = Circumellipse(M V_q M', V_I).
/// @param all M S M' of the node
template <class Real>
SURFELSPLATTING_INLINE FootprintOf<Real> PaperFootprint(const SetupJob& job,
  const BatchIndices<Real>& index, const ProjectionJacobian<Real>& jacobian,
  const Symmetric2Of<Real>& all, const LensBlur<Real>& blur)
{
  const Symmetric2Of<Real> reconstruction =
    jacobian.Project(ToCamera(job.Linear, GatherLeafCovariances(job.Cloud, index)));
  const Symmetric2Of<Real> level{ Larger(all.XX - reconstruction.XX, Real{}),
    Larger(all.YY - reconstruction.YY, Real{}), all.XY - reconstruction.XY };
  // V_I of a pinhole is 0. A millionth of the pixel filter's variance keeps the eigenproblem
  // regular.
  const Real h = Uniform<Real>(job.Prefilter), least = 1e-6 * h;
  const Symmetric2Of<Real> lens = LensVariance(job, blur);
  const Symmetric2Of<Real> difference = Circumellipse(
    level, Symmetric2Of<Real>{ Larger(lens.XX, least), Larger(lens.YY, least), lens.XY });
  return { { reconstruction.XX + difference.XX, reconstruction.YY + difference.YY,
             reconstruction.XY + difference.XY },
    { h, h, Real{} } };
}

/// Footprints of surfels on the screen.
template <class Real>
struct ScreenFootprints
{
  ProjectionJacobian<Real> Jacobian;
  Symmetric2Of<Real> Projected; ///< M S M', px^2
  FootprintOf<Real> W;          ///< without the variance that a coarse grid adds
  Real Smooth;                  ///< share of W from lens and pixel filter, [0, 1]
  Real Cell;                    ///< size of the coarse grid's cells, px; 1: the picture
  Real SquaredConfusion;        ///< C^2 that determines the kernel's shape, px^2
  MaskOf<Real> Tilted;          ///< has a colour gradient
};

/// How the lens shapes a kernel.
template <class Real>
SURFELSPLATTING_INLINE BlurShape<Real> ShapeOf(const SetupJob& job, const ScreenFootprints<Real>& f)
{
  const LensShape& s = job.Shape;
  return BlurShape<Real>(
    f.W, f.SquaredConfusion, { Uniform<Real>(s.XX), Uniform<Real>(s.YY), Uniform<Real>(s.XY) });
}

/// The blur's variance, px^2, from which on a splat may go to the lowest grid: between that of
/// LowestCellsPerDeviation and (1 + GridStagger)^2 times it. Four leaves and the nodes above them
/// have the same; neighbours differ as much as multiples of the golden ratio do.
template <class Real>
SURFELSPLATTING_INLINE Real LeastBlurOfGrids(const BatchIndices<Real>& index)
{
  constexpr std::uint32_t goldenTurn = 2654435769u; // 2^32 over the golden ratio
  constexpr auto least = static_cast<float>(LowestCellsPerDeviation * (1 << LowestCoarseLevel));
  return GatherFloats<Real>([&](int lane) {
    const std::uint32_t turns = static_cast<std::uint32_t>(index.LeafOf(lane) >> 2) * goldenTurn;
    const float share = static_cast<float>(turns >> 8) * (1.0f / 16777216.0f);
    const float deviation = least + least * GridStagger * share;
    return deviation * deviation;
  });
}

/// Chooses the coarse grid of a splat (CoarseGrid.h). If the kernel's border is too narrow for the
/// grid (GridCellsPerDeviation), the next finer grid is used. A gradient acts mainly in that
/// border. If a node's gradient needs an even finer grid, the node is small compared with the blur,
/// and its gradient is dropped.
template <class Real>
SURFELSPLATTING_INLINE void ChooseGrid(const SetupJob& job, const BatchIndices<Real>& index,
  const MaskOf<Real>& alive, const LensBlur<Real>& blur, ScreenFootprints<Real>& f)
{
  const Real smallest = f.W.SmallestEigenvalue(), one = Uniform<Real>(1.0);
  f.Cell = CoarseCell(smallest);
  if (!AnyLane<Real>(alive & (f.Cell > 1.0)))
  {
    f.Cell = one;
    return;
  }
  const double lowest = 1 << LowestCoarseLevel;
  const MaskOf<Real> isLowest = alive & (f.Cell == lowest);
  if (AnyLane<Real>(isLowest))
  {
    const Real blurred = Smaller(smallest, Smaller(blur.Smooth.XX, blur.Smooth.YY));
    f.Cell = isLowest & (blurred < LeastBlurOfGrids(index)) ? one : f.Cell;
  }
  const Real confusion = Larger(blur.ConfusionX, blur.ConfusionY);
  const Real sharp =
    SquareRoot(Larger(smallest - (0.25 * job.LeastShape) * confusion * confusion, Real{}));
  const MaskOf<Real> finer =
    (f.Cell > 1.0) & Not<MaskOf<Real>>(f.Cell <= GridCellsPerDeviation * sharp);
  f.Tilted &= Not(finer) | (0.5 * f.Cell <= GridCellsPerDeviation * sharp);
  f.Cell = finer ? (f.Cell > lowest ? 0.5 * f.Cell : one) : f.Cell;

  const MaskOf<Real> coarse = f.Cell > 1.0;
  const Real softness = MinBorderDeviation * f.Cell;
  const Real softened =
    Smaller(f.SquaredConfusion, (4.0 / job.LeastShape) * (smallest - softness * softness));
  f.SquaredConfusion = coarse ? softened : f.SquaredConfusion;
  // The grid's interpolation adds d^2 / 6.
  f.W = Select<Real>(coarse, f.W.Without(f.Cell * f.Cell / 6.0), f.W);
}

template <class Real>
SURFELSPLATTING_INLINE ScreenFootprints<Real> Project(const SetupJob& job,
  const BatchIndices<Real>& index, const PlacedSurfels<Real>& s, const LensBlur<Real>& blur)
{
  const View& view = job.Camera;
  const bool paper = index.Level > 0 && job.PaperDetail;
  ScreenFootprints<Real> f;
  f.Jacobian = ProjectionJacobian<Real>(view, s.P, s.InverseZ);
  f.Projected = f.Jacobian.Project(s.Covariance);
  f.W = FootprintOf<Real>(f.Projected, blur.Smooth);
  if (paper)
  {
    f.W = PaperFootprint(job, index, f.Jacobian, f.Projected, blur);
  }
  const Symmetric2Of<Real>& smooth = blur.Smooth;
  const bool isRound = view.Fx * view.Fx == view.Fy * view.Fy && job.LeastShape == 1.0;
  const Real area = isRound ? smooth.XX : SquareRoot(smooth.XX * smooth.YY - smooth.XY * smooth.XY);
  f.Smooth = Smaller(area * f.W.InverseRoot, Uniform<Real>(1.0));
  const bool gradients =
    index.HasNodes() && !paper && job.Cloud.NodeColors && job.Colors == Paint::Own;
  f.Tilted = gradients ? s.Alive : MaskOf<Real>{};
  f.Cell = Uniform<Real>(1.0);
  f.SquaredConfusion = blur.ConfusionX * blur.ConfusionY;
  if (job.CoarseGrids)
  {
    ChooseGrid(job, index, s.Alive, blur, f);
  }
  return f;
}
}
