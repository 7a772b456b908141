// SPDX-License-Identifier: BSD-3-Clause
/**
 * Set-up of Gaussians in space (CloudKind): the stages of SetupImplementation.h for them.
 *
 * The weight at the centre of a footprint W is, with the mass kept over every blur,
 *   captures: o sqrt(det W_0) / sqrt(det W), W_0 = M S M' + h the footprint in focus, as published,
 *             or, with KeepsMass, M S M' (Yu, Chen, Huang, Sattler, Geiger 2024);
 *             of nodes, DilatedArea instead of sqrt(det W_0)
 *   volumes:  M f^2 |p| / z^3 / (2 pi sqrt(det W)), M the mass (GaussianMass.h)
 *
 * Where that is an optical depth, the lens keeps the opacity instead (KeepOpacity); of volumes,
 * three quarters of the way (KeptByVolumes). Of nodes of captures, it leaves out what their
 * Gaussians cover of one another (CaptureOverlap.h).
 */
#pragma once

#include "Core/Base/Tiles.h"
#include "Core/Lens/GaussianFootprint.h"
#include "Core/Splats/SetupConstants.h"
#include "Core/Splats/SetupNodeColors.h"
#include "Core/Splats/SetupOutput.h"
#include "Core/Surfels/GaussianMass.h"

