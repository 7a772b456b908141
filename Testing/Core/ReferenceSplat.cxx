// SPDX-License-Identifier: BSD-3-Clause
#include "ReferenceSplat.h"

#include "TestScene.h"

#include <algorithm>
#include <cmath>

namespace SurfelSplatting
{
namespace
{
constexpr double Pi = 3.14159265358979324;

/// Symmetric and general 3x3 matrices as nested arrays: nothing of Geometry.h's shortcuts.
using Matrix3 = std::array<Vector3, 3>;

Matrix3 Multiply(const Matrix3& a, const Matrix3& b)
{
  Matrix3 c{};
  for (int i = 0; i < 3; ++i)
  {
    for (int j = 0; j < 3; ++j)
    {
      for (int k = 0; k < 3; ++k)
      {
        c[i][j] += a[i][k] * b[k][j];
      }
    }
  }
  return c;
}

Matrix3 Transpose(const Matrix3& a)
{
  Matrix3 t;
  for (int i = 0; i < 3; ++i)
  {
    for (int j = 0; j < 3; ++j)
    {
      t[i][j] = a[j][i];
    }
  }
  return t;
}

Vector3 Multiply(const Matrix3& a, const Vector3& v)
{
  return { Dot(a[0], v), Dot(a[1], v), Dot(a[2], v) };
}

/// A surfel in camera space.
struct CameraSurfel
{
  Vector3 Position;
  Matrix3 Covariance;
  Vector3 AreaU, AreaV; ///< their cross product is the area vector, up to its sign
  Vector3 Area;
};

CameraSurfel ToCamera(const View& view, const SurfelCloud& cloud, std::size_t i)
{
  const Matrix3& l = cloud.LocalToWorld.L;
  const Matrix3& c = view.WorldToCamera.L;
  const Matrix3 m = Multiply(c, l);
  Vector3 world = Multiply(l, cloud.Position(i));
  for (int k = 0; k < 3; ++k)
  {
    world[k] += cloud.LocalToWorld.T[k];
  }
  CameraSurfel s;
  s.Position = Multiply(c, world);
  for (int k = 0; k < 3; ++k)
  {
    s.Position[k] += view.WorldToCamera.T[k];
  }
  const float* v = cloud.Covariances + 6 * i;
  const Matrix3 local{ { { v[0], v[3], v[5] }, { v[3], v[1], v[4] }, { v[5], v[4], v[2] } } };
  s.Covariance = Multiply(Multiply(m, local), Transpose(m));

  // The area vector as a parallelogram's, whose sides transform like any displacement.
  const Vector3 area = cloud.AreaVector(i);
  const double length = Norm(area);
  const Vector3 normal{ area[0] / length, area[1] / length, area[2] / length };
  Vector3 tu, tv;
  Tangents(normal, tu, tv);
  for (double& x : tu)
  {
    x *= length;
  }
  s.AreaU = Multiply(m, tu);
  s.AreaV = Multiply(m, tv);
  s.Area = Cross(s.AreaU, s.AreaV);
  const bool mirrored = Dot(m[0], Cross(m[1], m[2])) < 0.0;
  if (mirrored)
  {
    s.Area = { -s.Area[0], -s.Area[1], -s.Area[2] };
  }
  return s;
}

void Jacobian(const View& view, const Vector3& p, Vector3 rows[2])
{
  const double z = p[2];
  rows[0] =
    view.Parallel ? Vector3{ view.Fx, 0, 0 } : Vector3{ view.Fx / z, 0, -view.Fx * p[0] / (z * z) };
  rows[1] =
    view.Parallel ? Vector3{ 0, view.Fy, 0 } : Vector3{ 0, view.Fy / z, -view.Fy * p[1] / (z * z) };
}

double LargestEigenvalue(const Matrix3& m)
{
  // Power iteration on the matrix itself: positive semi-definite.
  Vector3 v{ 0.57, 0.61, 0.55 };
  double lambda = 0.0;
  for (int i = 0; i < 2000; ++i)
  {
    const Vector3 next = Multiply(m, v);
    lambda = Norm(next) / Norm(v);
    if (lambda == 0.0)
    {
      return 0.0;
    }
    v = next;
    for (double& x : v)
    {
      x /= lambda;
    }
  }
  return lambda;
}

void ReferenceColor(const SplatContext& context, const SurfelCloud& cloud, std::size_t i,
  const CameraSurfel& s, bool back, ReferenceSplat& splat)
{
  const std::array<double, 4> rgba = cloud.Color(i);
  const std::array<double, 3> color{ rgba[0], rgba[1], rgba[2] };
  const bool own = cloud.ColorsFloat || cloud.ColorsUChar;
  Vector3 normal = s.Area, toViewer{ 0, 0, -1 };
  const double length = (back ? -1.0 : 1.0) * Norm(s.Area);
  for (int k = 0; k < 3; ++k)
  {
    normal[k] /= length;
    toViewer[k] = context.Camera.Parallel ? toViewer[k] : -s.Position[k] / Norm(s.Position);
  }
  const std::array<double, 3> shaded = Shade(cloud.Surface, context.Lights, color,
    own ? color : cloud.Surface.AmbientColor, s.Position, normal, toViewer);
  std::copy(shaded.begin(), shaded.end(), splat.Color);
  splat.Opacity = std::clamp(rgba[3], 0.0, 1.0);
}

/// Depth range, order and slope: extended depth test of ABuffer.h, with the values of
/// DepthExtentAlongZ, DepthExtentIsotropic and DepthBehindSheet in SetupConstants.h.
void ReferenceDepth(const CameraSurfel& s, double overlap, const Vector3 rows[2],
  const double w[2][2], ReferenceSplat& splat)
{
  const double alongZ = std::sqrt(std::max(0.0, s.Covariance[2][2]));
  const double longest = std::sqrt(LargestEigenvalue(s.Covariance));
  const double half = 2.0 * alongZ + 0.5 * longest;
  splat.Depth = s.Position[2];
  splat.Near = splat.Depth - half;
  splat.Far = splat.Depth + half;
  splat.Order = splat.Near + 4.0 * overlap * overlap * half;
  const double det = w[0][0] * w[1][1] - w[0][1] * w[0][1];
  const double cx = Dot(rows[0], s.Covariance[2]), cy = Dot(rows[1], s.Covariance[2]);
  splat.DepthX = (w[1][1] * cx - w[0][1] * cy) / det;
  splat.DepthY = (w[0][0] * cy - w[0][1] * cx) / det;
}

/// Weight at the centre and the unit of q, by the kernel's own integrals.
void SetKernel(double deposit, double det, double c, ReferenceSplat& splat)
{
  const double mass = 1.0 - std::exp(-c);
  const double tau = 1.0 - c * std::exp(-c) / mass;
  double scale = tau, volume = 2.0 * Pi * mass / tau; // the raster's q per q = x' W^-1 x
  if (splat.Kernel.Type != ReferenceKernel::Gaussian)
  {
    const double q0 = splat.Kernel.Reach();
    scale = 2.0 * c / q0;
    volume = Pi * q0 * splat.Kernel.Mass;
  }
  splat.Weight = deposit / (volume * std::sqrt(det));
  splat.Inverse[0][0] = scale * splat.W[1][1] / det;
  splat.Inverse[1][1] = scale * splat.W[0][0] / det;
  splat.Inverse[0][1] = splat.Inverse[1][0] = -scale * splat.W[0][1] / det;
}

/// What a surfel seen from one or both sides shows to the points u of the lens: from R u, the area
/// vector faces the ray to the surfel by -a.(p - R u).
struct LensView
{
  double Center, Slope[2]; ///< of that, by u
  double Largest;          ///< for any u
  double Mean;             ///< of the part that is seen, as a share of the largest
  double Point[2];         ///< mean of u weighted with it
};

/// @param facing -a.p > 0 on the seen side, or negative for a surfel whose front the lens's border
/// may see
LensView SeeFromLens(const CameraSurfel& s, double radius, double facing, bool twoSided)
{
  LensView view{};
  const double sign = (facing < 0.0) == (-Dot(s.Area, s.Position) < 0.0) ? 1.0 : -1.0;
  view.Center = facing;
  for (int k = 0; k < 2; ++k)
  {
    view.Slope[k] = sign * radius * s.Area[k];
  }
  const double slope = std::hypot(view.Slope[0], view.Slope[1]);
  view.Largest = facing + slope;
  // u uniform within half of sqrt(3) along the slope (Lens.h), by its integral.
  constexpr int Steps = 20000;
  double sum = 0.0, moment = 0.0;
  for (int i = 0; i < Steps; ++i)
  {
    const double u = 0.5 * std::sqrt(3.0) * ((2.0 * i + 1.0) / Steps - 1.0);
    const double area = facing + slope * u;
    const double seen = twoSided ? std::abs(area) : std::max(0.0, area);
    sum += seen / Steps;
    moment += seen * u / Steps;
  }
  view.Mean = sum / view.Largest;
  for (int k = 0; k < 2; ++k)
  {
    view.Point[k] = sum > 0.0 && slope > 0.0 ? moment / sum * view.Slope[k] / slope : 0.0;
  }
  return view;
}

/// The regression of the lens point u on the offset d, u = m + C/4 W^-1 (d - C m), and of the area
/// that is seen: that of u where d tells it, the best line over the lens where it does not.
/// @param inverse W^-1 @param confusion C, signed
void SetLens(
  const LensView& lens, const double (&inverse)[2][2], double confusion, ReferenceSplat& splat)
{
  double slope[2], squared = 0.0, known = 0.0, along = 0.0;
  splat.LensShare = std::min(0.125 * confusion * confusion * (inverse[0][0] + inverse[1][1]), 1.0);
  for (int a = 0; a < 2; ++a)
  {
    splat.Point[a] = lens.Point[a];
    slope[a] = 0.0;
    for (int b = 0; b < 2; ++b)
    {
      splat.PerPixel[a][b] = 0.25 * confusion * inverse[a][b];
      splat.Point[a] -= confusion * splat.PerPixel[a][b] * lens.Point[b];
      slope[a] += splat.PerPixel[a][b] * lens.Slope[b] / lens.Largest;
    }
    const double v = lens.Slope[a] / lens.Largest;
    squared += v * v;
    known += confusion * slope[a] * v;
    along += 4.0 * lens.Mean * lens.Point[a] * v;
  }
  splat.Area = lens.Mean;
  if (squared > 1e-30)
  {
    const double share = std::min(known / squared, 1.0), weight = share * share;
    splat.Area += weight * (lens.Center / lens.Largest - lens.Mean);
    splat.AreaX = (weight + (1.0 - weight) * along / squared) * slope[0];
    splat.AreaY = (weight + (1.0 - weight) * along / squared) * slope[1];
  }
}

/// Whether the outline of a support q <= k^2 that nearly reaches the lens plane is in the picture.
/// The outline's dual conic is C = p p' - k^2 S; it is bounded by C_a2 / C_22 +- the root of (C_a2
/// / C_22)^2 - C_aa / C_22 along an axis a.
bool IsOutlineInside(const SplatContext& context, const CameraSurfel& s, double reach)
{
  const View& view = context.Camera;
  const Vector3& p = s.Position;
  const auto conic = [&](int i, int k) { return p[i] * p[k] - reach * s.Covariance[i][k]; };
  if (conic(2, 2) < 0.0)
  {
    return false; // it reaches the plane
  }
  if (16.0 * reach * s.Covariance[2][2] <= p[2] * p[2])
  {
    return true;
  }
  const double blur = std::abs(1.0 / context.Optics.FocalDistance - 1.0 / p[2]);
  const double focal[] = { view.Fx, view.Fy }, center[] = { view.Cx, view.Cy };
  const int size[] = { view.Width, view.Height };
  for (int axis = 0; axis < 2; ++axis)
  {
    const double middle = conic(axis, 2) / conic(2, 2);
    const double half = std::sqrt(std::max(0.0, middle * middle - conic(axis, axis) / conic(2, 2)));
    const double margin = 4.0 + 1.5 * context.Optics.Radius * std::abs(focal[axis]) * blur;
    const double at = center[axis] + focal[axis] * middle, around = std::abs(focal[axis]) * half;
    if (!(at - around < size[axis] + margin && at + around > -margin))
    {
      return false;
    }
  }
  return true;
}

/// A surfel whose support nearly reaches the lens plane, with its centre beside the picture,
/// becomes as short on the screen as its outline is from there towards the picture.
/// @return the part of its area that is left
double Shorten(const SplatContext& context, double reach, CameraSurfel& s)
{
  const View& view = context.Camera;
  const Vector3& p = s.Position;
  if (view.Parallel || 16.0 * reach * s.Covariance[2][2] <= p[2] * p[2])
  {
    return 1.0;
  }
  const double focal[] = { view.Fx, view.Fy }, center[] = { view.Cx, view.Cy };
  const int size[] = { view.Width, view.Height };
  const auto conic = [&](int i, int k) { return p[i] * p[k] - reach * s.Covariance[i][k]; };
  Vector3 rows[2];
  Jacobian(view, p, rows);
  Matrix3 change = { { { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } } };
  for (int axis = 0; axis < 2; ++axis)
  {
    const double at = center[axis] + focal[axis] * p[axis] / p[2];
    const double middle = conic(axis, 2) / conic(2, 2);
    const double half = std::sqrt(std::max(0.0, middle * middle - conic(axis, axis) / conic(2, 2)));
    const double shift = focal[axis] * (middle - p[axis] / p[2]);
    const double around = std::abs(focal[axis]) * half;
    const double affine = std::sqrt(reach * Dot(rows[axis], Multiply(s.Covariance, rows[axis])));
    if (at < 0.0 || at > size[axis])
    {
      const double share = (at < 0.0 ? around + shift : around - shift) / affine;
      change[axis][axis] = std::min(1.0, share);
      change[axis][2] = (1.0 - change[axis][axis]) * p[axis] / p[2];
    }
  }
  Matrix3 changed{};
  for (int i = 0; i < 3; ++i)
  {
    for (int k = 0; k < 3; ++k)
    {
      changed[i][k] = Dot(change[i], Multiply(s.Covariance, change[k]));
    }
  }
  s.Covariance = changed;
  return change[0][0] * change[1][1];
}

/// False where the surfel is not seen.
bool MakeReferenceSplat(
  const SplatContext& context, const SurfelCloud& cloud, std::size_t i, ReferenceSplat& splat)
{
  const View& view = context.Camera;
  CameraSurfel s = ToCamera(view, cloud, i);
  const Vector3& p = s.Position;
  if (!(p[2] >= view.Near && p[2] <= view.Far))
  {
    return false;
  }
  // A kernel whose support, q = 2c / tau or 8, reaches the lens plane is not drawn.
  const double c0 = context.Settings.Cutoff;
  const double tau0 = 1.0 - c0 * std::exp(-c0) / (1.0 - std::exp(-c0));
  const bool isGaussian = context.Settings.Kernel == KernelType::Gaussian;
  const double reach = isGaussian ? 2.0 * c0 / tau0 : 8.0;
  if (!view.Parallel && !IsOutlineInside(context, s, reach))
  {
    return false;
  }
  const double left = Shorten(context, reach, s);
  double facing = view.Parallel ? -s.Area[2] : -Dot(s.Area, p);
  const bool twoSided = cloud.TwoSided && cloud.TwoSided[i];
  const bool back = facing < 0.0 && twoSided;
  facing = back ? -facing : facing;
  const bool pearson = context.Settings.Kernel == KernelType::PearsonII;
  const bool weighs = pearson && context.Optics.Radius > 0.0 && !view.Parallel;
  const LensView lens = SeeFromLens(s, weighs ? context.Optics.Radius : 0.0, facing, twoSided);
  if (lens.Largest <= 0.0)
  {
    return false;
  }
  Vector3 rows[2];
  Jacobian(view, p, rows);
  const double center = std::abs(
    Dot(rows[0], s.AreaU) * Dot(rows[1], s.AreaV) - Dot(rows[0], s.AreaV) * Dot(rows[1], s.AreaU));
  double deposit = weighs ? view.Fx * view.Fy / (p[2] * p[2] * p[2]) * lens.Largest : center;
  deposit *= left;

  const double confusion = view.Parallel
    ? 0.0
    : context.Optics.Radius * std::abs(1.0 / context.Optics.FocalDistance - 1.0 / p[2]);
  const double c = context.Settings.Cutoff;
  const double cx = view.Fx * confusion, cy = view.Fy * confusion;
  const double lensX = pearson ? cx * cx / 4.0 : ReferenceLensVariance(cx, c);
  const double lensY = pearson ? cy * cy / 4.0 : ReferenceLensVariance(cy, c);
  const double h = context.Settings.Prefilter;
  double w[2][2];
  for (int a = 0; a < 2; ++a)
  {
    for (int b = 0; b < 2; ++b)
    {
      w[a][b] = Dot(rows[a], Multiply(s.Covariance, rows[b]));
    }
  }
  w[0][0] += h + lensX;
  w[1][1] += h + lensY;
  const double det = w[0][0] * w[1][1] - w[0][1] * w[1][0];

  const double smooth = std::sqrt((h + lensX) * (h + lensY) / det);
  const double cosine = facing / Norm(s.Area) / (view.Parallel ? 1.0 : Norm(p));
  splat.Kernel =
    pearson ? ChooseReferenceKernel(ReferencePearsonExponent(w, cx * cy)) : ReferenceKernel{};
  std::copy(&w[0][0], &w[0][0] + 4, &splat.W[0][0]);
  const double spacing =
    view.Fx * view.Fy * Norm(s.Area) * (view.Parallel ? 1.0 : 1.0 / (p[2] * p[2]));
  const double blurred = std::sqrt(lensX * lensY);
  const double share =
    blurred > 0.0 ? blurred / (blurred + h + spacing * (1.0 / 12.0 + 0.0784)) : 0.0;
  const double overlap = cloud.Overlaps ? cloud.Overlaps[i] / 255.0 : 0.0;
  deposit *= 1.0 - share * share * overlap;
  SetKernel(deposit * ReferenceRippleCompensation(smooth, cosine), det, c, splat);
  splat.X = view.Fx * p[0] / (view.Parallel ? 1.0 : p[2]) + view.Cx;
  splat.Y = view.Fy * p[1] / (view.Parallel ? 1.0 : p[2]) + view.Cy;
  splat.Back = twoSided ? 1.0 : 0.0;
  if (context.Optics.Radius > 0.0 && !view.Parallel)
  {
    const double sign = p[2] > context.Optics.FocalDistance ? 1.0 : -1.0;
    const double inverse[2][2] = { { w[1][1] / det, -w[0][1] / det },
      { -w[1][0] / det, w[0][0] / det } };
    SetLens(lens, inverse, sign * std::sqrt(cx * cy), splat);
  }
  ReferenceDepth(s, overlap * (1.0 - share * share), rows, w, splat);
  ReferenceColor(context, cloud, i, s, back, splat);
  return true;
}
}

double EvaluateKernel(const ReferenceSplat& s, double q, double cutoff)
{
  return s.Kernel.Type == ReferenceKernel::Gaussian
    ? std::exp(-0.5 * q)
    : s.Kernel.At(std::max(0.0, 1.0 - q / (2.0 * cutoff)));
}

std::vector<ReferenceSplat> MakeReferenceSplats(
  const SplatContext& context, const std::vector<SurfelCloud>& clouds)
{
  std::vector<ReferenceSplat> splats;
  for (const SurfelCloud& cloud : clouds)
  {
    for (std::size_t i = 0; i < cloud.NumberOfSurfels; ++i)
    {
      ReferenceSplat splat;
      if (MakeReferenceSplat(context, cloud, i, splat))
      {
        splats.push_back(splat);
      }
    }
  }
  return splats;
}

double ReferenceLensVariance(double c, double cutoff)
{
  // The paper's a. A Gaussian truncated at the cut-off keeps the share tau of it.
  const double tau = 1.0 - cutoff * std::exp(-cutoff) / (1.0 - std::exp(-cutoff));
  return tau * c * c / (2.0 * std::log(4.0));
}

double ReferenceRippleCompensation(double smooth, double cosine)
{
  return 1.0 / (1.0 - 0.2 * (1.0 - smooth) * cosine * cosine);
}
}
