// SPDX-License-Identifier: BSD-3-Clause
#include "SplatSetup.h"

#include <algorithm>
#include <cmath>

namespace SurfelSplatting
{
namespace
{
constexpr std::size_t SetupGrain = 4096;

/// Half of the z-range in standard deviations along z, in focus and strongly blurred, and in those of the kernel's
/// longest axis: 2 * 0.75 s is what neighbours of one surface differ by where it is rough. Measured (design notes):
/// too small tears surfaces apart, too large merges what lies behind.
struct DepthExtent
{
  double AlongZ, Isotropic;

  /// @param blur share of the footprint that is the lens's, [0, 1)
  explicit DepthExtent(double blur)
    : AlongZ(1.5 - 0.5 * blur)
    , Isotropic(0.75 - 0.65 * blur)
  {
  }
};

/// Where weights ripple about 1, min(1, sum) loses the part above 1 and an opaque surface in focus would be slightly
/// dark. Measured loss at sigma = spacing / 2, falling with blur and towards silhouettes (where a correction would make
/// them grow): 0.2 (1 - blur) cos^2(theta).
double RippleCompensation(double blur, double cosine)
{
  return 1.0 / (1.0 - 0.2 * (1.0 - blur) * cosine * cosine);
}

/// N S N' for the projection's Jacobian in local coordinates, px^2.
Symmetric2 ProjectCovariance(const Symmetric3& s, const Vector3& nx, const Vector3& ny)
{
  const Vector3 sx = s.Multiply(nx);
  const Vector3 sy = s.Multiply(ny);
  return { std::fmax(0.0, Dot(nx, sx)), std::fmax(0.0, Dot(ny, sy)), Dot(nx, sy) };
}

/// Row of the Jacobian times the linear part of local-to-camera.
Vector3 RowTimes(const Vector3& row, const Affine3& m)
{
  Vector3 r;
  for (int j = 0; j < 3; ++j)
  {
    r[j] = row[0] * m.L[0][j] + row[1] * m.L[1][j] + row[2] * m.L[2][j];
  }
  return r;
}

/// First pixel whose centre is not left of x, clamped to [0, size] in floating point before it becomes an integer.
int FirstPixel(double x, int size)
{
  return static_cast<int>(std::fmin(std::fmax(std::ceil(x - 0.5), 0.0), size));
}

bool Finite(const Vector3& v)
{
  return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]);
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
  splat.Red = static_cast<float>(shaded[0]);
  splat.Green = static_cast<float>(shaded[1]);
  splat.Blue = static_cast<float>(shaded[2]);
  splat.Opacity = static_cast<float>(std::fmin(std::fmax(rgba[3], 0.0), 1.0));
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
  const Vector3 local = cloud.Position(surfel);
  const Vector3 localArea = cloud.AreaVector(surfel);
  const Symmetric3 s = cloud.Covariance(surfel);
  if (!Finite(local) || !Finite(localArea) || !Finite({ s.XX, s.YY, s.ZZ }) ||
    !Finite({ s.XY, s.YZ, s.XZ }))
  {
    return SplatStatus::Invalid;
  }
  const Vector3 p = localToCamera.Apply(local);
  if (!(p[2] >= view.Near && p[2] <= view.Far))
  {
    return SplatStatus::Culled;
  }
  const Vector3 area{ Dot(areaToCamera[0], localArea), Dot(areaToCamera[1], localArea),
    Dot(areaToCamera[2], localArea) };
  double deposit = ProjectedArea(view, area, p);
  const bool backSide = deposit < 0.0;
  if (backSide && cloud.TwoSided && cloud.TwoSided[surfel])
  {
    deposit = -deposit;
  }
  if (!(deposit > 0.0))
  {
    return SplatStatus::Culled;
  }

  const ProjectionJacobian jacobian(view, p);
  const Vector3 nx = RowTimes(jacobian.X, localToCamera);
  const Vector3 ny = RowTimes(jacobian.Y, localToCamera);
  const Symmetric2 projected = ProjectCovariance(s, nx, ny);
  const double relative =
    view.Parallel ? 0.0 : context.Optics.RelativeCircleOfConfusion(p[2]);
  const double defocus[2] = { DefocusVariance(view.Fx * relative, gaussian),
    DefocusVariance(view.Fy * relative, gaussian) };
  const double variance[2] = { context.Settings.Prefilter + defocus[0],
    context.Settings.Prefilter + defocus[1] };
  const ResamplingKernel kernel = MakeResamplingKernel(projected, variance, gaussian);

