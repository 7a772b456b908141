// SPDX-License-Identifier: BSD-3-Clause
#include "SplatSetup.h"

#include <algorithm>
#include <cmath>

namespace SurfelSplatting
{
namespace
{
constexpr std::size_t SetupGrain = 4096;

/// Half of the z-range in standard deviations along z, and in those of the kernel's longest axis:
/// what neighbours of one surface may differ by where it is rough. Measured on ray-traced scenes,
/// which do not tell these from larger ones, and by eye on scans: with less, blurred slopes get
/// dark notches and depth images tear; with more, what lies on a surface merges with it.
constexpr double DepthExtentAlongZ = 2.0;
constexpr double DepthExtentIsotropic = 0.5;

/// Where weights ripple about 1, min(1, sum) loses the part above 1, and an opaque surface would be
/// slightly dark. The loss falls with the share of the footprint that lens and pixel filter have
/// smoothed, (h + V_I) / sqrt(det W) in [0, 1]: surfels below a pixel ripple no more and keep their
/// mass. It is left alone towards silhouettes, which a correction would make grow: 0.2 (1 - smooth)
/// cos^2(theta), measured against ray-traced scenes.
double RippleCompensation(double smooth, double cosine)
{
  return 1.0 / (1.0 - 0.2 * (1.0 - smooth) * cosine * cosine);
}

/// M S M' for the projection's Jacobian M, px^2.
Symmetric2 ProjectCovariance(const Symmetric3& s, const ProjectionJacobian& m)
{
  const Vector3 sx = s.Multiply(m.X);
  const Vector3 sy = s.Multiply(m.Y);
  return { std::fmax(0.0, Dot(m.X, sx)), std::fmax(0.0, Dot(m.Y, sy)), Dot(m.X, sy) };
}

/// First pixel whose centre is not left of x, clamped to [0, size] in floating point before it
/// becomes an integer.
int FirstPixel(double x, int size)
{
  return static_cast<int>(std::fmin(std::fmax(std::ceil(x - 0.5), 0.0), size));
}

bool Finite(const Vector3& v)
{
  return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]);
}

/// Whether |x| <= limit; false for NaN.
bool Within(float x, float limit)
{
  return std::abs(x) <= limit;
}

/// What the raster's float sums hold: 2^32 splats of weight 1e12 and colour 1e12, or depth 1e16,
/// stay below 3e38, so that no infinity arises that could become NaN under a transmittance of zero.
constexpr float LargestWeight = 1e12f, LargestColor = 1e12f, LargestDepth = 1e16f;
constexpr float LargestCoordinate = 1e30f; // px
constexpr float SmallestWeight =
  1e-20f; // 2^32 of them are invisible; e^-20 of it is not yet denormal

bool Representable(const Splat& s)
{
  return Within(s.X, LargestCoordinate) && Within(s.Y, LargestCoordinate) &&
    Within(s.K, LargestCoordinate) && Within(s.A, LargestCoordinate) &&
    Within(s.B, LargestCoordinate) && Within(s.Weight, LargestWeight) &&
    Within(s.Near, LargestDepth) && Within(s.Far, LargestDepth) && Within(s.DepthX, LargestDepth) &&
    Within(s.DepthY, LargestDepth) && std::isfinite(s.Red) && std::isfinite(s.Green) &&
    std::isfinite(s.Blue) && std::isfinite(s.Opacity);
}

/// To [0, high]; NaN and infinity stay what they are, to be found by Representable.
float Clamp(double x, double high)
{
  return static_cast<float>(std::isfinite(x) ? std::fmin(std::fmax(x, 0.0), high) : x);
}

void ShadeSplat(const SplatContext& context, const SurfelCloud& cloud, std::size_t surfel,
  const Vector3& position, const Vector3& area, double areaLength, bool backSide, Splat& splat)
{
  const std::array<double, 4> rgba = cloud.Color(surfel);
  const std::array<double, 3> color{ rgba[0], rgba[1], rgba[2] };
  std::array<double, 3> shaded = color;
  if (cloud.Surface.Lit)
  {
    const double sign = (backSide ? -1.0 : 1.0) / areaLength;
    const Vector3 normal{ area[0] * sign, area[1] * sign, area[2] * sign };
    Vector3 toViewer{ 0, 0, -1 };
    if (!context.Camera.Parallel)
    {
      const double inverse = -1.0 / Norm(position);
      toViewer = { position[0] * inverse, position[1] * inverse, position[2] * inverse };
    }
    const bool ownColor = cloud.ColorsUChar || cloud.ColorsFloat;
    shaded = Shade(cloud.Surface, context.Lights, color,
      ownColor ? color : cloud.Surface.AmbientColor, position, normal, toViewer);
  }
  splat.Red = Clamp(shaded[0], LargestColor);
  splat.Green = Clamp(shaded[1], LargestColor);
  splat.Blue = Clamp(shaded[2], LargestColor);
  splat.Opacity = Clamp(rgba[3], 1.0);
}

