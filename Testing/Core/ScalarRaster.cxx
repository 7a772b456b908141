// SPDX-License-Identifier: BSD-3-Clause
#include "ScalarRaster.h"

#include "Core/Lens/ResamplingKernel.h"

#include <array>

namespace SurfelSplatting
{
namespace
{
/// A kernel's value at q, the slope that tilts colours, and how far rounding may move both.
struct ScalarKernel
{
  double Value, Slope, ValueError, SlopeError;
};

/// @param error of q
ScalarKernel EvaluateScalar(double shape, double q, double error)
{
  const double t = 1.0 - q / Support, errorT = error / Support + 2.0 * Epsilon;
  if (shape < 0.0)
  {
    // 2e-7 + 7.5e-8 q/2: the exponential, see the test Exponential.
    const double value = std::exp(-0.5 * q);
    const double bound = value * (0.5 * error + 2e-7 + 3.75e-8 * q);
    return { value, value, bound, bound };
  }
  if (shape >= SmoothShape)
  {
    const double steepness = shape - SmoothShape;
    const double u = std::min(1.0, steepness * t), errorU = steepness * errorT + Epsilon;
    return { u * u * (3.0 - 2.0 * u), u * (1.0 - u), 6.0 * u * (1.0 - u) * errorU + 8.0 * Epsilon,
      errorU + 4.0 * Epsilon };
  }
  // |k'| is at most e + 2 s + 4 f, up to 3. The slope is that of x^2 for every shape.
  const BellWeights<double> bell = BellOf<double>(shape);
  return { t * (bell.Edge + t * (bell.Square + bell.Fourth * t * t)), t,
    3.0 * errorT + 8.0 * Epsilon, errorT + 4.0 * Epsilon };
}

/// Of the area that a lens point sees, relative.
double AreaError(const LensFootprint& lens, const PlacedSplat& p, double area)
{
  const double terms = std::abs(lens.Area) +
    (std::abs(lens.AreaX) + std::abs(lens.AreaY)) * (TileSize + std::abs(p.X) + std::abs(p.Y));
  return 4.0 * Epsilon * terms / std::max(area, 1e-6);
}

/// The values of a splat's fragment at an offset; its colour is what the kernel is multiplied with.
void SetValues(
  const PlacedSplat& p, bool onLens, const ScalarKernel& k, const double (&d)[2], ScalarFragment& f)
{
  const Splat& s = p.S;
  ReferenceFragment& v = f.Values;
  v.Near = s.Near;
  v.Far = s.Far;
  const LensFootprint& lens = p.Footprint;
  const double area =
    lens.Area + static_cast<double>(lens.AreaX) * d[0] + static_cast<double>(lens.AreaY) * d[1];
  const double seen = onLens ? std::max(area, -lens.Back * area) : 1.0;
  v.Weight = static_cast<double>(s.Weight) * k.Value * seen;
  v.Kernel = k.Value / EvaluateScalar(s.Shape, 0.0, 0.0).Value;
  v.Opacity = s.Opacity;
  v.Depth = 0.5 * (static_cast<double>(s.Near) + s.Far) + static_cast<double>(s.DepthX) * d[0] +
    static_cast<double>(s.DepthY) * d[1];
  v.Color[0] = s.Red;
  v.OnLens = onLens;
  v.Share = lens.Share;
  const LensShape root = ShapeOfLens.Root();
  // Half of the gradient of q.
  const double qx = s.A * (d[0] + s.K * d[1]), qy = s.K * qx + s.B * d[1];
  v.U[0] = lens.MeanX + lens.PerForm * (root.XX * qx + root.XY * qy);
  v.U[1] = lens.MeanY + lens.PerForm * (root.XY * qx + root.YY * qy);
  f.Error = k.ValueError / k.Value + 4.0 * Epsilon;
  f.Error += onLens ? AreaError(lens, p, seen) : 0.0;
  f.ColorError = 4.0 * Epsilon;
  if (p.HasGradient)
  {
    const SplatGradient& g = p.Gradient;
    const double tilt = g.RedX * d[0] + g.RedY * d[1], ratio = k.Slope / k.Value;
    const double terms =
      std::abs(g.RedX) * (TileSize + std::abs(p.X)) + std::abs(g.RedY) * (TileSize + std::abs(p.Y));
    v.Color[0] += ratio * tilt;
    f.ColorError += ratio * 8.0 * Epsilon * terms +
      std::abs(tilt) * (k.SlopeError + ratio * k.ValueError) / k.Value;
  }
}

/// A splat's fragment at pixel (i, j).
/// @param undecided set where rounding may decide whether it is there
ScalarFragment MakeFragment(const PlacedSplat& p, bool onLens, int i, int j, bool& undecided)
{
  const Splat& s = p.S;
  const double x = p.X, y = p.Y;
  const double dy = j + 0.5 - y, u = i + 0.5 - x + static_cast<double>(s.K) * dy;
  const double q = s.A * u * u + s.B * dy * dy;
  // u and dy are sums of at most three terms, each off by its own rounding; q by four relative
  // ones.
  const double errorU = 3.0 * Epsilon * (TileSize + std::abs(x) + std::abs(s.K * dy));
  const double errorY = 3.0 * Epsilon * (TileSize + std::abs(y));
  const double error = 2.0 * s.A * std::abs(u) * (errorU + std::abs(s.K) * errorY) +
    2.0 * s.B * std::abs(dy) * errorY + 4.0 * Epsilon * q;
  undecided = undecided || std::abs(q - Support) <= error;
  ScalarFragment f;
  f.IsInside = q < Support;
  if (f.IsInside)
  {
    SetValues(p, onLens, EvaluateScalar(s.Shape, q, error), { i + 0.5 - x, dy }, f);
  }
  return f;
}

/// Pixels of a block, by their places in the tile.
std::array<int, PixelsPerBlock> PixelsOf(int block)
{
  std::array<int, PixelsPerBlock> pixels;
  for (int l = 0; l < PixelsPerBlock; ++l)
  {
    pixels[l] = (block / BlocksPerRow * BlockSize + l / BlockSize) * TileSize +
      block % BlocksPerRow * BlockSize + l % BlockSize;
  }
  return pixels;
}

/// Ends Flat for a block as the raster does: where T's moments of one of its pixels matter.
void TiltBlock(ScalarTile& tile, const std::array<int, PixelsPerBlock>& pixels)
{
  constexpr double MinTilt = 1.0 / 512.0;
  double tilt = 0.0;
  for (const int i : pixels)
  {
    const ReferenceLayers& layers = tile[i].Layers;
    tilt = std::max(tilt, 4.0 * std::hypot(layers.ThroughU[0], layers.ThroughU[1]));
  }
  for (const int i : pixels)
  {
    ScalarPixel& p = tile[i];
    p.Undecided = p.Undecided || (p.Layers.Flat && std::abs(tilt - MinTilt) < 1e-6);
    if (tilt > MinTilt)
    {
      p.Tilt();
    }
  }
}

/// Half of the support in a direction, in float's favour.
double Reach(double variance)
{
  return std::sqrt(Support * variance) * (1.0 + 1e-5) + 1e-3;
}

/// First pixel of the tile whose centre is not left of x.
int FirstPixel(double x)
{
  return static_cast<int>(std::clamp(std::ceil(x - 0.5), 0.0, static_cast<double>(TileSize)));
}
}

std::uint64_t AddScalar(ScalarTile& tile, const PlacedSplat& splat, bool onLens, Random& random)
{
  std::uint64_t count = 0;
  for (int block = 0; block < BlocksPerTile; ++block)
  {
    const std::array<int, PixelsPerBlock> pixels = PixelsOf(block);
    std::array<ScalarFragment, PixelsPerBlock> fragments;
    for (int l = 0; l < PixelsPerBlock; ++l)
    {
      ScalarPixel& p = tile[pixels[l]];
      fragments[l] =
        MakeFragment(splat, onLens, pixels[l] % TileSize, pixels[l] / TileSize, p.Undecided);
      if (fragments[l].IsInside)
      {
        ++count;
        p.Prepare(fragments[l], random);
      }
    }
    TiltBlock(tile, pixels);
    for (int l = 0; l < PixelsPerBlock; ++l)
    {
      if (fragments[l].IsInside)
      {
        tile[pixels[l]].Append(fragments[l]);
      }
    }
  }
  return count;
}

std::vector<PlacedSplat> RandomSplats(Random& random, int count)
{
  std::vector<PlacedSplat> splats;
  float near = 1.0f;
  for (int i = 0; i < count; ++i)
  {
    PlacedSplat p;
    const double major = std::pow(10.0, random.Uniform(-0.3, 2.5));
    const double minor = std::max(0.5, major * random.Uniform(0.0, 1.0));
    const double angle = random.Uniform(0.0, 3.14159), c = std::cos(angle), s = std::sin(angle);
    const double yy = major * major * s * s + minor * minor * c * c;
    const double xy = (major * major - minor * minor) * c * s;
    p.S.A = static_cast<float>(yy / (major * major * minor * minor));
    p.S.K = static_cast<float>(-xy / yy);
    p.S.B = static_cast<float>(1.0 / yy);
    p.X = static_cast<float>(random.Uniform(-major, TileSize + major));
    p.Y = static_cast<float>(random.Uniform(-major, TileSize + major));
    p.S.Weight = static_cast<float>(random.Uniform(0.05, 2.0));
    near += static_cast<float>(random.Integer(0, 3)) * 0.125f;
    p.S.Near = near;
    p.S.Far = near + static_cast<float>(random.Integer(0, 2)) * 0.25f;
    p.S.Red = static_cast<float>(random.Uniform(0.0, 1.0));
    p.S.Opacity = static_cast<float>(random.Uniform(0.2, 1.0));
    p.S.DepthX = static_cast<float>(random.Uniform(-0.01, 0.01));
    p.S.DepthY = static_cast<float>(random.Uniform(-0.01, 0.01));
    const float shapes[] = { -1.0f, 0.0f, 0.25f, 1.0f, 2.2f, 3.0f, 5.0f };
    p.S.Shape = shapes[random.Integer(0, 6)];
    p.HasGradient = random.Integer(0, 2) == 0;
    p.Gradient.RedX = static_cast<float>(random.Uniform(-0.1, 0.1));
    p.Gradient.RedY = static_cast<float>(random.Uniform(-0.1, 0.1));
    p.Footprint = { static_cast<float>(random.Uniform(-0.2, 0.2)),
      static_cast<float>(random.Uniform(-0.2, 0.2)),
      static_cast<float>(random.Uniform(-0.5, 0.5) / major),
      static_cast<float>(random.Uniform(-0.5, 1.0)),
      static_cast<float>(random.Uniform(-0.5, 0.5) / major),
      static_cast<float>(random.Uniform(-0.5, 0.5) / major),
      static_cast<float>(random.Integer(0, 1)), 0.0f };
    const double xx = major * major + minor * minor - yy;
    p.Span = random.Integer(0, 3) == 0
      ? PixelBox{ 0, 0, TileSize, TileSize }
      : PixelBox{ FirstPixel(p.X - Reach(xx)), FirstPixel(p.Y - Reach(yy)),
          FirstPixel(p.X + Reach(xx)), FirstPixel(p.Y + Reach(yy)) };
    splats.push_back(p);
  }
  return splats;
}
}
