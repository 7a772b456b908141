// SPDX-License-Identifier: BSD-3-Clause
#include "ScalarSplatter.h"

#include "Core/Lens/LayerLeaks.h"

#include <algorithm>
#include <cmath>

namespace SurfelSplatting
{
namespace
{
struct Fragment
{
  float Near, Weight, Depth;
  std::uint32_t Splat;
};

double Evaluate(const Splat& s, double q, double support)
{
  if (s.Shape < 0.0f)
  {
    return std::exp(-0.5 * q);
  }
  const double t = 1.0 - q / support;
  if (s.Shape < static_cast<float>(SmoothShape))
  {
    const BellWeights<double> bell = BellOf<double>(s.Shape);
    return t * (bell.Edge + t * (bell.Square + bell.Fourth * t * t));
  }
  const double u = std::fmin(1.0, t * (s.Shape - SmoothShape));
  return u * u * (3.0 - 2.0 * u);
}

/// Layers do not leak over gaps of fewer bands (Core/Raster/LayerMerging.h).
constexpr double LeastGap = 1.0 / 32.0;

/// The open layer of a pixel and what is finished, in focus (ABuffer.h, LayerLeaks.h).
struct Pixel
{
  double Weight = 0.0, Opacity = 0.0, Color[3] = { 0, 0, 0 }, Far = 0.0;
  double Depth = 0.0, Gaps = 0.0; ///< sums with the weights
  double Through = 1.0, Out[3] = { 0, 0, 0 };

  void LeakTo(double keep)
  {
    const LayerCoverage<double> layer{ this->Weight, this->Opacity, this->Through * this->Opacity };
    const LayerLeak<double> leak = Leak(this->Through, layer, keep);
    for (int c = 0; c < 3; ++c)
    {
      this->Out[c] += leak.Share * this->Through * this->Color[c];
      this->Color[c] *= leak.Opacity;
    }
    this->Through = leak.Through;
    this->Weight *= leak.Weight;
    this->Depth *= leak.Weight;
    this->Gaps *= leak.Weight;
    this->Opacity *= leak.Opacity;
  }

  void Add(const Splat& s, double weight, double depth)
  {
    double begin = this->Weight > 0.0 ? std::fmax(this->Far, s.Near) : s.Near;
    if (this->Weight > LeastLeakingWeight && this->Far < s.Near)
    {
      const double behind = GapOfLayer(this->Weight) * (s.Near - this->Far);
      const double share = LeakingShare(weight);
      const double length = this->Far - (this->Depth + this->Gaps) / this->Weight;
      const double band = 0.5 * (s.Far - s.Near) + 0.5 * std::fmax(length, 0.0);
      const double bands = share * std::fmin(behind / std::fmax(band, 1e-30), 64.0);
      const bool leaks = bands > LeastGap;
      if (leaks)
      {
        this->LeakTo(std::exp(-bands));
      }
      begin -= (leaks ? 1.0 - share : 1.0) * behind;
      this->Gaps += this->Weight * (begin - this->Far);
    }
    const double reach = std::fmin(1.0, weight / WeightOfReach);
    this->Far = begin + reach * std::fmax(0.0, s.Far - begin);
    weight *= std::clamp((1.0 + RippleInFocus - this->Weight) / RippleInFocus, 0.0, 1.0);
    this->Weight += weight;
    this->Depth += weight * depth;
    this->Opacity += weight * s.Opacity;
    this->Color[0] += weight * s.Opacity * s.Red;
    this->Color[1] += weight * s.Opacity * s.Green;
    this->Color[2] += weight * s.Opacity * s.Blue;
  }
};

/// Front to back, by ascending near depth.
void Composite(const std::vector<Splat>& splats, std::vector<Fragment>& fragments, float* rgba)
{
  std::sort(fragments.begin(), fragments.end(),
    [](const Fragment& a, const Fragment& b) { return a.Near < b.Near; });
  Pixel pixel;
  for (const Fragment& f : fragments)
  {
    const Splat& s = splats[f.Splat];
    pixel.Add(s, f.Weight, f.Depth);
  }
  pixel.LeakTo(0.0);
  for (int c = 0; c < 3; ++c)
  {
    rgba[c] = static_cast<float>(pixel.Out[c]);
  }
  rgba[3] = static_cast<float>(1.0 - pixel.Through);
}
}

void RenderScalar(
  const SplatContext& context, const std::vector<SurfelCloud>& clouds, const Frame& frame)
{
  const TruncatedGaussian gaussian(context.Settings.Cutoff);
  SplatContext fine = context;
  fine.CoarseGrids = false;
  std::vector<Splat> splats;
  std::vector<std::vector<Fragment>> pixels(static_cast<std::size_t>(frame.Width) * frame.Height);
  for (const SurfelCloud& cloud : clouds)
  {
    SplatMaker maker;
    maker.Set(fine, cloud, SetupTargetScalar);
    for (std::size_t i = 0; i < cloud.NumberOfSurfels; ++i)
    {
      Splat s;
      PixelBox box;
      float near;
      SplatOutput output{ &s, &box, &near, nullptr, nullptr, nullptr, 0 };
      maker.Make({ i, 1, 0 }, output);
      if (output.Count == 0)
      {
        continue;
      }
      for (int y = box.Y0; y < box.Y1; ++y)
      {
        for (int x = box.X0; x < box.X1; ++x)
        {
          const double dx = x + 0.5 - s.X, dy = y + 0.5 - s.Y, u = dx + s.K * dy;
          const double q = s.A * u * u + s.B * dy * dy;
          if (q < gaussian.Support())
          {
            const double weight = s.Weight * Evaluate(s, q, gaussian.Support());
            const double depth = 0.5 * (s.Near + s.Far) + s.DepthX * dx + s.DepthY * dy;
            pixels[static_cast<std::size_t>(y) * frame.Width + x].push_back(
              { s.Near, static_cast<float>(weight), static_cast<float>(depth),
                static_cast<std::uint32_t>(splats.size()) });
          }
        }
      }
      splats.push_back(s);
    }
  }
  for (std::size_t i = 0; i < pixels.size(); ++i)
  {
    Composite(splats, pixels[i], frame.Color + 4 * i);
  }
}
}
