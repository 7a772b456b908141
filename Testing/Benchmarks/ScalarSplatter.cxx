// SPDX-License-Identifier: BSD-3-Clause
#include "ScalarSplatter.h"

#include <algorithm>
#include <cmath>

namespace SurfelSplatting
{
namespace
{
struct Fragment
{
  float Near, Far, Weight;
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
    return t * (t + s.Shape * (BellEdge + (1.0 - BellEdge) * t * t * t - t));
  }
  const double u = std::fmin(1.0, t * (s.Shape - SmoothShape));
  return u * u * (3.0 - 2.0 * u);
}

/// Front to back "over" of the unions of overlapping z-ranges.
void Composite(const std::vector<Splat>& splats, std::vector<Fragment>& fragments, float* rgba)
{
  std::sort(fragments.begin(), fragments.end(),
    [](const Fragment& a, const Fragment& b) { return a.Near < b.Near; });
  double transmittance = 1.0;
  double out[3] = { 0, 0, 0 };
  for (std::size_t i = 0; i < fragments.size();)
  {
    double weight = 0.0, opacity = 0.0, color[3] = { 0, 0, 0 };
    float far = fragments[i].Far;
    for (; i < fragments.size() && fragments[i].Near <= far; ++i)
    {
      const Splat& s = splats[fragments[i].Splat];
      const double opaque = static_cast<double>(fragments[i].Weight) * s.Opacity;
      weight += fragments[i].Weight;
      opacity += opaque;
      color[0] += opaque * s.Red;
      color[1] += opaque * s.Green;
      color[2] += opaque * s.Blue;
      far = std::max(far, fragments[i].Far);
    }
    const double share = transmittance / std::fmax(1.0, weight);
    for (int c = 0; c < 3; ++c)
    {
      out[c] += share * color[c];
    }
    transmittance -= share * opacity;
  }
  for (int c = 0; c < 3; ++c)
  {
    rgba[c] = static_cast<float>(out[c]);
  }
  rgba[3] = static_cast<float>(1.0 - transmittance);
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
            pixels[static_cast<std::size_t>(y) * frame.Width + x].push_back({ s.Near, s.Far,
              static_cast<float>(weight), static_cast<std::uint32_t>(splats.size()) });
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
