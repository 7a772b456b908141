// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Hierarchy/CutView.h"

#include "Core/Base/CoarseLevels.h"
#include "Core/Surfels/SurfelCloud.h"

#include <algorithm>

namespace SurfelSplatting
{
namespace
{
/// Ancestors of eight nodes are not drawn where they are larger than these by more than this, blur
/// included: they would have about as many fragments.
constexpr double LargestAncestor = 2.0;

/// Farther beyond the picture, px, nothing is looked for: such boxes cover it from side to side.
constexpr double FarBeyond = 1e8;

/// Not std::hypot: it rounds differently from glibc 2.35 on, which machines with older ones lack.
double LengthOnScreen(double x, double y)
{
  return std::sqrt(x * x + y * y);
}
}

CutView::Axis::Axis(double focal, double center, int size)
  : Focal(focal)
  , Center(center)
  , Size(size)
  , LowNormal(LengthOnScreen(focal, -center))
  , HighNormal(LengthOnScreen(focal, size - center))
{
}

CutView::CutView(const SurfelCloud& cloud, const CutCamera& camera, const CutSettings& settings)
  : Camera(camera.Projection)
  , Optics(camera.Optics)
  , InSpace(cloud.IsInSpace())
  , LensVariance(camera.LensVariance)
  , CellShare(camera.CellShare)
  , LongestAxis(std::sqrt(camera.Optics.Shape.Largest()))
  , CellReach(camera.CellReach * LongestAxis)
  , SupportRadius(camera.SupportRadius)
  , Prefilter(camera.Prefilter)
  , Cells(settings.Cells)
  , LocalToCamera(Affine3::Compose(Camera.WorldToCamera, cloud.LocalToWorld))
  , AreaToCamera(LocalToCamera.AreaMatrix())
  , FocalLength(std::fmax(std::abs(Camera.Fx), std::abs(Camera.Fy)))
  , AxisX(Camera.Fx, Camera.Cx, Camera.Width)
  , AxisY(Camera.Fy, Camera.Cy, Camera.Height)
{
  Symmetric3 gram{}; // L'L
  for (const Vector3& row : this->LocalToCamera.L)
  {
    AddOuterProduct(gram, row, 1.0);
  }
  const double largest = gram.LargestEigenvalue();
  this->Scale = std::sqrt(largest);
  // Only similarities preserve the angles of cones.
  const double spread = std::abs(largest - gram.Trace() / 3.0);
  this->ConesHold = spread <= 1e-5 * largest && !cloud.ShowsBacks;
}

double CutView::SmallestConfusion(const NodeBall& ball) const
{
  const double near = ball.Near(), far = ball.Far(), focus = this->Optics.FocalDistance;
  if (this->Camera.Parallel || (near <= focus && focus <= far))
  {
    return 0.0;
  }
  return this->FocalLength * this->CellShare *
    std::fmin(
      this->Optics.RelativeCircleOfConfusion(near), this->Optics.RelativeCircleOfConfusion(far));
}

double CutView::WidthOfPixel(const NodeBall& ball) const
{
  // Off the axis the projection stretches lengths by 1 / cos.
  const double stretch =
    this->Camera.Parallel ? 1.0 : Norm(ball.Center) / (ball.Center[2] * ball.Near());
  return 1.0 / (this->FocalLength * stretch * this->Scale);
}

bool CutView::IsOutside(const ClusterBounds::Node& node, const NodeBall& ball) const
{
  const View& v = this->Camera;
  if (ball.Far() < v.Near || ball.Near() > v.Far)
  {
    return true;
  }
  if (this->IsAroundLens(ball))
  {
    return false;
  }
  // How far a splat reaches beyond its centre, as a length at the depth of the ball: the standard
  // deviation of W is at most the sum of those of kernel, pixel and lens. Nodes are at most as
  // large as the ball, which contains their centres. A pixel counts as large as its longer side.
  const double spread = this->Scale * node.LeafSigma + ball.Radius;
  const double focal = std::fmin(std::abs(v.Fx), std::abs(v.Fy));
  double reach = 0.0;
  if (v.Parallel)
  {
    reach = spread + (std::sqrt(this->Prefilter) + 1.0) / focal;
  }
  else
  {
    const double stretch = Norm(ball.Center) / ball.Center[2] + ball.Radius / ball.Near();
    for (const double z : { ball.Near(), ball.Far() })
    {
      const double pixel = (std::sqrt(this->Prefilter) + 1.0) * z / focal;
      const double blur = 0.6 * this->LongestAxis * this->Optics.RelativeCircleOfConfusion(z) * z;
      reach = std::fmax(reach, spread * stretch + pixel + blur);
    }
  }
  const double margin = ball.Radius + this->SupportRadius * reach;
  return this->IsBeyond(ball.Center[0], ball.Center[2], this->AxisX, margin) ||
    this->IsBeyond(ball.Center[1], ball.Center[2], this->AxisY, margin);
}

/// Whether a ball is outside the picture's strip [0, size] px of an axis.
bool CutView::IsBeyond(double x, double z, const Axis& axis, double margin) const
{
  const double f = axis.Focal, c = axis.Center, size = axis.Size;
  const double scaled = f * x, reach = std::abs(f) * margin;
  if (this->Camera.Parallel)
  {
    return scaled + reach < -c || scaled - reach > size - c;
  }
  // Distance from the plane through the lens and the picture's border.
  const double low = -c, high = size - c;
  return scaled - low * z < -axis.LowNormal * margin ||
    scaled - high * z > axis.HighNormal * margin;
}

bool CutView::FacesAway(const ClusterBounds::Node& node, const NodeBall& ball) const
{
  if (!(node.Cone > 0.0f) || !this->ConesHold)
  {
    return false;
  }
  const Vector3 axis{ node.Axis[0], node.Axis[1], node.Axis[2] };
  const Vector3 a{ Dot(this->AreaToCamera[0], axis), Dot(this->AreaToCamera[1], axis),
    Dot(this->AreaToCamera[2], axis) };
  const double length = Norm(a);
  const double cosCone = node.Cone;
  const double sinCone = std::sqrt(std::fmax(0.0, 1.0 - cosCone * cosCone));
  if (!(length > 0.0))
  {
    return false;
  }
  if (this->Camera.Parallel)
  {
    return a[2] > sinCone * length;
  }
  // Of the ball as seen from the lens, times its distance.
  const double sinBall = ball.Radius + this->Optics.Radius;
  const double squared = Dot(ball.Center, ball.Center) - sinBall * sinBall;
  if (!(squared > 0.0))
  {
    return false;
  }
  const double cosBall = std::sqrt(squared);
  // Cone and ball together take less than a right angle, and the axis is within the rest of it.
  return cosCone * cosBall > sinCone * sinBall &&
    Dot(a, ball.Center) > (sinCone * cosBall + cosCone * sinBall) * length;
}

void CutView::Bound(const RunDeviations& local, const NodeBall& ball, CutRange& run) const
{
  const View& v = this->Camera;
  const RunDeviations deviations{ this->Scale * local.Own, this->Scale * local.OfAncestors };
  const double sigma = std::fmax(deviations.Own, deviations.OfAncestors);
  run.HasAncestors = deviations.OfAncestors > 0.0;
  run.Box = { 0, 0, v.Width, v.Height };
  if (this->IsAroundLens(ball))
  {
    return; // around the lens: anywhere on the screen
  }
  // A splat's z-range is 2 s_z + 0.5 s of its kernel, and thick kernels overestimate s by a
  // quarter: 2.63, and the rest is for rounding (test: Skips). That of a Gaussian in space is its
  // centre, of volumes and a deviation behind it: 0 and 1, and 0.1 for rounding (Boxes of runs).
  const double near = ball.Near() - (this->InSpace ? 0.1 : 2.7) * sigma;
  const double far = ball.Far() + (this->InSpace ? 1.1 : 2.7) * sigma;
  if (!(near <= far))
  {
    return; // wild values from a file: anywhere
  }
  run.Near = static_cast<float>(near - 1e-6 * std::abs(near)); // also after rounding to float
  run.Far = static_cast<float>(far + 1e-6 * std::abs(far));
  const double confusion = this->SmallestConfusion(ball);
  double largestConfusion = 0.0, stretch = 1.0, nearest = 1.0;
  if (!v.Parallel)
  {
    largestConfusion = this->FocalLength * this->CellReach *
      std::fmax(this->Optics.RelativeCircleOfConfusion(ball.Near()),
        this->Optics.RelativeCircleOfConfusion(ball.Far()));
    nearest = ball.Near();
    stretch = Norm(ball.Center) / ball.Center[2] + ball.Radius / nearest;
  }
  const double blur = this->Prefilter + 0.25 * confusion * confusion;
  run.Blur = static_cast<float>(confusion);
  run.Wide = CoarseCell(blur) > 1.0;
  const double perUnit = this->FocalLength * stretch / nearest;
  const double own = perUnit * deviations.Own, above = perUnit * deviations.OfAncestors;
  run.HasAncestors = run.HasAncestors &&
    above * above + blur <= LargestAncestor * LargestAncestor * (own * own + blur);
  const double size = run.HasAncestors ? std::fmax(own, above) : own;
  const double margin = this->LargestReach(size, largestConfusion, run.Wide);
  const PixelInterval x = this->CoveredPixels(ball.Center[0], ball, this->AxisX, margin);
  const PixelInterval y = this->CoveredPixels(ball.Center[1], ball, this->AxisY, margin);
  run.Box = { x.Begin, y.Begin, x.End, y.End };
}

/// How far a splat may reach from its centre, px.
/// @param size of the node, standard deviation, px @param confusion of its blur, C, px
/// @param wide whether it may be on a coarse grid
double CutView::LargestReach(double size, double confusion, bool wide) const
{
  if (this->InSpace)
  {
    // The lens adds C^2 / 4; cells reach 1 / RunCellsPerDeviation = 0.714 of the blur's deviation
    // farther. Factors are 1 to 4 % larger, for packed covariances (test: Boxes of runs). The
    // paper's lens adds up to C^2 / 2.77, but what it blurs much ends nearer than SupportRadius.
    const double blur = this->Prefilter + 0.26 * confusion * confusion;
    return this->SupportRadius * std::sqrt(1.02 * size * size + blur) + 0.72 * std::sqrt(blur) +
      1.0;
  }
  // Nodes may be blurred by as much as they are wide (SetupConstants.h, MinNodeBlur).
  const double variance =
    2.0 * size * size + this->Prefilter + this->LensVariance * confusion * confusion;
  // Tents of coarse grids reach a cell farther than the splats.
  return this->SupportRadius * std::sqrt(variance) + (wide ? CoarseCell(variance) : 1.0);
}

/// Pixels that a ball with a margin about it covers along an axis. @param x of its centre
CutView::PixelInterval CutView::CoveredPixels(
  double x, const NodeBall& ball, const Axis& axis, double margin) const
{
  double low, high;
  const double f = axis.Focal, c = axis.Center, size = axis.Size;
  const double a = f * x - std::abs(f) * ball.Radius, b = f * x + std::abs(f) * ball.Radius;
  if (this->Camera.Parallel)
  {
    low = a;
    high = b;
  }
  else
  {
    low = std::fmin(a / ball.Near(), a / ball.Far());
    high = std::fmax(b / ball.Near(), b / ball.Far());
  }
  // What is beyond the picture from the lens's centre may be in that of a cell.
  const double beyond = this->Cells > 1 ? FarBeyond : 0.0;
  const auto place = [&](double at) {
    return static_cast<int>(std::fmin(std::fmax(at, -beyond), size + beyond));
  };
  return { place(std::floor(low + c - margin)), place(std::ceil(high + c + margin)) };
}
}
