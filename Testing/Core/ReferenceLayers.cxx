// SPDX-License-Identifier: BSD-3-Clause
#include "ReferenceLayers.h"

#include <algorithm>
#include <cmath>

namespace SurfelSplatting
{
double ReferenceLargestMoment(double mean)
{
  const double p = std::max(0.0, mean * (1.0 - mean));
  return p / (1.0 + 0.355 * std::sqrt(p));
}

double ReferenceLargestCover(double centroid)
{
  const double series[] = { -0.86426, 1.0486, -0.94003, -0.03396, 1.0 };
  double p = 0.0;
  for (const double a : series)
  {
    p = p * centroid + a;
  }
  return std::max(0.01, (1.0 - centroid) * p);
}

/// That of the layer's centroid without the excess over full coverage; less of it near the centre,
/// up to 0.8.
double ReferenceLayers::LargestCover() const
{
  if (this->Lens.Radius == 0.0 || this->Weight == 0.0)
  {
    return 1.0;
  }
  const double excess = std::max(0.0, this->Weight - 1.0);
  const double moment = std::hypot(this->Fill[0], this->Fill[1]);
  const double centroid = std::max(0.0, moment - 0.5 * excess) / std::min(1.0, this->Weight);
  return ReferenceLargestCover(
    std::min(std::pow(centroid, 3) / (centroid * centroid + 0.0016), 0.8));
}

double ReferenceLayers::VisibleShare() const
{
  const double shrink = std::min(1.0, this->LargestCover() / std::max(this->Weight, 1e-300));
  const double alpha = shrink * this->Opacity;
  const double overlap = std::max(0.0, this->Through + alpha - 1.0);
  return std::min({ std::max(shrink * this->Seen, overlap), this->Through, alpha });
}

void ReferenceLayers::Prepare(const ReferenceFragment& f)
{
  double begin = std::max(this->Far, f.Near);
  if (this->Weight > 1.0 / 256.0 && f.Near > this->Far && this->Through > 1.0 / 512.0)
  {
    const double heavy = std::min(1.0, (this->Weight - 1.0 / 256.0) / (3.0 / 256.0));
    const double behind = heavy * (f.Near - this->Far);
    const double root = std::max(0.0, 1.0 - f.Weight / 0.002);
    const double left = root * root * root * root;
    const double z = 0.5 * (f.Near + f.Far);
    const double blur =
      this->Lens.Radius * std::abs(z - this->Lens.FocalDistance) / this->Lens.FocalDistance;
    const double mean = (1.0 + this->Nudge) * (this->DepthSum + this->Gaps) / this->Weight;
    const double length = std::max(0.0, this->Far - mean);
    const double ofItem = std::max(0.125 * blur + 0.5 * (f.Far - f.Near), 1e-30);
    const double band = ofItem + (f.IsTent ? 0.2 : 0.5) * length;
    const double gap = (1.0 - left) * std::min(behind / band, 64.0);
    const bool leaks = gap > 1.0 / 32.0;
    if (leaks)
    {
      this->Leak(gap < LargestGap ? std::exp(-gap) : 0.0);
    }
    begin -= this->Weight > 1.0 / 256.0 ? (leaks ? left * behind : behind) : 0.0;
    this->Gaps += this->Weight * (begin - this->Far);
  }
  if (f.IsTent)
  {
    this->Far = f.Far; // of one tent
    return;
  }
  const double begins = std::max(0.0, 1.0 - 2.0 * this->Weight);
  const double rim = std::clamp(6.0 - 5.0 * (f.U[0] * f.U[0] + f.U[1] * f.U[1]), 0.0, 1.0);
  const double share = f.OnLens ? rim * std::min(1.0, 5.0 * f.Kernel + begins) : 1.0;
  const double reach = std::min(1.0, share * f.Weight / 0.004);
  this->Far = begin + reach * std::max(0.0, f.Far - begin);
}

/// The moments of a layer that T was the same for, by its mean opacity.
void ReferenceLayers::Tilt()
{
  for (int k = 0; k < 2 && this->Flat && !this->HasLeaked; ++k)
  {
    this->SeenU[k] = this->Weight > 0.0 ? this->Seen / this->Weight * this->Fill[k] : 0.0;
  }
  this->Flat = false;
}

namespace
{
/// What tents add: w' = -room(f)^2 with room from 1 at f = 1.1 to 0 at 1.3, by small steps.
double AddInParts(double weight, double fill)
{
  constexpr int steps = 100000;
  double added = 0.0;
  for (int i = 0; i < steps; ++i)
  {
    const double room = std::clamp((1.3 - fill - added) / 0.2, 0.0, 1.0);
    added += room * room * weight / steps;
  }
  return added;
}
}

void ReferenceLayers::Append(const ReferenceFragment& f)
{
  const double fill =
    this->Weight + 2.4 * (this->Fill[0] * f.U[0] + this->Fill[1] * f.U[1]) * (f.OnLens ? 1 : 0);
  const double full = f.OnLens ? 1.25 : 1.1;
  const double room = std::max(0.0, full - fill);
  const double limited = f.Weight * std::min(1.0, room / (full - 1.0));
  const double weight = f.IsTent ? AddInParts(f.Weight, fill)
    : f.OnLens                   ? std::min(limited, room)
                                 : limited;
  const double tilt[] = { this->Flat ? 0.0 : 4.0 * this->ThroughU[0],
    this->Flat ? 0.0 : 4.0 * this->ThroughU[1] };
  const double linear = this->Through + 1.25 * (tilt[0] * f.U[0] + tilt[1] * f.U[1]);
  const double curved = linear + (this->Flat ? 0.0 : this->Bend(f));
  const double seen =
    f.OnLens ? std::min(1.0, std::max(0.02 * this->Through, curved)) : this->Through;
  const double opaque = weight * f.Opacity;
  this->HasLeaked = false;
  this->Weight += weight;
  this->Opacity += opaque;
  this->DepthSum += weight * f.Depth;
  this->Seen += opaque * seen;
  for (int k = 0; k < 3; ++k)
  {
    this->SeenColor[k] +=
      opaque * (seen * f.Color[k] + 1.125 * (tilt[0] * f.ColorU[k][0] + tilt[1] * f.ColorU[k][1]));
  }
  for (int k = 0; k < 2 && f.OnLens; ++k)
  {
    this->Fill[k] += weight * f.U[k];
    this->SeenU[k] +=
      opaque * (seen * f.U[k] + 1.125 * (tilt[0] * f.UU[0][k] + tilt[1] * f.UU[1][k]));
  }
}

/// Half of the terms of the second degree of T, over the points that the fragment is seen through.
double ReferenceLayers::Bend(const ReferenceFragment& f) const
{
  const double own = 0.25 * (1.0 - f.Share);
  const double x = f.U[0], y = f.U[1];
  const double xx = x * x + (f.IsTent ? f.UU[0][0] : own);
  const double yy = y * y + (f.IsTent ? f.UU[1][1] : own);
  const double xy = x * y + (f.IsTent ? f.UU[0][1] : 0.0);
  const double* m = this->ThroughUU;
  return 1.5 * m[0] * (2.0 * (xx + yy) - 1.0) + 3.0 * (m[1] * (xx - yy) + m[2] * 2.0 * xy);
}

/// Takes a segment of the lens from the moments of T. @param x,y its first moment
void ReferenceLayers::Hide(double hidden, double x, double y)
{
  const double length = std::hypot(x, y), c = std::min(1.0, length / std::max(hidden, 1e-12));
  const double second = length * (-0.8952 + c * (2.4193 + c * (-0.87468 + c * 0.35441)));
  const double nx = length > 0.0 ? x / length : 0.0, ny = length > 0.0 ? y / length : 0.0;
  this->ThroughU[0] -= x;
  this->ThroughU[1] -= y;
  const double parts[] = { second, second * (nx * nx - ny * ny), second * 2.0 * nx * ny };
  const double most = this->Through * (1.0 - this->Through);
  for (int k = 0; k < 3; ++k)
  {
    this->ThroughUU[k] = std::clamp(this->ThroughUU[k] - parts[k], -most, most);
  }
}

/// Adds the share of the open layer's sums to the finished ones.
void ReferenceLayers::Composite(double share, double after)
{
  this->Last.Depth = this->DepthSum / this->Weight;
  this->Last.Alpha = this->Through - after;
  for (int k = 0; k < 3; ++k)
  {
    this->Last.Color[k] = share * std::max(0.0, this->SeenColor[k]);
    this->Color[k] += this->Last.Color[k];
  }
  if (this->Through > 0.5 && after <= 0.5)
  {
    this->Depth = this->Last.Depth;
  }
  this->MedianMargin = std::min(this->MedianMargin, std::abs(after - 0.5));
  const double hidden = std::max(0.0, this->Through - after);
  this->Through = after;
  this->Hide(hidden, share * this->SeenU[0], share * this->SeenU[1]);
  const double length = std::hypot(this->ThroughU[0], this->ThroughU[1]);
  const double longest = ReferenceLargestMoment(after);
  for (double& moment : this->ThroughU)
  {
    moment *= length > longest ? longest / length : 1.0;
  }
  this->Tilted = this->Tilted || length > 0.0;
  ++this->Leaks;
  this->FaintLeaks += after < 1.0 / 512.0 ? 1 : 0;
}

/// The layer's centroid stays, and with it LargestCover.
void ReferenceLayers::Shrink(double factor)
{
  const double before = this->Weight, after = factor * before;
  const double moment = std::hypot(this->Fill[0], this->Fill[1]);
  const double centroid =
    std::max(0.0, moment - 0.5 * std::max(0.0, before - 1.0)) / std::min(1.0, before);
  const double wanted = centroid * std::min(1.0, after) + 0.5 * std::max(0.0, after - 1.0);
  const double shrink = moment > 0.0 ? std::min(factor, wanted / moment) : factor;
  this->Fill[0] *= shrink;
  this->Fill[1] *= shrink;
  this->Weight = after;
  this->DepthSum *= factor;
  this->Gaps *= factor;
}

void ReferenceLayers::Leak(double keep)
{
  if (this->Weight <= 0.0)
  {
    return;
  }
  if (this->Flat)
  {
    this->Tilt();
    this->Flat = this->HasLeaked = true;
  }
  // T' (1 - a') = T (1 - a), a' = keep a / h, T' = T h^4
  const double all = this->VisibleShare();
  const double cover = this->Through > 0.0 ? all / this->Through : 0.0;
  const double left = std::clamp(1.0 - cover + this->Nudge, 0.0, 1.0);
  const double stays = keep * (1.0 - left);
  double low = 0.0, h = 1.0;
  while (h - low > 1e-15) // by bisection
  {
    const double middle = 0.5 * (low + h);
    (middle * middle * middle * (middle - stays) < left ? low : h) = middle;
  }
  const double rest = left > 0.0 || stays > 0.0 ? h * h * h * h : 0.0;
  const double after = rest * this->Through;
  const double weight = rest > 0.0 ? std::min(1.0, keep / h) : 0.0;
  const double filled = this->Weight / this->LargestCover();
  const double opacity = weight * std::max(1.0, weight * filled) / std::max(1.0, filled);
  // What stays is seen as much as v says, which may be one of Frechet's bounds.
  double seen = this->Seen > 0.0 ? rest * all * std::max(1.0, filled) / this->Seen : rest;
  if (this->DepthSum <= this->Limit * this->Weight)
  {
    this->Composite(this->Seen > 0.0 ? (this->Through - after) / this->Seen : 0.0, after);
  }
  else
  {
    seen = 1.0;
  }
  this->Shrink(weight);
  this->Opacity *= opacity;
  for (double* sum : { &this->Seen, &this->SeenU[0], &this->SeenU[1], &this->SeenColor[0],
         &this->SeenColor[1], &this->SeenColor[2] })
  {
    *sum *= opacity * seen;
  }
}
}
