// SPDX-License-Identifier: BSD-3-Clause
#include "BruteForceSplatter.h"

#include "TestScene.h"

#include <algorithm>
#include <cmath>

namespace SurfelSplatting
{
namespace
{
constexpr double Pi = 3.14159265358979324;
constexpr double Epsilon = 0x1p-24; // half a unit in the last place of a float in [1, 2)

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

/// A kernel as a function of t = 1 - q/2c.
struct ReferenceKernel
{
  enum
  {
    Gaussian, ///< exp(-q/2)
    Bell,     ///< t ((1 - P) t + P (0.4 + 0.6 t^3))
    Smooth    ///< u^2 (3 - 2u), u = min(1, P t)
  } Type;
  double P;

  double Value(double t) const
  {
    const double u = std::min(1.0, this->P * t);
    return this->Type == Smooth ? u * u * (3.0 - 2.0 * u)
                                : t * ((1.0 - this->P) * t + this->P * (0.4 + 0.6 * t * t * t));
  }
  /// Largest slope near t.
  double Slope(double t) const
  {
    const double u = std::min(1.0, this->P * t);
    return this->Type == Smooth ? this->P * 6.0 * u : 2.0 * t + this->P * (0.4 + 2.4 * t * t * t);
  }
};

/// One evaluated splat: everything that does not depend on the pixel.
struct ReferenceSplat
{
  double X, Y, Weight;
  ReferenceKernel Kernel;
  double W[2][2];       ///< covariance of the untruncated Gaussian, W / tau
  double Inverse[2][2]; ///< its inverse
  double Near, Far, Depth, DepthX, DepthY;
  double Point = 0, TiltX = 0, TiltY = 0; ///< of the lens, as in LensSectors.h
  double Color[3], Opacity;
};

struct Fragment
{
  double Near, Far, Weight, Depth;
  double Error;      ///< of the weight, relative
  double DepthError; ///< world units
  const ReferenceSplat* Splat;
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

/// Depth range and slope: extended depth test of ABuffer.h, with the values of DepthExtentAlongZ
/// and DepthExtentIsotropic in SetupConstants.h.
void ReferenceDepth(
  const CameraSurfel& s, const Vector3 rows[2], const double w[2][2], ReferenceSplat& splat)
{
  const double alongZ = std::sqrt(std::max(0.0, s.Covariance[2][2]));
  const double longest = std::sqrt(LargestEigenvalue(s.Covariance));
  const double half = 2.0 * alongZ + 0.5 * longest;
  splat.Depth = s.Position[2];
  splat.Near = splat.Depth - half;
  splat.Far = splat.Depth + half;
  const double det = w[0][0] * w[1][1] - w[0][1] * w[0][1];
  const double cx = Dot(rows[0], s.Covariance[2]), cy = Dot(rows[1], s.Covariance[2]);
  splat.DepthX = (w[1][1] * cx - w[0][1] * cy) / det;
  splat.DepthY = (w[0][0] * cy - w[0][1] * cx) / det;
}

/// Integrals of a smooth kernel of steepness s and of its products with 1 - t and (1 - t)^2 over t
/// in [0, 1]: a step on [0, e], and 1 on [e, 1]; if s < 1, the step's first part only.
void SmoothMoments(double s, double (&m)[3])
{
  const double e = std::min(1.0, 1.0 / s), u = std::min(1.0, s);
  double t[3]; // integrals of k t^j
  for (int j = 0; j < 3; ++j)
  {
    const double step = std::pow(e, j + 1) * u * u * (3.0 / (j + 3) - 2.0 * u / (j + 4));
    t[j] = step + (1.0 - std::pow(e, j + 1)) / (j + 1);
  }
  m[0] = t[0];
  m[1] = t[0] - t[1];
  m[2] = t[0] - 2.0 * t[1] + t[2];
}

/// The steepness with this E[q^2], if E[q] = 2: by bisection, since a steeper step has less.
double SmoothSteepness(double kurtosis)
{
  double low = 1e-6, high = 2e3; // the widest plateau that SmoothProfile makes
  for (int i = 0; i < 100; ++i)
  {
    const double s = std::sqrt(low * high);
    double m[3];
    SmoothMoments(s, m);
    (4.0 * m[0] * m[2] / (m[1] * m[1]) > kurtosis ? low : high) = s;
  }
  return low;
}

/**
 * Exponent of the Pearson-II kernel for W and a disc of radius C: both have
 * the same Mardia's kurtosis E[(x' W^-1 x)^2]. For the disc convolved with a Gaussian it is 8 plus
 * the disc's fourth cumulant, -C^4/48 (d_ij d_kl + d_ik d_jl + d_il d_jk), contracted with W^-1
 * W^-1. For Pearson II it is 8 - 8 / (n + 3).
 */
double ReferencePearsonExponent(const double w[2][2], double squaredConfusion)
{
  const double det = w[0][0] * w[1][1] - w[0][1] * w[1][0];
  const double inverse[2][2] = { { w[1][1] / det, -w[0][1] / det },
    { -w[1][0] / det, w[0][0] / det } };
  double excess = 0.0;
  for (int index = 0; index < 16; ++index)
  {
    const int i = index & 1, j = index >> 1 & 1, k = index >> 2 & 1, l = index >> 3 & 1;
    const int deltas = (i == j && k == l) + (i == k && j == l) + (i == l && j == k);
    excess -= squaredConfusion * squaredConfusion / 48.0 * deltas * inverse[i][j] * inverse[k][l];
  }
  return excess < 0.0 ? -8.0 / excess - 3.0 : 1e300;
}

/// The kernel with this Pearson exponent, and its integrals over t: of itself and times 1 - t.
ReferenceKernel ChooseReferenceKernel(double n, double& mass, double& moment)
{
  if (n < 1.99)
  {
    const double kurtosis = 8.0 - 8.0 / (std::max(n, 0.0) + 3.0);
    const ReferenceKernel kernel{ ReferenceKernel::Smooth, SmoothSteepness(kurtosis) };
    double m[3];
    SmoothMoments(kernel.P, m);
    mass = m[0];
    moment = m[1];
    return kernel;
  }
  const ReferenceKernel kernel{ ReferenceKernel::Bell, std::min(1.0, (n - 1.99) / 0.91) };
  mass = moment = 0.0;
  constexpr int Steps = 2000; // Simpson's rule: 1e-13 for a polynomial of fifth degree
  for (int i = 0; i <= Steps; ++i)
  {
    const double t = static_cast<double>(i) / Steps;
    const double weight = (i == 0 || i == Steps ? 1.0 : i % 2 ? 4.0 : 2.0) / (3.0 * Steps);
    mass += weight * kernel.Value(t);
    moment += weight * kernel.Value(t) * (1.0 - t);
  }
  return kernel;
}

/// Mean place on the screen of the light of a surfel, against that from the lens's centre: over all
/// points of the lens, weighted by the area that each of them sees (first moments of a linear
/// weight over a disc), up to where the surfel is edge-on from the lens's border.
void AddBlurOffset(const SplatContext& context, const CameraSurfel& s, ReferenceSplat& splat)
{
  const View& view = context.Camera;
  const Vector3& p = s.Position;
  const double radius = context.Optics.Radius;
  const double slope = radius * std::hypot(s.Area[0], s.Area[1]) / std::abs(Dot(s.Area, p));
  if (slope == 0.0)
  {
    return;
  }
  const double mean =
    std::min(slope, 1.0) / 4.0; // of the lens, in the direction of the area vector
  const double sign = Dot(s.Area, p) < 0.0 ? 1.0 : -1.0;
  for (int k = 0; k < 2; ++k)
  {
    const double u = sign * mean * radius * s.Area[k] / std::hypot(s.Area[0], s.Area[1]);
    // The ray from lens point u through p, where it meets the plane in focus.
    const double z = context.Optics.FocalDistance / p[2];
    const double shift = (u + (p[k] - u) * z) / context.Optics.FocalDistance - p[k] / p[2];
    (k == 0 ? splat.X : splat.Y) += (k == 0 ? view.Fx : view.Fy) * shift;
  }
}

/// False where the surfel is not seen.
bool MakeReferenceSplat(
  const SplatContext& context, const SurfelCloud& cloud, std::size_t i, ReferenceSplat& splat)
{
  const View& view = context.Camera;
  const CameraSurfel s = ToCamera(view, cloud, i);
  const Vector3& p = s.Position;
  if (!(p[2] >= view.Near && p[2] <= view.Far))
  {
    return false;
  }
  // A kernel whose support, q = 2c / tau, reaches the lens plane is not drawn.
  const double c0 = context.Settings.Cutoff;
  const double tau0 = 1.0 - c0 * std::exp(-c0) / (1.0 - std::exp(-c0));
  if (!view.Parallel && p[2] < std::sqrt(2.0 * c0 / tau0 * s.Covariance[2][2]))
  {
    return false;
  }
  const double facing = view.Parallel ? -s.Area[2] : -Dot(s.Area, p);
  const bool back = facing < 0.0;
  if (facing == 0.0 || (back && !(cloud.TwoSided && cloud.TwoSided[i])))
  {
    return false;
  }
  Vector3 rows[2];
  Jacobian(view, p, rows);
  const double deposit = std::abs(
    Dot(rows[0], s.AreaU) * Dot(rows[1], s.AreaV) - Dot(rows[0], s.AreaV) * Dot(rows[1], s.AreaU));

  const double confusion = view.Parallel
    ? 0.0
    : context.Optics.Radius * std::abs(1.0 / context.Optics.FocalDistance - 1.0 / p[2]);
  const double c = context.Settings.Cutoff;
  const bool pearson = context.Settings.Kernel == KernelType::PearsonII;
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

  const double mass = 1.0 - std::exp(-c);
  const double tau = 1.0 - c * std::exp(-c) / mass;
  const double smooth = std::sqrt((h + lensX) * (h + lensY) / det);
  const double cosine = facing / Norm(s.Area) / (view.Parallel ? 1.0 : Norm(p));
  splat.Kernel = { ReferenceKernel::Gaussian, 0.0 };
  double scale = tau, volume = 2.0 * Pi * mass / tau;
  if (pearson)
  {
    // The mean of q = x' W^-1 x, which ends at q0, is 2; it is scaled to end at 2 c.
    double total = 0.0, moment = 0.0;
    splat.Kernel = ChooseReferenceKernel(ReferencePearsonExponent(w, cx * cy), total, moment);
    const double q0 = 2.0 * total / moment;
    scale = 2.0 * c / q0;
    volume = Pi * q0 * total;
  }
  splat.Weight = deposit * ReferenceRippleCompensation(smooth, cosine) / (volume * std::sqrt(det));
  splat.Inverse[0][0] = scale * w[1][1] / det;
  splat.Inverse[1][1] = scale * w[0][0] / det;
  splat.Inverse[0][1] = splat.Inverse[1][0] = -scale * w[0][1] / det;
  std::copy(&w[0][0], &w[0][0] + 4, &splat.W[0][0]);
  splat.X = view.Fx * p[0] / (view.Parallel ? 1.0 : p[2]) + view.Cx;
  splat.Y = view.Fy * p[1] / (view.Parallel ? 1.0 : p[2]) + view.Cy;
  if (pearson && confusion > 0.0)
  {
    const double shiftX = splat.X, shiftY = splat.Y;
    AddBlurOffset(context, s, splat);
    if (context.Sectors)
    {
      // The offset is C times the mean lens point; weights take its place.
      const double sign = p[2] > context.Optics.FocalDistance ? 1.0 : -1.0;
      splat.Point = sign * std::sqrt(cx * cy / det) / 4.0;
      splat.TiltX = 4.0 * (splat.X - shiftX) / (sign * cx) * splat.Point;
      splat.TiltY = 4.0 * (splat.Y - shiftY) / (sign * cy) * splat.Point;
      splat.X = shiftX;
      splat.Y = shiftY;
    }
  }
  ReferenceDepth(s, rows, w, splat);
  ReferenceColor(context, cloud, i, s, back, splat);
  return true;
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

/**
 * What rounding to float does to q at offset d: the raster computes u = column + (1/2 - x + K dy),
 * x and y relative to a tile, so every term is rounded to within Epsilon of its size (three
 * operations each, the splat's own fields included); dq/dx = 2 (W^-1 d)_x, and four factors of q
 * carry a relative error each.
 */
double ErrorOfQ(const ReferenceSplat& s, double dx, double dy, double q)
{
  const double gx = s.Inverse[0][0] * dx + s.Inverse[0][1] * dy;
  const double gy = s.Inverse[1][0] * dx + s.Inverse[1][1] * dy;
  const double sheared = std::abs(s.W[0][1] / s.W[1][1] * dy);
  const double errorX = 3.0 * Epsilon * (std::abs(s.X) + 32.0 + sheared);
  const double errorY = 3.0 * Epsilon * (std::abs(s.Y) + 32.0);
  return 2.0 * std::abs(gx) * errorX + 2.0 * std::abs(gy) * errorY + 4.0 * Epsilon * q;
}

/// Factor of a fragment's weight in a sector of the lens, and its relative error; 1 without
/// sectors.
double SectorShare(const ReferenceSplat& s, const LensSector& sector, double dx, double dy,
  double& error, bool& undecided)
{
  error = 0.0;
  if (sector.X == 0.0f)
  {
    return 1.0;
  }
  // Each factor is a sum about the tile's corner: four roundings of its largest term.
  const double reach = std::abs(s.X) + std::abs(s.Y) + 64.0;
  double share = 4.0;
  for (const double along : { sector.X * s.Point * dx, sector.Y * s.Point * dy })
  {
    const double bound = 4.0 * Epsilon * (1.0 + std::abs(s.Point) * reach);
    const double part = std::clamp(0.5 + along, 0.0, 1.0);
    undecided = undecided || std::abs(0.5 + along) <= bound;
    error += part > 0.0 ? bound / part : 0.0;
    share *= part;
  }
  const double tilt = 1.0 + s.TiltX * dx + s.TiltY * dy;
  const double bound = 4.0 * Epsilon * (1.0 + (std::abs(s.TiltX) + std::abs(s.TiltY)) * reach);
  undecided = undecided || std::abs(tilt) <= bound;
  error += tilt > 0.0 ? bound / tilt : 0.0;
  return share * std::max(0.0, tilt);
}

std::vector<Fragment> CollectFragments(const std::vector<ReferenceSplat>& splats, double cutoff,
  const LensSector& sector, double x, double y, bool& undecided)
{
  std::vector<Fragment> fragments;
  for (const ReferenceSplat& s : splats)
  {
    const double dx = x - s.X, dy = y - s.Y;
    const double q =
      s.Inverse[0][0] * dx * dx + 2.0 * s.Inverse[0][1] * dx * dy + s.Inverse[1][1] * dy * dy;
    const double error = ErrorOfQ(s, dx, dy, q);
    undecided = undecided || std::abs(q - 2.0 * cutoff) <= error;
    double shareError = 0.0;
    const double share =
      q < 2.0 * cutoff ? SectorShare(s, sector, dx, dy, shareError, undecided) : 0.0;
    if (share > 0.0)
    {
      // ExpOfMinus adds 2e-7 + 7.5e-8 q/2 (see its test); the peak, two products and a colour one
      // rounding each. Other kernels have their slope times the error of t = 1 - q/2c, and up to
      // six roundings.
      const double t = 1.0 - q / (2.0 * cutoff);
      const bool gaussian = s.Kernel.Type == ReferenceKernel::Gaussian;
      const double value = gaussian ? std::exp(-0.5 * q) : s.Kernel.Value(t);
      const double relative = gaussian
        ? 0.5 * error + 2e-7 + 3.75e-8 * q + 4.0 * Epsilon
        : s.Kernel.Slope(t) * (error / (2.0 * cutoff) + 2.0 * Epsilon) / value + 10.0 * Epsilon;
      const double kernel = share * value;
      // Depth = Depth0 + DepthX column, both about a corner of the tile: five roundings of the
      // largest term.
      const double depthError = 5.0 * Epsilon *
        (std::abs(s.Depth) + std::abs(s.DepthX) * (std::abs(s.X) + 32.0) +
          std::abs(s.DepthY) * (std::abs(s.Y) + 32.0));
      fragments.push_back({ s.Near, s.Far, s.Weight * kernel,
        s.Depth + s.DepthX * dx + s.DepthY * dy, relative + shareError, depthError, &s });
    }
  }
  std::stable_sort(fragments.begin(), fragments.end(),
    [](const Fragment& a, const Fragment& b) { return a.Near < b.Near; });
  return fragments;
}

struct ReferenceLayer
{
  double Near = 0, Far = 0, Weight = 0, Opacity = 0, Color[3] = { 0, 0, 0 }, Depth = 0;
  double Error = 0;      ///< sum of weights times their relative error
  double DepthError = 0; ///< sum of weights times the error of their depths
  int Count = 0;

  void Add(const Fragment& f)
  {
    const double opaque = f.Weight * f.Splat->Opacity;
    Near = Count == 0 ? f.Near : std::min(Near, f.Near);
    Far = Count == 0 ? f.Far : std::max(Far, f.Far);
    Weight += f.Weight;
    Opacity += opaque;
    for (int k = 0; k < 3; ++k)
    {
      Color[k] += opaque * f.Splat->Color[k];
    }
    Depth += f.Weight * f.Depth;
    Error += f.Weight * f.Error;
    DepthError += f.Weight * f.DepthError;
    ++Count;
  }
};

/// Unions of overlapping intervals, of fragments sorted by their near ends.
std::vector<ReferenceLayer> MergeFragments(const std::vector<Fragment>& fragments, bool& undecided)
{
  std::vector<ReferenceLayer> layers;
  for (const Fragment& f : fragments)
  {
    const bool first = layers.empty();
    const double gap = first ? 0.0 : f.Near - layers.back().Far;
    // Near and Far are rounded once each.
    undecided =
      undecided || (!first && std::abs(gap) <= 2.0 * Epsilon * (std::abs(f.Near) + 1e-30));
    if (first || gap > 0.0)
    {
      layers.emplace_back();
    }
    layers.back().Add(f);
  }
  return layers;
}

Layer ToLayer(const ReferenceLayer& layer)
{
  Layer l;
  l.Near = static_cast<float>(layer.Near);
  l.Far = static_cast<float>(layer.Far);
  l.Weight = static_cast<float>(layer.Weight);
  l.Opacity = static_cast<float>(layer.Opacity);
  l.Red = static_cast<float>(layer.Color[0]);
  l.Green = static_cast<float>(layer.Color[1]);
  l.Blue = static_cast<float>(layer.Color[2]);
  l.Depth = static_cast<float>(layer.Depth);
  return l;
}

/// Front to back "over" with the depth limit; the running bounds of ReferencePixel.
void Composite(const std::vector<ReferenceLayer>& layers, double limit, ReferencePixel& pixel)
{
  double transmittance = 1.0;
  for (const ReferenceLayer& layer : layers)
  {
    const double depth = layer.Depth / layer.Weight;
    // A sum of n terms is off by n roundings at most; both sums of a quotient are.
    const double relative = layer.Error / layer.Weight + (layer.Count + 4) * Epsilon;
    const double depthBound = 2.0 * relative * std::abs(depth) + layer.DepthError / layer.Weight;
    pixel.Undecided = pixel.Undecided || std::abs(depth - limit) <= depthBound;
    if (!(depth <= limit))
    {
      continue;
    }
    const double share = transmittance / std::max(1.0, layer.Weight);
    for (int k = 0; k < 3; ++k)
    {
      pixel.Color[k] += share * layer.Color[k];
    }
    const double after = std::max(0.0, transmittance - share * layer.Opacity);
    // The layer's own terms carry 2 relative; all that lies behind it sees that error again in the
    // transmittance.
    pixel.ColorBound += 2.0 * 2.0 * relative * share * layer.Weight + Epsilon;
    pixel.DepthUndecided = pixel.DepthUndecided || std::abs(after - 0.5) <= pixel.ColorBound;
    if (transmittance > 0.5 && after <= 0.5)
    {
      pixel.Depth = depth;
      pixel.DepthBound = depthBound;
    }
    transmittance = after;
  }
  pixel.Color[3] = 1.0 - transmittance;
  pixel.Layers = static_cast<int>(layers.size());
}
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

namespace
{
/// Adds one of the four sectors of a lens to their mean.
void AddSector(const ReferencePixel& sector, ReferencePixel& mean)
{
  for (int k = 0; k < 4; ++k)
  {
    mean.Color[k] += sector.Color[k] / NumberOfSectors;
  }
  mean.ColorBound += sector.ColorBound / NumberOfSectors + Epsilon;
  mean.Undecided = mean.Undecided || sector.Undecided;
  mean.DepthUndecided = true; // which sector's it is
  mean.Layers = std::max(mean.Layers, sector.Layers);
}
}

std::vector<ReferencePixel> RenderByBruteForce(
  const SplatContext& context, const std::vector<SurfelCloud>& clouds, const float* occluderDepth)
{
  const bool sectors = context.Sectors && context.Optics.Radius > 0.0 && !context.Camera.Parallel &&
    context.Settings.Kernel == KernelType::PearsonII;
  const std::vector<ReferenceSplat> splats = MakeReferenceSplats(context, clouds);
  const int width = context.Camera.Width, height = context.Camera.Height;
  std::vector<ReferencePixel> pixels(static_cast<std::size_t>(width) * height);
  for (int y = 0; y < height; ++y)
  {
    for (int x = 0; x < width; ++x)
    {
      const std::size_t index = static_cast<std::size_t>(y) * width + x;
      ReferencePixel& pixel = pixels[index];
      const double limit = occluderDepth ? static_cast<double>(occluderDepth[index]) : INFINITY;
      for (int sector = 0; sector < (sectors ? NumberOfSectors : 1); ++sector)
      {
        ReferencePixel part;
        const std::vector<Fragment> fragments = CollectFragments(splats, context.Settings.Cutoff,
          sectors ? SectorOf(sector) : LensSector(), x + 0.5, y + 0.5, part.Undecided);
        Composite(MergeFragments(fragments, part.Undecided), limit, part);
        if (!sectors)
        {
          pixel = part;
          break;
        }
        AddSector(part, pixel);
      }
    }
  }
  return pixels;
}

std::vector<std::vector<Layer>> LayersByBruteForce(
  const SplatContext& context, const std::vector<SurfelCloud>& clouds)
{
  const std::vector<ReferenceSplat> splats = MakeReferenceSplats(context, clouds);
  std::vector<std::vector<Layer>> result;
  for (int y = 0; y < context.Camera.Height; ++y)
  {
    for (int x = 0; x < context.Camera.Width; ++x)
    {
      bool undecided = false;
      const std::vector<ReferenceLayer> layers =
        MergeFragments(CollectFragments(splats, context.Settings.Cutoff, LensSector(), x + 0.5,
                         y + 0.5, undecided),
          undecided);
      result.emplace_back();
      for (const ReferenceLayer& layer : layers)
      {
        result.back().push_back(ToLayer(layer));
      }
    }
  }
  return result;
}
}
