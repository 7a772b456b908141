// SPDX-License-Identifier: BSD-3-Clause
#include "BruteForceSplatter.h"

#include "ReferenceLayers.h"
#include "ReferenceSplat.h"
#include "TestScene.h"

#include <algorithm>
#include <cmath>

namespace SurfelSplatting
{
namespace
{
constexpr double Epsilon = 0x1p-24; // half a unit in the last place of a float in [1, 2)

struct Fragment
{
  ReferenceFragment Values;
  double Order;      ///< depth by which they are sorted
  double Error;      ///< of the weight, relative
  double DepthError; ///< world units
  double PointError; ///< of the point of the lens
};

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

/// A splat's fragment at an offset, and what single precision may do to it.
Fragment MakeFragment(
  const ReferenceSplat& s, bool onLens, double cutoff, double dx, double dy, double q)
{
  Fragment f;
  ReferenceFragment& v = f.Values;
  // ExpOfMinus adds 2e-7 + 7.5e-8 q/2 (see its test); the peak, products and a colour one rounding
  // each; t = 1 - q/2c one, and the kernel what the error of q does to it.
  const double error = ErrorOfQ(s, dx, dy, q) + 4.0 * Epsilon * cutoff;
  const double kernel = EvaluateKernel(s, q, cutoff);
  const double change =
    EvaluateKernel(s, std::max(0.0, q - error), cutoff) - EvaluateKernel(s, q + error, cutoff);
  f.Error = change / std::max(kernel, 1e-300) + 8.0 * Epsilon +
    (s.Kernel.Type == ReferenceKernel::Gaussian ? 2e-7 + 3.75e-8 * q : s.Kernel.P * Epsilon);
  // Depth = Depth0 + DepthX column, both about a corner of the tile: five roundings of the largest
  // term.
  f.DepthError = 5.0 * Epsilon *
    (std::abs(s.Depth) + std::abs(s.DepthX) * (std::abs(s.X) + 32.0) +
      std::abs(s.DepthY) * (std::abs(s.Y) + 32.0));
  const double steepest = std::max(std::abs(s.PerPixel[0][0]), std::abs(s.PerPixel[1][1]));
  f.PointError = 8.0 * Epsilon * (0.25 + steepest * (std::abs(s.X) + std::abs(s.Y) + 64.0));
  f.Order = s.Order;
  v.Near = s.Near;
  v.Far = s.Far;
  const double area = s.Area + s.AreaX * dx + s.AreaY * dy;
  const double seen = onLens ? std::max(area, -s.Back * area) : 1.0;
  const double areaError = 4.0 * Epsilon *
    (std::abs(s.Area) +
      (std::abs(s.AreaX) + std::abs(s.AreaY)) * (std::abs(s.X) + std::abs(s.Y) + 64.0));
  f.Error += onLens ? areaError / std::max(seen, 1e-3) : 0.0;
  v.Weight = s.Weight * kernel * seen;
  v.Kernel = kernel / EvaluateKernel(s, 0.0, cutoff);
  v.Opacity = s.Opacity;
  v.Depth = s.Depth + s.DepthX * dx + s.DepthY * dy;
  std::copy(std::begin(s.Color), std::end(s.Color), v.Color);
  v.OnLens = onLens;
  v.Share = s.LensShare;
  for (int k = 0; k < 2; ++k)
  {
    v.U[k] = s.Point[k] + s.PerPixel[k][0] * dx + s.PerPixel[k][1] * dy;
  }
  return f;
}

std::vector<Fragment> CollectFragments(const std::vector<ReferenceSplat>& splats, bool onLens,
  double cutoff, double x, double y, bool& undecided)
{
  std::vector<Fragment> fragments;
  for (const ReferenceSplat& s : splats)
  {
    const double dx = x - s.X, dy = y - s.Y;
    const double q =
      s.Inverse[0][0] * dx * dx + 2.0 * s.Inverse[0][1] * dx * dy + s.Inverse[1][1] * dy * dy;
    undecided = undecided || std::abs(q - 2.0 * cutoff) <= ErrorOfQ(s, dx, dy, q);
    if (q < 2.0 * cutoff)
    {
      fragments.push_back(MakeFragment(s, onLens, cutoff, dx, dy, q));
    }
  }
  std::stable_sort(fragments.begin(), fragments.end(),
    [](const Fragment& a, const Fragment& b) { return a.Order < b.Order; });
  return fragments;
}

ReferenceLayers Composite(
  const std::vector<Fragment>& fragments, const ReferenceLens& lens, double limit, double nudge)
{
  ReferenceLayers layers(lens, limit);
  layers.Nudge = nudge;
  for (const Fragment& f : fragments)
  {
    layers.Add(f.Values);
  }
  layers.Finish();
  return layers;
}

/// Fragments as single precision may have them: each error somewhere within its bound.
std::vector<Fragment> Perturb(const std::vector<Fragment>& fragments, Random& random)
{
  std::vector<Fragment> all = fragments;
  for (Fragment& f : all)
  {
    ReferenceFragment& v = f.Values;
    const double moved = 1.0 + random.Uniform(-f.Error, f.Error);
    v.Weight *= moved;
    v.Depth += random.Uniform(-f.DepthError, f.DepthError);
    v.Near *= 1.0 + random.Uniform(-Epsilon, Epsilon);
    v.Far *= 1.0 + random.Uniform(-Epsilon, Epsilon);
    v.U[0] += random.Uniform(-f.PointError, f.PointError);
    v.U[1] += random.Uniform(-f.PointError, f.PointError);
  }
  return all;
}

/**
 * The bounds are measured, since what a layer leaks depends on all that came before: how far the
 * pixel moves when its fragments are moved at random within their own bounds. Of several draws the
 * largest, times four, since the worst case has all errors on one side; then the roundings of the
 * sums, one for each fragment and sixteen for each leak. A decision that rounding may change (a
 * layer behind the limit, a gap of LargestGap, the median) shows as a jump.
 */
void SetBounds(const std::vector<Fragment>& fragments, const ReferenceLens& lens, double limit,
  Random& random, ReferencePixel& pixel)
{
  constexpr int Draws = 6;
  constexpr double Safety = 4.0, Jump = 1e-4;
  double color = 0.0, depth = 0.0;
  for (int i = 0; i < Draws; ++i)
  {
    const ReferenceLayers moved =
      Composite(Perturb(fragments, random), lens, limit, (i % 2 == 0 ? 8.0 : -8.0) * Epsilon);
    for (int k = 0; k < 3; ++k)
    {
      color = std::max(color, std::abs(moved.Color[k] - pixel.Color[k]));
    }
    color = std::max(color, std::abs(1.0 - moved.Through - pixel.Color[3]));
    depth = std::max(depth, std::abs(moved.Depth - pixel.Depth));
    pixel.DepthUndecided = pixel.DepthUndecided || (moved.Through > 0.5) != (pixel.Color[3] < 0.5);
  }
  const double roundings = Epsilon * (static_cast<double>(fragments.size()) + 16.0 * pixel.Layers);
  pixel.ColorBound = Safety * color + roundings;
  pixel.DepthBound = Safety * depth + roundings * std::abs(pixel.Depth);
  pixel.Undecided = pixel.Undecided || color > Jump;
  pixel.DepthUndecided = pixel.DepthUndecided || depth > Jump * (1.0 + std::abs(pixel.Depth));
}

/// The lens of LensVisibility.h, if there is one.
ReferenceLens LensOf(const SplatContext& context)
{
  const bool has = context.Optics.Radius > 0.0 && !context.Camera.Parallel &&
    context.Settings.Kernel == KernelType::PearsonII;
  return has ? ReferenceLens{ context.Optics.Radius, context.Optics.FocalDistance }
             : ReferenceLens{};
}
}

double ShortCutBound(const SplatContext& context, bool opaque)
{
  return LensOf(context).Radius == 0.0 ? 0.0 : opaque ? 1.0 / 512.0 : 0.02;
}

std::vector<ReferencePixel> RenderByBruteForce(
  const SplatContext& context, const std::vector<SurfelCloud>& clouds, const float* occluderDepth)
{
  const std::vector<ReferenceSplat> splats = MakeReferenceSplats(context, clouds);
  const ReferenceLens lens = LensOf(context);
  const int width = context.Camera.Width, height = context.Camera.Height;
  std::vector<ReferencePixel> pixels(static_cast<std::size_t>(width) * height);
  Random random(3);
  for (std::size_t i = 0; i < pixels.size(); ++i)
  {
    ReferencePixel& pixel = pixels[i];
    const double limit = occluderDepth ? static_cast<double>(occluderDepth[i]) : INFINITY;
    const auto x = static_cast<double>(i % width), y = static_cast<double>(i / width);
    const std::vector<Fragment> fragments = CollectFragments(
      splats, lens.Radius > 0.0, context.Settings.Cutoff, x + 0.5, y + 0.5, pixel.Undecided);
    const ReferenceLayers layers = Composite(fragments, lens, limit, 0.0);
    std::copy(std::begin(layers.Color), std::end(layers.Color), pixel.Color);
    pixel.Color[3] = 1.0 - layers.Through;
    pixel.Depth = layers.Depth;
    pixel.Layers = layers.Leaks;
    pixel.MedianMargin = layers.MedianMargin;
    SetBounds(fragments, lens, limit, random, pixel);
  }
  return pixels;
}
}
