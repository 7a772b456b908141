// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Splats/SplatSetup.h"

#include "Core/Base/CoarseLevels.h"
#include "Core/Splats/SetupConstants.h"

#include <algorithm>
#include <cmath>

namespace SurfelSplatting
{
namespace
{
/// See RippleLoss.
double RippleCompensation(double smooth, double cosine)
{
  return 1.0 / (1.0 - RippleLoss * (1.0 - smooth) * cosine * cosine);
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

/// Light that a surfel sends to the lens: Base + Share * colour, channel by channel.
struct Shading
{
  std::array<double, 3> Base{ { 0, 0, 0 } };
  std::array<double, 3> Share{ { 1, 1, 1 } };
};

/// Shading is affine in the surfel's own colour, which so keeps a gradient.
Shading MakeShading(const SplatContext& context, const SurfelCloud& cloud, const Vector3& position,
  const Vector3& area, double areaLength, bool backSide)
{
  Shading shading;
  if (!cloud.Surface.Lit || context.Colors != Paint::Own)
  {
    return shading;
  }
  const double sign = (backSide ? -1.0 : 1.0) / areaLength;
  const Vector3 normal{ area[0] * sign, area[1] * sign, area[2] * sign };
  Vector3 toViewer{ 0, 0, -1 };
  if (!context.Camera.Parallel)
  {
    const double inverse = -1.0 / Norm(position);
    toViewer = { position[0] * inverse, position[1] * inverse, position[2] * inverse };
  }
  const bool ownColor = cloud.ColorsUChar || cloud.ColorsFloat;
  const std::array<double, 3> black{ { 0, 0, 0 } }, white{ { 1, 1, 1 } };
  const std::array<double, 3>& ambient = cloud.Surface.AmbientColor;
  shading.Base = Shade(
    cloud.Surface, context.Lights, black, ownColor ? black : ambient, position, normal, toViewer);
  const std::array<double, 3> lit = Shade(
    cloud.Surface, context.Lights, white, ownColor ? white : ambient, position, normal, toViewer);
  for (int c = 0; c < 3; ++c)
  {
    shading.Share[c] = lit[c] - shading.Base[c];
  }
  return shading;
}

/// Colours told apart at a glance, from the finest level on; they repeat (the paper's figure 5).
std::array<double, 3> LevelColor(int level)
{
  static constexpr double colors[8][3] = { { 0.85, 0.85, 0.85 }, { 0.30, 0.55, 0.95 },
    { 0.20, 0.75, 0.45 }, { 0.95, 0.85, 0.25 }, { 0.95, 0.55, 0.20 }, { 0.85, 0.25, 0.25 },
    { 0.70, 0.35, 0.80 }, { 0.45, 0.30, 0.20 } };
  const double* c = colors[level % 8];
  return { c[0], c[1], c[2] };
}

void SetColor(const std::array<double, 4>& color, const Shading& shading, Splat& splat)
{
  splat.Red = Clamp(shading.Base[0] + shading.Share[0] * color[0], LargestColor);
  splat.Green = Clamp(shading.Base[1] + shading.Share[1] * color[1], LargestColor);
  splat.Blue = Clamp(shading.Base[2] + shading.Share[2] * color[2], LargestColor);
  splat.Opacity = Clamp(color[3], 1.0);
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
SplatStatus PlaceSurfel(double reach, const View& view, const PlacedCloud& source,
  std::size_t surfel, PlacedSurfel& placed)
{
  const SurfelCloud& cloud = source.Cloud;
  const Vector3 local = cloud.Position(surfel);
  const Vector3 area = cloud.AreaVector(surfel);
  const Symmetric3 s = cloud.Covariance(surfel);
  if (!Finite(local) || !Finite(area) || !Finite({ s.XX, s.YY, s.ZZ }) ||
    !Finite({ s.XY, s.YZ, s.XZ }))
  {
    return SplatStatus::Invalid;
  }
  placed.Position = source.LocalToCamera.Apply(local);
  if (!(placed.Position[2] >= view.Near && placed.Position[2] <= view.Far))
  {
    return SplatStatus::Culled;
  }
  placed.Area = { Dot(source.AreaToCamera[0], area), Dot(source.AreaToCamera[1], area),
    Dot(source.AreaToCamera[2], area) };
  placed.Deposit = ProjectedArea(view, placed.Area, placed.Position);
  placed.BackSide = placed.Deposit < 0.0;
  if (placed.BackSide && cloud.IsTwoSided(surfel))
  {
    placed.Deposit = -placed.Deposit;
  }
  placed.Covariance = source.LocalToCamera.ApplyToCovariance(s);
  // Where the kernel's support reaches the lens plane, its affine footprint is no image of it:
  // beside the lens it would cover the whole screen.
  const double z = placed.Position[2];
  if (!view.Parallel && z * z < reach * placed.Covariance.ZZ)
  {
    return SplatStatus::Culled;
  }
  return placed.Deposit > 0.0 ? SplatStatus::Visible : SplatStatus::Culled;
}

/// Normals are covectors: the transpose takes them from the camera to the world.
std::array<double, 3> NormalColor(const View& view, const PlacedSurfel& surfel)
{
  const auto& l = view.WorldToCamera.L;
  const double sign = surfel.BackSide ? -1.0 : 1.0;
  Vector3 n;
  for (int i = 0; i < 3; ++i)
  {
    n[i] = sign * (l[0][i] * surfel.Area[0] + l[1][i] * surfel.Area[1] + l[2][i] * surfel.Area[2]);
  }
  const double half = 0.5 / Norm(n);
  return { 0.5 + half * n[0], 0.5 + half * n[1], 0.5 + half * n[2] };
}

std::array<double, 4> ColorOf(const SplatContext& context, const SurfelCloud& cloud,
  std::size_t index, int level, const PlacedSurfel& surfel)
{
  const std::array<double, 4> color = cloud.Color(index);
  std::array<double, 3> paint{ color[0], color[1], color[2] };
  switch (context.Colors)
  {
    case Paint::Own:
      break;
    case Paint::LevelColors:
      paint = LevelColor(level);
      break;
    case Paint::LevelNumbers:
      paint = { level / LargestPaintedLevel, 0.0, 0.0 };
      break;
    case Paint::Normals:
      paint = NormalColor(context.Camera, surfel);
      break;
  }
  return { paint[0], paint[1], paint[2], color[3] };
}

/// Cosine of the angle between a surfel's normal and its line of sight, either side, [0, 1].
double SightCosine(const View& view, const PlacedSurfel& surfel, double areaLength)
{
  const double along = view.Parallel
    ? std::abs(surfel.Area[2])
    : std::abs(Dot(surfel.Area, surfel.Position)) / Norm(surfel.Position);
  return std::fmin(1.0, along / areaLength);
}

/// What lens, pixel and level of detail make of a surfel's footprint.
struct Blur
{
  double Confusion[2]; ///< C in x and y, px
  double Variance[2];  ///< isotropic part of W, px^2
  double Offset[2];    ///< of the blur's centre from the surfel's, px
};

/// Centre on the screen or on a coarse grid, that of the blur, and the box of the kernel's support
/// about it; false where it misses the picture.
bool SetPlace(const View& view, const Vector3& p, const Blur& blur, const ResamplingKernel& kernel,
  int gridLevel, Splat& splat, PixelBox& box)
{
  const double depth = view.Parallel ? 1.0 : p[2];
  double x = view.Fx * p[0] / depth + view.Cx + blur.Offset[0];
  double y = view.Fy * p[1] / depth + view.Cy + blur.Offset[1];
  int width = view.Width, height = view.Height;
  double scale = 1.0;
  if (gridLevel > 0)
  {
    const int cell = 1 << gridLevel;
    scale = 1.0 / cell;
    x = scale * x + CoarseOrigin;
    y = scale * y + CoarseOrigin;
    width = CoarseSize(width, cell);
    height = CoarseSize(height, cell);
  }
  splat.X = static_cast<float>(x);
  splat.Y = static_cast<float>(y);
  box.X0 = FirstPixel(x - scale * kernel.HalfWidth, width);
  box.X1 = FirstPixel(x + scale * kernel.HalfWidth, width);
  box.Y0 = FirstPixel(y - scale * kernel.HalfHeight, height);
  box.Y1 = FirstPixel(y + scale * kernel.HalfHeight, height);
  return !IsEmpty(box);
}

/// A splat's lengths from px to cells of a coarse grid.
void ScaleToGrid(int gridLevel, SplatRecord& record)
{
  const float d = static_cast<float>(1 << gridLevel);
  Splat& s = record.S;
  s.A *= d * d;
  s.B *= d * d;
  s.DepthX *= d;
  s.DepthY *= d;
  SplatGradient& g = record.Gradient;
  for (float* x : { &record.Slope.Point, &record.Slope.TiltX, &record.Slope.TiltY })
  {
    *x *= d;
  }
  if (s.Gradient != NoGradient)
  {
    for (float* x : { &g.RedX, &g.GreenX, &g.BlueX, &g.RedY, &g.GreenY, &g.BlueY })
    {
      *x *= d;
    }
  }
}

/// Depth, its z-range and its slope. The covariance of screen position and depth gives the depth's
/// regression over the footprint: the plane itself in focus, flat where blur, which knows no depth,
/// makes most of the footprint. A z-buffer, which compares fragments, takes the plane.
void SetDepth(const PlacedSurfel& surfel, const ProjectionJacobian& jacobian, const Footprint& full,
  bool depthBuffered, Splat& splat)
{
  Footprint w = full;
  if (depthBuffered)
  {
    const Symmetric2 plane = ProjectCovariance(surfel.Covariance, jacobian);
    const double determinant = plane.XX * plane.YY - plane.XY * plane.XY;
    if (determinant > LeastPlane * plane.XX * plane.YY)
    {
      w.XX = plane.XX;
      w.YY = plane.YY;
      w.Determinant = determinant;
    }
  }
  const Symmetric3& s = surfel.Covariance;
  const double z = surfel.Position[2];
  const double halfRange = DepthExtentAlongZ * std::sqrt(std::fmax(0.0, s.ZZ)) +
    DepthExtentIsotropic * std::sqrt(std::fmax(0.0, s.LargestEigenvalueOfRankTwo()));
  const Vector3 sz{ s.XZ, s.YZ, s.ZZ };
  const double cx = Dot(jacobian.X, sz), cy = Dot(jacobian.Y, sz);
  splat.Near = static_cast<float>(z - halfRange);
  splat.Far = static_cast<float>(z + halfRange);
  splat.DepthX = static_cast<float>((w.YY * cx - w.XY * cy) / w.Determinant);
  splat.DepthY = static_cast<float>((w.XX * cy - w.XY * cx) / w.Determinant);
}

Blur MakeBlur(const SplatContext& context, const TruncatedGaussian& gaussian,
  const PlacedSurfel& surfel, double areaLength, int level)
{
  const View& view = context.Camera;
  const double z = surfel.Position[2];
  const double f[2] = { std::abs(view.Fx), std::abs(view.Fy) };
  const double relative = view.Parallel || context.Optics.Radius == 0.0
    ? 0.0
    : context.Optics.RelativeCircleOfConfusion(z);
  // The paper's kernel has no such offset; sectors weigh the two sides of the lens instead.
  const bool offset =
    relative > 0.0 && context.Settings.Kernel != KernelType::Gaussian && !context.Sectors;
  const std::array<double, 2> relativeOffset = offset
    ? context.Optics.RelativeBlurOffset(surfel.Area, surfel.Position)
    : std::array<double, 2>{ { 0.0, 0.0 } };
  Blur blur;
  blur.Offset[0] = view.Fx * relativeOffset[0];
  blur.Offset[1] = view.Fy * relativeOffset[1];
  for (int i = 0; i < 2; ++i)
  {
    blur.Confusion[i] = f[i] * relative;
    blur.Variance[i] = context.Settings.Prefilter;
    if (relative > 0.0)
    {
      blur.Variance[i] += DefocusVariance(context.Settings.Kernel, blur.Confusion[i], gaussian);
    }
    if (level > 0)
    {
      const double pixels = LeastNodeBlur * (view.Parallel ? f[i] : f[i] / z);
      blur.Variance[i] = std::fmax(blur.Variance[i], pixels * pixels * areaLength);
    }
  }
  return blur;
}

/**
 * Variance matrix of the smallest ellipse about two others with the same centre (Krivanek and Zara
 * 2003, DC-TR-2003): both diagonal in the axes of the generalised eigenproblem A x = l B x, the
 * larger is taken in each. B is diagonal here: V_I.
 */
Symmetric2 Circumellipse(const Symmetric2& a, const double b[2])
{
  // In the coordinates where B is the identity, A' = B^-1/2 A B^-1/2 = R diag(l) R'.
  const double x = a.XX / b[0], y = a.YY / b[1], xy = a.XY / std::sqrt(b[0] * b[1]);
  const double mean = 0.5 * (x + y), half = 0.5 * (x - y);
  const double radius = std::hypot(half, xy);
  const double low = std::fmax(1.0, mean - radius), high = std::fmax(1.0, mean + radius);
  const double cosine = radius > 0.0 ? half / radius : 1.0; // of twice the angle
  const double sine = radius > 0.0 ? xy / radius : 0.0;
  const double m = 0.5 * (low + high), d = 0.5 * (high - low);
  return { (m + d * cosine) * b[0], (m - d * cosine) * b[1], d * sine * std::sqrt(b[0] * b[1]) };
}

/// W of a node as in the paper: M V_r M' + h + V_diff, V_diff = circumellipse(M V_q M', V_I).
Footprint PaperFootprint(const SplatContext& context, const TruncatedGaussian& gaussian,
  const PlacedCloud& cloud, std::size_t surfel, const PlacedSurfel& placed,
  const ProjectionJacobian& jacobian, const Blur& blur)
{
  const Symmetric3 leaf = cloud.LocalToCamera.ApplyToCovariance(cloud.Cloud.LeafCovariance(surfel));
  const Symmetric2 all = ProjectCovariance(placed.Covariance, jacobian);
  const Symmetric2 reconstruction = ProjectCovariance(leaf, jacobian);
  const Symmetric2 level{ std::fmax(0.0, all.XX - reconstruction.XX),
    std::fmax(0.0, all.YY - reconstruction.YY), all.XY - reconstruction.XY };
  const double h = context.Settings.Prefilter;
  double lens[2];
  for (int i = 0; i < 2; ++i)
  {
    // A pinhole's V_I is 0: a millionth of the pixel keeps the eigenproblem regular.
    lens[i] =
      std::fmax(1e-6 * h, DefocusVariance(context.Settings.Kernel, blur.Confusion[i], gaussian));
  }
  const Symmetric2 difference = Circumellipse(level, lens);
  const double variance[2] = { h, h };
  return Footprint({ reconstruction.XX + difference.XX, reconstruction.YY + difference.YY,
                     reconstruction.XY + difference.XY },
    variance);
}

/// The colour's first moment on the screen, W^-1 M H', as the raster takes it.
SplatGradient MakeGradient(const PlacedCloud& cloud, std::size_t surfel,
  const ProjectionJacobian& jacobian, const Footprint& w, const Shading& shading, double tilt)
{
  const ColorMoments moments =
    UnpackColor(cloud.Cloud.NodeColors[surfel - cloud.Cloud.NumberOfSurfels]);
  float x[3], y[3];
  for (int c = 0; c < 3; ++c)
  {
    const double* h = moments.First[c];
    const Vector3 moment = cloud.LocalToCamera.ApplyLinear({ h[0], h[1], h[2] });
    const double hx = Dot(jacobian.X, moment), hy = Dot(jacobian.Y, moment);
    const double scale = shading.Share[c] * tilt / w.Determinant;
    x[c] = static_cast<float>(scale * (w.YY * hx - w.XY * hy));
    y[c] = static_cast<float>(scale * (w.XX * hy - w.XY * hx));
  }
  return { x[0], x[1], x[2], y[0], y[1], y[2] };
}

bool Representable(const SplatGradient& g)
{
  return Within(g.RedX, LargestColor) && Within(g.GreenX, LargestColor) &&
    Within(g.BlueX, LargestColor) && Within(g.RedY, LargestColor) &&
    Within(g.GreenY, LargestColor) && Within(g.BlueY, LargestColor);
}

/// For sectors of the lens; all 0 in focus.
LensSlope MakeSlope(const SplatContext& context, const PlacedSurfel& surfel, const Footprint& w)
{
  if (!context.Sectors || context.Camera.Parallel || context.Optics.Radius == 0.0)
  {
    return { 0.0f, 0.0f, 0.0f };
  }
  const Lens& lens = context.Optics;
  const std::array<double, 2> mean = lens.MeanApertureSample(surfel.Area, surfel.Position);
  const double confusion = std::sqrt(std::abs(context.Camera.Fx * context.Camera.Fy)) *
    lens.Radius * (1.0 / lens.FocalDistance - 1.0 / surfel.Position[2]);
  const double point = confusion / (4.0 * std::sqrt(w.Determinant));
  return { static_cast<float>(point), static_cast<float>(4.0 * mean[0] * point),
    static_cast<float>(4.0 * mean[1] * point) };
}

ResamplingKernel ChooseKernel(const SplatSettings& settings, const Footprint& w,
  double squaredConfusion, bool tilted, const TruncatedGaussian& gaussian)
{
  if (settings.Kernel == KernelType::Gaussian || squaredConfusion == 0.0)
  {
    return MakeGaussianKernel(w, gaussian);
  }
  if (tilted)
  {
    const double exponent = PearsonExponent(w, squaredConfusion);
    if (exponent < LargestSmoothExponent)
    {
      return MakeSmoothKernel(w, exponent, gaussian);
    }
  }
  return MakePearsonKernel(w, squaredConfusion, gaussian);
}

/// The coarse grid of a splat (CoarseGrid.h). Where the kernel's border would be too narrow for it
/// (GridCellsPerDeviation), the grid is made finer once. A node whose gradient, which is at work in
/// that border, needs a finer grid yet is small against the blur and does without its gradient.
/// @param squaredConfusion of the disc in the kernel's shape, px^2: less where LeastSoftness asks
int ChooseGrid(const Footprint& w, const Blur& blur, bool& tilted, double& squaredConfusion)
{
  const double smallest = w.SmallestEigenvalue();
  int level = CoarseLevel(smallest);
  const double confusion = std::fmax(blur.Confusion[0], blur.Confusion[1]);
  const double sharp = std::sqrt(std::fmax(0.0, smallest - 0.25 * confusion * confusion));
  const double cell = 1 << level;
  if (level > 0 && !(cell <= GridCellsPerDeviation * sharp))
  {
    tilted = tilted && 0.5 * cell <= GridCellsPerDeviation * sharp;
    level = level > LowestCoarseLevel ? level - 1 : 0;
  }
  if (level > 0)
  {
    const double softness = LeastSoftness * (1 << level);
    squaredConfusion = std::fmin(squaredConfusion, 4.0 * (smallest - softness * softness));
  }
  return level;
}
}

SplatStatus MakeSplat(const SplatContext& context, const TruncatedGaussian& gaussian,
  const PlacedCloud& cloud, std::size_t surfel, int level, SplatRecord& record)
{
  const View& view = context.Camera;
  PlacedSurfel placed;
  const SplatStatus status =
    PlaceSurfel(gaussian.Support() / gaussian.Tau, view, cloud, surfel, placed);
  if (status != SplatStatus::Visible)
  {
    return status;
  }

  const Vector3& p = placed.Position;
  const double areaLength = Norm(placed.Area);
  const ProjectionJacobian jacobian(view, p);
  const bool paper = level > 0 && context.Cut.Rule == CutRule::Paper;
  bool tilted = level > 0 && !paper && cloud.Cloud.NodeColors && context.Colors == Paint::Own;
  const Blur blur = MakeBlur(context, gaussian, placed, areaLength, level);
  const Footprint full = paper
    ? PaperFootprint(context, gaussian, cloud, surfel, placed, jacobian, blur)
    : Footprint(ProjectCovariance(placed.Covariance, jacobian), blur.Variance);
  double squaredConfusion = blur.Confusion[0] * blur.Confusion[1];
  const int gridLevel = context.CoarseGrids ? ChooseGrid(full, blur, tilted, squaredConfusion) : 0;
  const double cell = 1 << gridLevel;
  const Footprint footprint = gridLevel > 0 ? full.Without(cell * cell / 6.0) : full;
  const ResamplingKernel kernel =
    ChooseKernel(context.Settings, footprint, squaredConfusion, tilted, gaussian);
  Splat& splat = record.S;
  record.GridLevel = gridLevel;
  record.Blurred = blur.Confusion[0] > 0.0;
  if (!SetPlace(view, p, blur, kernel, gridLevel, splat, record.Box))
  {
    return SplatStatus::Culled;
  }

  const double smooth =
    std::fmin(1.0, std::sqrt(blur.Variance[0] * blur.Variance[1] / full.Determinant));
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
  SetDepth(placed, jacobian, footprint, context.DepthBuffered, splat);

  const Shading shading =
    MakeShading(context, cloud.Cloud, p, placed.Area, areaLength, placed.BackSide);
  SetColor(ColorOf(context, cloud.Cloud, surfel, level, placed), shading, splat);
  record.Slope = MakeSlope(context, placed, footprint);
  splat.Gradient = NoGradient;
  if (tilted)
  {
    record.Gradient = MakeGradient(cloud, surfel, jacobian, footprint, shading, kernel.Tilt);
    splat.Gradient = Representable(record.Gradient) ? 0 : NoGradient;
  }
  if (gridLevel > 0)
  {
    ScaleToGrid(gridLevel, record);
  }
  return Representable(splat) ? SplatStatus::Visible : SplatStatus::Invalid;
}
}
