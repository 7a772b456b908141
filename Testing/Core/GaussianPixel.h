// SPDX-License-Identifier: BSD-3-Clause
/**
 * Gaussians in space in double, a pixel at a time. Kernels are in Core/Lens/GaussianFootprint.h and
 * ResamplingKernel.h.
 */
#pragma once

#include "Core/Lens/GaussianFootprint.h"
#include "Core/Lens/Lens.h"
#include "Core/Lens/LensVisibility.h"
#include "Core/Splats/Splat.h"
#include "Testing/Shared/Random.h"

#include <algorithm>
#include <cmath>

namespace SurfelSplatting
{
/// The lens of these tests.
constexpr LensShape Ellipse{ 2.0, 0.625, 0.5 };

struct PlacedGaussian
{
  Splat S{};
  SpaceFootprint Footprint{};
  float X = 0.0f, Y = 0.0f;
};

/// k of ResamplingKernelOf and of the mixture, by q and its end.
inline double Kernel(double shape, double q, double reach)
{
  const double x = std::max(0.0, 1.0 - q / reach);
  if (shape >= SmoothShape)
  {
    const double u = std::min(1.0, (shape - SmoothShape) * x);
    return u * u * (3.0 - 2.0 * u);
  }
  if (shape >= 0.0)
  {
    return x * ((1.0 - shape) * x + shape * (BellEdge + (1.0 - BellEdge) * x * x * x));
  }
  const double y = std::max(0.0, 1.0 - q / FocusBellReach);
  const double bell = FocusBellPeak * y * (BellEdge + (1.0 - BellEdge) * y * y * y);
  return (1.0 + shape) * bell - shape * std::exp(-0.5 * q);
}

/// A pixel behind the Gaussians so far.
struct Pixel
{
  double Through = 1.0, X = 0.0, Y = 0.0, Rim = 0.0, Across = 0.0, Diagonal = 0.0, Red = 0.0;
};

/// Relative error of the square of InverseRoot (Lanes.h).
constexpr double RootError = 1.3e-4;

/// What rounding changes, relative and in lens points; 0 for the evaluation itself.
struct Nudge
{
  SurfelTesting::Random* Draw = nullptr;

  double Of(double size) const { return this->Draw ? this->Draw->Uniform(-size, size) : 0.0; }
};

/// Roundings of the moments count, since the covariance is a difference, and the root of its
/// determinant, which decides the opacity and, with EllipseSlope, the border.
inline EllipseOnLens<double> OfEllipse(const Pixel& p, double x, double y, const Nudge& nudge)
{
  const double size = 1e-6;
  EllipseOnLens<double> e = ReconstructEllipse(p.Through * (1.0 + nudge.Of(size)),
    LensMoments<double>{ p.X + nudge.Of(size), p.Y + nudge.Of(size), p.Rim + nudge.Of(size),
      p.Across + nudge.Of(size), p.Diagonal + nudge.Of(size) },
    x, y);
  e.Opacity = std::min(1.0, e.Opacity * (1.0 + nudge.Of(0.5 * RootError)));
  e.Seen = std::clamp(1.0 - (1.0 - e.Seen) * (1.0 + nudge.Of(2.0 * RootError)), 0.0, 1.0);
  return e;
}

/// How T is reconstructed over the lens.
enum class SeenBy
{
  Mean,    ///< in focus
  Line,    ///< BroadGaussians.h
  Moments, ///< ramp and ellipse
};

/// A fragment on the lens, as points of the unit disc.
struct LensFragment
{
  double X, Y;
  double XX, XY, YY; ///< share L
  double Mean;

