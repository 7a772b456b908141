// SPDX-License-Identifier: BSD-3-Clause
/**
 * Turns surfels into splats. The translation units of the targets (SetupTarget.h) include this
 * file. Stages:
 *
 *   SetupBatch.h        read, transform to camera space, cull
 *   SetupFootprint.h    blur, project, choose a grid
 *   ResamplingKernel.h  make the kernel
 *   SetupColor.h        colour, shade
 *   SetupOutput.h       place on the screen; write
 *   this file           weight, depth
 *   SetupGaussians.h    all of it for Gaussians in space
 */
#pragma once

#include "Core/Splats/SetupGaussians.h"
#include "Core/Splats/SetupOutput.h"

namespace SurfelSplatting
{
/// Coverage at the centre, compensated for RippleLoss.
template <class Real>
SURFELSPLATTING_INLINE Real Weigh(
  const SetupJob& job, PlacedSurfels<Real>& s, const Real& smooth, const Real& peak)
{
  // along^2 / all is cos^2 of the angle between normal and line of sight.
  const Real along = job.Camera.Parallel ? s.Area.Z : Dot(s.Area, s.P);
  Real all = Dot(s.Area, s.Area);
  all *= job.Camera.Parallel ? Uniform<Real>(1.0) : Dot(s.P, s.P);
  const Real loss = RippleLoss * (1.0 - smooth) * Smaller(along * along, all);
  const Real weight = s.Deposit * peak * all / (all - loss);
  s.Invalid |= s.Alive & (weight != weight);
  s.Alive &= weight >= MinSplatWeight;
  return weight;
}

/// The covariance of screen position and depth gives the regression of depth over the footprint. In
/// focus this is the surfel's plane. Where blur dominates the footprint it is flat, because blur
/// does not depend on depth. A z-buffer compares fragments, so it uses the plane.
template <class Real>
SURFELSPLATTING_INLINE SplatDepths<Real> Depths(
  const SetupJob& job, const PlacedSurfels<Real>& surfels, const ScreenFootprints<Real>& f)
{
  const Symmetric3Of<Real>& s = surfels.Covariance;
  const ProjectionJacobian<Real>& m = f.Jacobian;
  const Real trace = s.Trace();
  const Real largest = // of the eigenvalues of a flat kernel, where the least is 0
    0.5 * (trace + SquareRoot(Larger(trace * trace - 4.0 * s.SumOfMinors(), Real{})));
  const Real halfRange = DepthExtentAlongZ * SquareRoot(Larger(s.ZZ, Real{})) +
    DepthExtentIsotropic * SquareRoot(Larger(largest, Real{}));
  const Real cx = m.XX * s.XZ + m.XZ * s.ZZ, cy = m.YY * s.YZ + m.YZ * s.ZZ;
  Real xx = f.W.XX, yy = f.W.YY, xy = f.W.XY, determinant = f.W.Determinant;
  if (job.DepthBuffered)
  {
    const Real x = m.XX * (m.XX * s.XX + 2.0 * m.XZ * s.XZ) + m.XZ * m.XZ * s.ZZ;
    const Real y = m.YY * (m.YY * s.YY + 2.0 * m.YZ * s.YZ) + m.YZ * m.YZ * s.ZZ;
    const Real sharp = x * y - f.Projected.XY * f.Projected.XY;
    const MaskOf<Real> plane = sharp > MinPlaneShare * x * y;
    xx = plane ? x : xx;
    yy = plane ? y : yy;
    xy = plane ? f.Projected.XY : xy;
    determinant = plane ? sharp : determinant;
  }
  const Real inverse = 1.0 / determinant;
  const Real near = surfels.P.Z - halfRange;
  return { near, surfels.P.Z + halfRange, (yy * cx - xy * cy) * inverse,
    (xx * cy - xy * cx) * inverse,
    near + DepthBehindSheet * surfels.Overlap * surfels.Overlap * halfRange };
}

/// Makes the splats of as many surfels as Real has lanes.
template <class Real>
SURFELSPLATTING_INLINE void MakeBatch(
  const SetupJob& job, const BatchIndices<Real>& index, SplatOutput& output)
{
  PlacedSurfels<Real> s = Place(job, index);
  if (AnyLane<Real>(s.Alive))
  {
    PrepareToWrite<Real>(output);
    const LensBlur<Real> blur = Blur(job, index, s);
    ScreenFootprints<Real> f = Project(job, index, s, blur);
    const ResamplingKernelOf<Real> kernel =
      MakeKernel(ChooseProfile<Real>(job.Kernel, job.Gaussian, f.W, ShapeOf(job, f)), f.W);
    const ScreenPlaces<Real> places = PlaceOnScreen(job, s, f.Cell, kernel);
    if (AnyLane<Real>(s.Overlap > 0.0))
    {
      const Real leftOut = CoveredShare(job, index, s, blur);
      s.Deposit *= 1.0 - leftOut;
      s.Overlap -= leftOut;
    }
    const Real weight = Weigh(job, s, f.Smooth, kernel.Peak);
    if (AnyLane<Real>(s.Alive))
    {
      const SplatDepths<Real> depths = Depths(job, s, f);
      const SurfelColors<Real> colors = Color(job, index, s);
      SplatBatch<Real> batch{ s, blur, f, kernel, places, weight, depths, colors };
      Write(job, index, batch, output);
    }
  }
  output.Invalid += CountLanes<Real>(s.Invalid);
}

template <class Real>
SURFELSPLATTING_INLINE void MakeAnyBatch(
  const SetupJob& job, const BatchIndices<Real>& index, SplatOutput& output)
{
  job.Cloud.IsInSpace() ? MakeGaussianBatch(job, index, output) : MakeBatch(job, index, output);
}

/// Makes the splats of a part of a run.
/// @param merging that of the run; a constant 0 leaves the code for pairs out
template <class Real>
SURFELSPLATTING_INLINE void MakeRun(const SetupJob& job, const CutRange& run, double merging,
  std::size_t begin, std::size_t end, SplatOutput& output)
{
  constexpr std::size_t lanes = LaneTypes<Real>::Count;
  BatchIndices<Real> index;
  index.Level = static_cast<int>(run.Level);
  index.Merging = merging;
  for (std::size_t i = begin; i < end; i += lanes)
  {
    for (std::size_t l = 0; l < lanes; ++l)
    {
      const std::size_t place = i + l < end ? i + l : end - 1;
      index.I[l] = run.Begin + place;
      if (merging > 0.0)
      {
        index.Parents[l] = run.Parents + place / 2;
      }
    }
    index.FirstLeaf = run.FirstLeaf + (static_cast<std::uint64_t>(i) << index.Level);
    index.Count = static_cast<int>(end - i < lanes ? end - i : lanes);
    MakeAnyBatch(job, index, output);
  }
}

/// SetupTarget::MakeSplats.
template <class Real>
void MakeSplats(const SetupJob& job, const CutRange& run, std::size_t skip, std::size_t count,
  SplatOutput& output)
{
  if (run.Merging > 0.0f)
  {
    MakeRun<Real>(job, run, run.Merging, skip, skip + count, output);
    return;
  }
  MakeRun<Real>(job, run, 0.0, skip, skip + count, output);
}
}