  const double x = view.Parallel ? view.Fx * p[0] + view.Cx : view.Fx * p[0] / p[2] + view.Cx;
  const double y = view.Parallel ? view.Fy * p[1] + view.Cy : view.Fy * p[1] / p[2] + view.Cy;
  box.X0 = FirstPixel(x - kernel.HalfWidth, view.Width);
  box.X1 = FirstPixel(x + kernel.HalfWidth, view.Width);
  box.Y0 = FirstPixel(y - kernel.HalfHeight, view.Height);
  box.Y1 = FirstPixel(y + kernel.HalfHeight, view.Height);
  if (box.X0 >= box.X1 || box.Y0 >= box.Y1)
  {
    return SplatStatus::Culled;
  }

  const double areaLength = Norm(area);
  const double cosine = std::fmin(1.0,
    view.Parallel ? std::abs(area[2]) / areaLength
                  : std::abs(Dot(area, p)) / (areaLength * Norm(p)));
  const double blur =
    std::fmin(1.0, std::sqrt(defocus[0] * defocus[1] / kernel.Determinant));
  const double weight = deposit * kernel.Peak * RippleCompensation(blur, cosine);
  if (!std::isfinite(weight) || !(weight > 0.0))
  {
    return std::isfinite(weight) ? SplatStatus::Culled : SplatStatus::Invalid;
  }

  // Covariance of screen position and depth gives the depth's regression over the footprint: the plane itself in focus,
  // flat where blur, which knows no depth, makes most of the footprint.
  const Vector3 szLocal = s.Multiply(localToCamera.L[2]);
  const double varianceZ = std::fmax(0.0, Dot(localToCamera.L[2], szLocal));
  const double cx = Dot(nx, szLocal), cy = Dot(ny, szLocal);
  const double wxx = projected.XX + variance[0], wyy = projected.YY + variance[1];

  const DepthExtent extent(blur);
  const double scale = std::cbrt(std::abs(localToCamera.Determinant()));
  const double halfRange = extent.AlongZ * std::sqrt(varianceZ) +
    extent.Isotropic * scale * std::sqrt(s.LargestEigenvalueOfRankTwo());

  splat.X = static_cast<float>(x);
  splat.Y = static_cast<float>(y);
  splat.A = static_cast<float>(kernel.A);
  splat.K = static_cast<float>(kernel.K);
  splat.B = static_cast<float>(kernel.B);
  splat.Weight = static_cast<float>(weight);
  splat.Near = static_cast<float>(p[2] - halfRange);
  splat.Far = static_cast<float>(p[2] + halfRange);
  splat.Depth = static_cast<float>(p[2]);
  splat.DepthX = static_cast<float>((wyy * cx - projected.XY * cy) / kernel.Determinant);
  splat.DepthY = static_cast<float>((wxx * cy - projected.XY * cx) / kernel.Determinant);
  splat.HalfHeight = static_cast<float>(kernel.HalfHeight);
  ShadeSplat(context, cloud, surfel, p, area, areaLength, backSide, splat);
  const bool finite = std::isfinite(splat.Red) && std::isfinite(splat.Green) &&
    std::isfinite(splat.Blue) && std::isfinite(splat.Opacity) && std::isfinite(splat.Near) &&
    std::isfinite(splat.Far);
  return finite ? SplatStatus::Visible : SplatStatus::Invalid;
}

void AppendSplats(const SplatContext& context, const SurfelCloud& cloud, const Executor& executor,
  SplatList& list)
{
  const Affine3 localToCamera = Affine3::Compose(context.Camera.WorldToCamera, cloud.LocalToWorld);
  const std::array<Vector3, 3> areaToCamera = localToCamera.AreaMatrix();
  const TruncatedGaussian gaussian(context.Settings.Cutoff);
  const std::size_t n = cloud.NumberOfSurfels;
  const std::size_t chunks = (n + SetupGrain - 1) / SetupGrain;

  // Every chunk writes into its own part; the parts are then joined in order, whatever thread made them.
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