/// A surfel in camera space and the area that it deposits on the screen, px^2.
struct PlacedSurfel
{
  Vector3 Position, Area;
  Symmetric3 Covariance;
  double Deposit;
  bool BackSide; ///< it is seen from behind
};

/// @param reach squared radius of the kernel's support in standard deviations, 2c / tau
SplatStatus PlaceSurfel(double reach, const View& view, const SurfelCloud& cloud,
  const Affine3& localToCamera, const std::array<Vector3, 3>& areaToCamera, std::size_t surfel,
  PlacedSurfel& placed)
{
  const Vector3 local = cloud.Position(surfel);
  const Vector3 area = cloud.AreaVector(surfel);
  const Symmetric3 s = cloud.Covariance(surfel);
  if (!Finite(local) || !Finite(area) || !Finite({ s.XX, s.YY, s.ZZ }) ||
    !Finite({ s.XY, s.YZ, s.XZ }))
  {
    return SplatStatus::Invalid;
  }
  placed.Position = localToCamera.Apply(local);
  if (!(placed.Position[2] >= view.Near && placed.Position[2] <= view.Far))
  {
    return SplatStatus::Culled;
  }
  placed.Area = { Dot(areaToCamera[0], area), Dot(areaToCamera[1], area),
    Dot(areaToCamera[2], area) };
  placed.Deposit = ProjectedArea(view, placed.Area, placed.Position);
  placed.BackSide = placed.Deposit < 0.0;
  if (placed.BackSide && cloud.TwoSided && cloud.TwoSided[surfel])
  {
    placed.Deposit = -placed.Deposit;
  }
  placed.Covariance = localToCamera.ApplyToCovariance(s);
  // Where the kernel's support reaches the lens plane, its affine footprint is no image of it:
  // beside the lens it would cover the whole screen.
  const double z = placed.Position[2];
  if (!view.Parallel && z * z < reach * placed.Covariance.ZZ)
  {
    return SplatStatus::Culled;
  }
  return placed.Deposit > 0.0 ? SplatStatus::Visible : SplatStatus::Culled;
}

/// Cosine of the angle between a surfel's normal and its line of sight, either side, [0, 1].
double SightCosine(const View& view, const PlacedSurfel& surfel, double areaLength)
{
  const double along = view.Parallel
    ? std::abs(surfel.Area[2])
    : std::abs(Dot(surfel.Area, surfel.Position)) / Norm(surfel.Position);
  return std::fmin(1.0, along / areaLength);
}

/// Centre on the screen and the box of the kernel's support about it; false where it misses the
/// picture.
bool SetPlace(
  const View& view, const Vector3& p, const ResamplingKernel& kernel, Splat& splat, PixelBox& box)
{
  const double x = view.Parallel ? view.Fx * p[0] + view.Cx : view.Fx * p[0] / p[2] + view.Cx;
  const double y = view.Parallel ? view.Fy * p[1] + view.Cy : view.Fy * p[1] / p[2] + view.Cy;
  splat.X = static_cast<float>(x);
  splat.Y = static_cast<float>(y);
  box.X0 = FirstPixel(x - kernel.HalfWidth, view.Width);
  box.X1 = FirstPixel(x + kernel.HalfWidth, view.Width);
  box.Y0 = FirstPixel(y - kernel.HalfHeight, view.Height);
  box.Y1 = FirstPixel(y + kernel.HalfHeight, view.Height);
  return box.X0 < box.X1 && box.Y0 < box.Y1;
}

/// Depth, its z-range and its slope. The covariance of screen position and depth gives the depth's
/// regression over the footprint: the plane itself in focus, flat where blur, which knows no depth,
/// makes most of the footprint.
void SetDepth(
  const PlacedSurfel& surfel, const ProjectionJacobian& jacobian, const Footprint& w, Splat& splat)
{
  const Symmetric3& s = surfel.Covariance;
  const double z = surfel.Position[2];
  const double halfRange = DepthExtentAlongZ * std::sqrt(std::fmax(0.0, s.ZZ)) +
    DepthExtentIsotropic * std::sqrt(std::fmax(0.0, s.LargestEigenvalueOfRankTwo()));
  const Vector3 sz{ s.XZ, s.YZ, s.ZZ };
  const double cx = Dot(jacobian.X, sz), cy = Dot(jacobian.Y, sz);
  splat.Depth = static_cast<float>(z);
  splat.Near = static_cast<float>(z - halfRange);
  splat.Far = static_cast<float>(z + halfRange);
  splat.DepthX = static_cast<float>((w.YY * cx - w.XY * cy) / w.Determinant);
  splat.DepthY = static_cast<float>((w.XX * cy - w.XY * cx) / w.Determinant);
}
}

void SplatList::Clear()
{
  this->Splats.clear();
  this->Boxes.clear();
  this->NumberOfSurfels = 0;
  this->NumberOfInvalidSurfels = 0;
}