namespace SurfelSplatting
{
template <class Real>
SURFELSPLATTING_INLINE void GatherGaussians(
  const SurfelCloud& cloud, const BatchIndices<Real>& index, StoredSurfels<Real>& s)
{
  s.Position = GatherPosition(cloud, index);
  s.Covariance = GatherCovariances<Real>([&](int l) { return cloud.Covariances + 6 * index[l]; });
  s.Area = { Real{}, Real{}, Real{} };
  s.Overlap = Real{};
  const Real density = Gather(cloud.Densities, index, 1);
  if (cloud.Kind == CloudKind::Volume)
  {
    s.Size = density * KernelVolume(s.Covariance);
    return;
  }
  // Opacities become optical depths while pairs merge.
  const Real depth = 1.0 + index.Merging * (DepthOverOpacity(density) - 1.0);
  s.Area.X = MeanKernelArea(s.Covariance);
  s.Size = density * depth * s.Area.X;
}

/// Nodes; Area.X becomes the leaves' mean kernel area. Nodes without LeafScale, which are of
/// earlier versions or of volumes, are as large as their leaves.
template <class Real>
SURFELSPLATTING_INLINE void GatherGaussianNodes(
  const SurfelCloud& cloud, const BatchIndices<Real>& index, StoredSurfels<Real>& s)
{
  GatherNodes(cloud, index, s);
  const Real known = cloud.Kind == CloudKind::Capture ? s.Area.X : Real{}; // else of normals
  const Real scale = known > 0.0 ? known / s.Size : Uniform<Real>(1.0);
  s.Area = { scale * scale * MeanKernelArea(s.Covariance), Real{}, Real{} };
}

/// Moves Gaussians or nodes towards their parents (CutRange.h); each keeps its mass.
template <class Real>
SURFELSPLATTING_INLINE void MergeGaussians(
  const SurfelCloud& cloud, const BatchIndices<Real>& index, StoredSurfels<Real>& s)
{
  StoredSurfels<Real> parent;
  GatherGaussianNodes(cloud, index.AtParents(), parent);
  const Real t = Uniform<Real>(ShareOfChildren(index)), rest = Uniform<Real>(1.0 - index.Merging);
  s.Position = Mixed(parent.Position, s.Position, t);
  s.Area.X = Mixed(parent.Area.X, s.Area.X, rest);
  s.Overlap = Mixed(parent.Overlap, s.Overlap, rest);
  s.Covariance = Mixed(parent.Covariance, s.Covariance, rest);
}

/// Gaussians in camera space; Deposit is the mass of volumes, in world units, and the opacity of
/// captures.
template <class Real>
SURFELSPLATTING_INLINE PlacedSurfels<Real> PlaceGaussians(
  const SetupJob& job, const BatchIndices<Real>& index)
{
  const bool volume = job.Cloud.Kind == CloudKind::Volume;
  StoredSurfels<Real> stored;
  index.Level > 0 ? GatherGaussianNodes(job.Cloud, index, stored)
                  : GatherGaussians(job.Cloud, index, stored);
  if (index.Merging > 0.0)
  {
    MergeGaussians(job.Cloud, index, stored);
  }
  const MaskOf<Real> finite = AreFinite(stored) & IsFinite(stored.Size);
  PlacedSurfels<Real> s = MoveToCamera(job, index, stored, finite);
  s.Area = stored.Area;
  s.Patch = Larger(Smaller(stored.Area.X / MeanKernelArea(stored.Covariance), Uniform<Real>(1.0)),
    Uniform<Real>(LeastLeafScale));
  s.BackSide = MaskOf<Real>{};
  s.Deposit = volume ? job.Stretch * stored.Size : stored.Size / MeanKernelArea(stored.Covariance);
  s.Alive &= s.Deposit > 0.0;
  if (!job.Camera.Parallel)
  {
    NearImages<Real> images{};
    s.Alive &= MayBeSeen(job, s, LeastGaussianReach, images);
  }
  return s;
}

/// How much of the opacity of a volume's Gaussians the lens keeps; of the rest it keeps the depth.
/// A ray that passes beside one meets its neighbours, which overlap it: that of a homogeneous
/// medium keeps the depth, that of a grain the opacity.
constexpr double KeptByVolumes = 0.75;

/// How much of a Gaussian's weight is an optical depth, and not an opacity.
template <class Real>
SURFELSPLATTING_INLINE double Absorbs(const SetupJob& job, const BatchIndices<Real>& index)
{
  return job.Cloud.Kind == CloudKind::Volume || index.Level > 0 ? 1.0 : index.Merging;
}

/// C / 4 in px. In the cells of a run the lens is smaller: the interpolation between them spreads
/// by d^2 / 6, a disc of radius C by C^2 / 4, an ellipse in its shorter axis by less.
template <class Real>
SURFELSPLATTING_INLINE Real QuarterOfConfusion(const SetupJob& job, const SplatBatch<Real>& b)
{
  const Real confusion =
    __builtin_sqrt(__builtin_fabs(job.Camera.Fx * job.Camera.Fy)) * b.Blur.Signed;
  const Real& cell = b.Depths.SlopeY; // Splat.h, InSpace
  const Real spread = cell > 1.0 ? cell * cell * (1.0 / (1.5 * job.LeastShape)) : Real{};
  const Real quarter = 0.25 * SquareRoot(Larger(confusion * confusion - spread, Real{}));
  return confusion < 0.0 ? -quarter : quarter;
}

/// Opacities at the centres in focus. What a medium hides of the lens has no border there.
template <class Real>
SURFELSPLATTING_INLINE Real OpacityOfCenter(
  const SetupJob& job, const BatchIndices<Real>& index, const Real& inFocus)
{
  if (job.Cloud.Kind == CloudKind::Volume)
  {
    return Real{};
  }
  const double absorbs = Absorbs(job, index);
  const Real absorbed = absorbs > 0.0
    ? FillLanes<Real>(LaneTypes<Real>::Count,
        [&](int l) { return 1.0 - __builtin_expf(-static_cast<float>(LaneAt(inFocus, l))); })
    : Real{};
  return Smaller(inFocus + absorbs * (absorbed - inFocus), Uniform<Real>(1.0));
}

template <class Real>
SURFELSPLATTING_INLINE FootprintRows<Real> SpaceFootprints(
  const Real& quarter, const Real& opacity, const ColorSlopes<Real>& slopes)
{
  static_assert(offsetof(SpaceFootprint, GreenX) == 12 && offsetof(SpaceFootprint, BlueX) == 16 &&
      offsetof(SpaceFootprint, BlueY) == 28,
    "first and last columns of the parts");
  return { { { Narrow<Real>(quarter), Narrow<Real>(opacity), Narrow<Real>(slopes.X[0]),
               Narrow<Real>(slopes.X[1]) },
    { Narrow<Real>(slopes.X[2]), Narrow<Real>(slopes.Y[0]), Narrow<Real>(slopes.Y[1]),
      Narrow<Real>(slopes.Y[2]) } } };
}

/// Makes splats that are written those of Gaussians in space (Splat.h, SpaceFootprint).
/// @param inFocus weights there
template <class Real>
SURFELSPLATTING_INLINE void MarkGaussians(const SetupJob& job, const BatchIndices<Real>& index,
  const SplatBatch<Real>& b, const Real& inFocus, const ColorSlopes<Real>& slopes,
  SplatOutput& output)
{
  const float absorbs = static_cast<float>(Absorbs(job, index));
  const std::size_t first = output.Count - CountLanes<Real>(b.Surfels.Alive);
  std::size_t place = first;
  for (int l = 0; l < LaneTypes<Real>::Count; ++l)
  {
    if (LaneAt(b.Surfels.Alive, l))
    {
      output.Splats[place].Gradient = InSpace;
      output.Splats[place].Opacity = absorbs;
      if (job.Cloud.Kind == CloudKind::Volume)
      {
        const double deviation = __builtin_sqrt(LaneAt(b.Surfels.Covariance.ZZ, l));
        output.Splats[place].Far += static_cast<float>(deviation);
      }
      ++place;
    }
  }
  if (output.Footprints)
  {
    WriteFootprints(
      SpaceFootprints(QuarterOfConfusion(job, b), OpacityOfCenter(job, index, inFocus), slopes),
      b.Surfels.Alive, index.Count, first, output);
  }
}

/// Weight at the centre of a footprint in focus: opacity, or optical depth.
template <class Real>
SURFELSPLATTING_INLINE Real WeighInFocus(const SetupJob& job, const PlacedSurfels<Real>& s,
  const Symmetric2Of<Real>& projected, const FootprintOf<Real>& sharp)
{
  const View& view = job.Camera;
  if (job.Cloud.Kind == CloudKind::Capture)
  {
    const double h = job.KeepsMass ? 0.0 : job.Prefilter;
    return s.Deposit * sharp.InverseRoot *
      DilatedArea(projected.XX, projected.YY, projected.XY, s.Patch, h);
  }
  const Real perArea = __builtin_fabs(view.Fx * view.Fy) * (0.5 / Pi) * sharp.InverseRoot;
  return s.Deposit * perArea *
    (view.Parallel ? Uniform<Real>(1.0) : Norm(s.P) * s.InverseZ * s.InverseZ * s.InverseZ);
}

/// Footprints with and without the lens.
template <class Real>
SURFELSPLATTING_INLINE ScreenFootprints<Real> ProjectGaussians(const SetupJob& job,
  const PlacedSurfels<Real>& s, const LensBlur<Real>& blur, FootprintOf<Real>& sharp)
{
  ScreenFootprints<Real> f;
  f.Jacobian = ProjectionJacobian<Real>(job.Camera, s.P, s.InverseZ);
  f.Projected = f.Jacobian.Project(s.Covariance);
  f.W = FootprintOf<Real>(f.Projected, blur.Smooth);
  f.Tilted = MaskOf<Real>{};
  f.Cell = Uniform<Real>(1.0);
  f.SquaredConfusion = blur.ConfusionX * blur.ConfusionY;
  const Real h = Uniform<Real>(job.Prefilter);
  sharp = FootprintOf<Real>(f.Projected, { h, h, Real{} });
  return f;
}

/// Smallest deviation of a footprint in a run's cells. Of tori and balls at 10 to 36 px of blur it
/// loses 0.04 dB in the mean against cells of 2, 4, 8 and 16 px from 1.2 on; 1.2 loses 0.2 dB, 1.5
/// gains nothing.
constexpr double RunCellsPerDeviation = 1.4;

/// Size of a run's cells (GaussianRun.h), px; 1: none. It depends on the depth alone.
template <class Real>
SURFELSPLATTING_INLINE Real RunCell(const SetupJob& job, const LensBlur<Real>& blur)
{
  if (!job.GaussianRuns)
  {
    return Uniform<Real>(1.0);
  }
  const Real variance = blur.Smooth.SmallestEigenvalue();
  Real cell = Uniform<Real>(1.0);
  for (const int intervals : RunIntervals)
  {
    // Exactly what the raster compares.
    const double d = static_cast<double>(static_cast<float>(TileSize) / intervals);
    const double deviation = RunCellsPerDeviation * d;
    cell = variance >= deviation * deviation ? Uniform<Real>(d) : cell;
  }
  return cell;
}

/// Takes the interpolation between cells out of the footprints, and softens borders of discs that
/// cells cannot resolve, as on coarse grids (ChooseGrid).
template <class Real>
SURFELSPLATTING_INLINE void UseCells(
  const SetupJob& job, const Real& cell, ScreenFootprints<Real>& f)
{
  const MaskOf<Real> coarse = cell > 1.0;
  if (AnyLane<Real>(coarse))
  {
    const Real softness = MinBorderDeviation * cell;
    const Real softened = (4.0 / job.LeastShape) * (f.W.SmallestEigenvalue() - softness * softness);
    f.SquaredConfusion =
      coarse ? Smaller(f.SquaredConfusion, Larger(softened, Real{})) : f.SquaredConfusion;
    f.W = f.W.Without(coarse ? cell * cell / 6.0 : Real{});
  }
}

/// Makes the splats of as many Gaussians as Real has lanes.
template <class Real>
SURFELSPLATTING_INLINE void MakeGaussianBatch(
  const SetupJob& job, const BatchIndices<Real>& index, SplatOutput& output)
{
  const bool volume = job.Cloud.Kind == CloudKind::Volume;
  PlacedSurfels<Real> s = PlaceGaussians(job, index);
  if (AnyLane<Real>(s.Alive))
  {
    const LensBlur<Real> blur = Blur(job, index, s);
    FootprintOf<Real> sharp;
    ScreenFootprints<Real> f = ProjectGaussians(job, s, blur, sharp);
    const Real cell = RunCell(job, blur);
    UseCells(job, cell, f);
    SurfelColors<Real> colors = Color(job, index, s);
    const Real inFocus = colors.Opacity * WeighInFocus(job, s, f.Projected, sharp);
    const ColorSlopes<Real> slopes =
      FinishNodeColors(job, index, { s, f, inFocus }, output.Footprints != nullptr, colors);
    const Real reach = volume ? VolumeReach(inFocus) : CaptureReach(inFocus);
    KernelProfile<Real> profile = SpaceProfile<Real>(f.W, ShapeOf(job, f), reach);
    const Real fainter = Smaller(f.W.InverseRoot / sharp.InverseRoot, Uniform<Real>(1.0));
    const Real beyond = volume
      ? 1.0 + (MassOverCutOff(inFocus) - 1.0) * Larger(Real{} - profile.Shape, Real{})
      : ShortenReach<Real>(profile, fainter);
    ResamplingKernelOf<Real> kernel = MakeKernel(profile, f.W);
    // Cells just outside of a tile's pixels belong to it.
    kernel.HalfWidth += cell > 1.0 ? cell : Real{};
    kernel.HalfHeight += cell > 1.0 ? cell : Real{};
    const ScreenPlaces<Real> places = PlaceOnScreen(job, s, f.Cell, kernel);
    // The lens's share of the footprint decides how much of the overlap is left out.
    const Real depth = inFocus * (1.0 - s.Overlap * (1.0 - fainter));
    const Real spread = depth * (2.0 * Pi) * profile.Peak / sharp.InverseRoot;
    const double kept = volume ? KeptByVolumes : Absorbs(job, index);
    const Real weight = beyond * (spread + kept * (KeepOpacity(depth, spread) - spread));
    s.Invalid |= s.Alive & (weight != weight);
    s.Alive &= weight >= MinSplatWeight;
    const SplatDepths<Real> depths{ s.P.Z, s.P.Z, profile.Reach, cell, s.P.Z };
    SplatBatch<Real> batch{ s, blur, f, kernel, places, weight, depths, colors };
    Write(job, index, batch, output);
    MarkGaussians(job, index, batch, inFocus, slopes, output);
  }
  output.Invalid += CountLanes<Real>(s.Invalid);
}
}