  LensFragment(const PlacedGaussian& g, double dx, double dy, const Nudge& nudge)
  {
    const Splat& s = g.S;
    const double quarter = g.Footprint.Quarter;
    const double mx = quarter * s.A * (dx + s.K * dy), my = s.K * mx + quarter * s.B * dy;
    const double square = 4.0 * quarter * quarter;
    const double aa = square * s.A, ab = aa * s.K, bb = square * (s.A * s.K * s.K + s.B);
    const LensShape r = Ellipse.Root();
    this->X = r.XX * mx + r.XY * my + nudge.Of(2e-6);
    this->Y = r.XY * mx + r.YY * my + nudge.Of(2e-6);
    this->XX = r.XX * r.XX * aa + 2.0 * r.XX * r.XY * ab + r.XY * r.XY * bb;
    this->YY = r.XY * r.XY * aa + 2.0 * r.XY * r.YY * ab + r.YY * r.YY * bb;
    this->XY = r.XX * r.XY * aa + (r.XX * r.YY + r.XY * r.XY) * ab + r.XY * r.YY * bb;
    this->Mean = std::min(1.0, 0.5 * (this->XX + this->YY));
  }
};

/// What is seen of a fragment, where the moments count.
inline double SeenByMoments(
  const Pixel& p, const LensFragment& u, float inFocus, const Nudge& nudge)
{
  const double dot = (p.X * u.X + p.Y * u.Y) * (1.0 + nudge.Of(1.5 * RootError));
  const double line = p.Through + 4.0 * (p.X * u.X + p.Y * u.Y);
  const double spread =
    p.X * ((1.0 - u.XX) * p.X - u.XY * p.Y) + p.Y * ((1.0 - u.YY) * p.Y - u.XY * p.X);
  const double squared = (p.X * p.X + p.Y * p.Y) * (1.0 + nudge.Of(2.0 * RootError));
  const float mean = static_cast<float>(u.Mean);
  const double sharp =
    ReconstructRamp<double>(p.Through, { squared, dot, spread }, BlurOfRamp(mean));
  const double ramp = std::clamp(0.5 + (sharp - 0.5) * (1.0 + nudge.Of(RootError)), 0.0, 1.0);
  const EllipseOnLens<double> ellipse = OfEllipse(p, u.X, u.Y, nudge);
  const double seen = line + WeightOfRamp(mean) * (ramp - line);
  return SeenBetween(seen, ellipse.Seen, WeightOfEllipse(mean, inFocus) * ellipse.Opacity);
}

/// Takes what a fragment hides from moments over which T is linear.
inline void HideFromLine(Pixel& p, const LensFragment& u, double alpha, double hides)
{
  const double x = p.X, y = p.Y, keep = 1.0 - alpha;
  p.X = keep * x + alpha * (u.XX * x + u.XY * y) - hides * u.X;
  p.Y = keep * y + alpha * (u.XY * x + u.YY * y) - hides * u.Y;
  p.Rim *= keep;
  p.Across *= keep;
  p.Diagonal *= keep;
  p.Through = std::max(0.0, p.Through - hides);
}

/// Limits the moments to what T may have, as of all pixels of a block.
/// @return squared length of the first before
inline double LimitMoments(Pixel& p, const Nudge& nudge)
{
  const double most = p.Through * (1.0 - p.Through);
  for (double* moment : { &p.Rim, &p.Across, &p.Diagonal })
  {
    *moment = std::clamp(*moment, -most, most);
  }
  const double squared = p.X * p.X + p.Y * p.Y;
  const double shorten = std::min(
    1.0, LargestMoment(p.Through) / std::sqrt(squared + 1e-40) * (1.0 + nudge.Of(RootError)));
  p.X *= shorten;
  p.Y *= shorten;
  return squared;
}

/// The same of all moments, which are limited.
/// @param border SharpnessOfBorder
/// @return squared length of the first before
inline double HideFromMoments(
  Pixel& p, const LensFragment& u, double alpha, double hides, double border, const Nudge& nudge)
{
  const double perBefore = 1.0 / std::max(p.Through, 1e-6);
  const double keep = 1.0 - std::min(1.0, (1.0 - u.Mean) * hides * perBefore);
  const double kept = std::max(0.0, p.Through - hides) * perBefore;
  const double slope = std::min(alpha, 4.0 * hides * perBefore);
  const double vx = slope * ((1.0 - u.XX) * p.X - u.XY * p.Y);
  const double vy = slope * ((1.0 - u.YY) * p.Y - u.XY * p.X);
  p.Through = std::max(0.0, p.Through - hides);
  p.X -= hides * u.X + vx;
  p.Y -= hides * u.Y + vy;
  const double rim = 2.0 * (u.X * u.X + u.Y * u.Y) - u.Mean;
  const double across = u.X * u.X - u.Y * u.Y - 0.25 * (u.XX - u.YY);
  const double diagonal = 2.0 * u.X * u.Y - 0.5 * u.XY;
  const auto behind = [&](double moment, double hidden, double tilt) {
    const double sharp = keep * moment - hides * hidden - tilt;
    return kept * moment + border * (sharp - kept * moment);
  };
  p.Rim = behind(p.Rim, rim, 4.0 * (u.X * vx + u.Y * vy));
  p.Across = behind(p.Across, across, 2.0 * (u.X * vx - u.Y * vy));
  p.Diagonal = behind(p.Diagonal, diagonal, 2.0 * (u.X * vy + u.Y * vx));
  return LimitMoments(p, nudge);
}

/// @return squared length of the first moment before it is limited
inline double AddTo(
  Pixel& p, const PlacedGaussian& g, double dx, double dy, SeenBy by, const Nudge& nudge)
{
  const Splat& s = g.S;
  const double q = s.A * (dx + s.K * dy) * (dx + s.K * dy) + s.B * dy * dy;
  const double w = s.Weight * Kernel(s.Shape, q, s.DepthX) * (1.0 + nudge.Of(2e-6));
  const double alpha =
    (1.0 - s.Opacity) * std::min<double>(w, MaxOpacity) - s.Opacity * std::expm1(-w);
  const LensFragment u(g, dx, dy, nudge);
  double seen = p.Through;
  if (by == SeenBy::Line)
  {
    seen += 4.0 * (p.X * u.X + p.Y * u.Y);
  }
  else if (by == SeenBy::Moments)
  {
    seen = SeenByMoments(p, u, g.Footprint.Opacity, nudge);
  }
  const double hides = by == SeenBy::Mean
    ? alpha * p.Through
    : VisibleShare(p.Through, LayerCoverage<double>{ 1.0, alpha, alpha * seen });
  const double red = s.Red + g.Footprint.RedX * dx + g.Footprint.RedY * dy + nudge.Of(1e-6);
  p.Red += hides * std::max(0.0, red);
  if (by == SeenBy::Line)
  {
    HideFromLine(p, u, alpha, hides);
    return p.X * p.X + p.Y * p.Y;
  }
  const double border =
    SharpnessOfBorder(WeightOfEllipse(static_cast<float>(u.Mean), g.Footprint.Opacity));
  return HideFromMoments(p, u, alpha, hides, border, nudge);
}
}