SplatStatus MakeSplat(const SplatContext& context, const TruncatedGaussian& gaussian,
  const SurfelCloud& cloud, const Affine3& localToCamera,
  const std::array<Vector3, 3>& areaToCamera, std::size_t surfel, Splat& splat, PixelBox& box)
{
  const View& view = context.Camera;
  PlacedSurfel placed;
  const SplatStatus status = PlaceSurfel(
    gaussian.Support() / gaussian.Tau, view, cloud, localToCamera, areaToCamera, surfel, placed);
  if (status != SplatStatus::Visible)
  {
    return status;
  }

  const Vector3& p = placed.Position;
  const ProjectionJacobian jacobian(view, p);
  const double relative = view.Parallel ? 0.0 : context.Optics.RelativeCircleOfConfusion(p[2]);
  const double confusion[2] = { std::abs(view.Fx) * relative, std::abs(view.Fy) * relative };
  const KernelType type = context.Settings.Kernel;
  const double h = context.Settings.Prefilter;
  const double variance[2] = { h + DefocusVariance(type, confusion[0], gaussian),
    h + DefocusVariance(type, confusion[1], gaussian) };
  const Footprint footprint(ProjectCovariance(placed.Covariance, jacobian), variance);
  const ResamplingKernel kernel = type == KernelType::PearsonII
    ? MakePearsonKernel(footprint, confusion[0] * confusion[1], gaussian)
    : MakeGaussianKernel(footprint, gaussian);
  if (!SetPlace(view, p, kernel, splat, box))
  {
    return SplatStatus::Culled;
  }

  const double areaLength = Norm(placed.Area);
  const double smooth =
    std::fmin(1.0, std::sqrt(variance[0] * variance[1] / footprint.Determinant));
  const double weight = placed.Deposit * kernel.Peak *
    RippleCompensation(smooth, SightCosine(view, placed, areaLength));
  if (!(weight >= SmallestWeight))
  {
    return std::isnan(weight) ? SplatStatus::Invalid : SplatStatus::Culled;
  }
  splat.A = static_cast<float>(kernel.A);
  splat.K = static_cast<float>(kernel.K);
  splat.B = static_cast<float>(kernel.B);
  splat.Weight = static_cast<float>(weight);
  splat.Shape = static_cast<float>(kernel.Shape);
  SetDepth(placed, jacobian, footprint, splat);
  ShadeSplat(context, cloud, surfel, p, placed.Area, areaLength, placed.BackSide, splat);
  return Representable(splat) ? SplatStatus::Visible : SplatStatus::Invalid;
}

void AppendSplats(
  const SplatContext& context, const SurfelCloud& cloud, const Executor& executor, SplatList& list)
{
  const Affine3 localToCamera = Affine3::Compose(context.Camera.WorldToCamera, cloud.LocalToWorld);
  const std::array<Vector3, 3> areaToCamera = localToCamera.AreaMatrix();
  const TruncatedGaussian gaussian(context.Settings.Cutoff);
  const std::size_t n = cloud.NumberOfSurfels;
  const std::size_t chunks = (n + SetupGrain - 1) / SetupGrain;

  // Every chunk writes into its own part; the parts are then joined in order, whatever thread made
  // them.
  std::vector<Splat> splats(n);
  std::vector<PixelBox> boxes(n);
  std::vector<std::size_t> counts(chunks, 0), invalid(chunks, 0);
  executor.For(chunks, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t chunk = begin; chunk < end; ++chunk)
    {
      std::size_t out = chunk * SetupGrain;
      const std::size_t last = std::min(n, out + SetupGrain);
      for (std::size_t i = out; i < last; ++i)
      {
        const SplatStatus status = MakeSplat(
          context, gaussian, cloud, localToCamera, areaToCamera, i, splats[out], boxes[out]);
        out += status == SplatStatus::Visible ? 1 : 0;
        invalid[chunk] += status == SplatStatus::Invalid ? 1 : 0;
      }
      counts[chunk] = out - chunk * SetupGrain;
    }
  });

  std::size_t total = list.Splats.size();
  std::vector<std::size_t> offsets(chunks);
  for (std::size_t chunk = 0; chunk < chunks; ++chunk)
  {
    offsets[chunk] = total;
    total += counts[chunk];
    list.NumberOfInvalidSurfels += invalid[chunk];
  }
  list.NumberOfSurfels += n;
  list.Splats.resize(total);
  list.Boxes.resize(total);
  executor.For(chunks, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t chunk = begin; chunk < end; ++chunk)
    {
      const std::size_t first = chunk * SetupGrain;
      std::copy_n(splats.begin() + first, counts[chunk], list.Splats.begin() + offsets[chunk]);
      std::copy_n(boxes.begin() + first, counts[chunk], list.Boxes.begin() + offsets[chunk]);
    }
  });
}
}
