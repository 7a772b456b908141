// SPDX-License-Identifier: BSD-3-Clause
/**
 * What covers which part of the lens: visibility by sectors.
 *
 * One picture takes the visibility of different layers over the lens for independent: of two layers
 * that cover half of it each, a quarter of the light behind passes, whether they cover the same
 * half (truly one half) or different ones (truly none). But a fragment says where it passes: d px
 * off its splat's centre, in the mean at
 *
 *   u = M d,   M = C / (4 sqrt(det W)),   C signed: negative in front of the focus
 *
 * in units of the lens's radius (the regression of C u, of variance C^2/4, on the footprint's W):
 * on one side of a wide blur, anywhere in focus. Four sectors, (+-1, +-1), share the fragment out,
 *
 *   f(s_x u_x) f(s_y u_y),   f(t) = 1/2 + t, clamped to [0, 1],
 *
 * which sums to 1 and over the disc of the lens to 1/4 each. Every sector has layers of its own, of
 * four times these weights, and the pixel is the mean of the four: what covers one side of the lens
 * does not hide what is seen through the other. A fragment in focus is the same in all four.
 *
 * Seen from one side of the lens, a tilted surfel covers more than from the other (Lens.h,
 * MeanAperturePoint); here its weight is that of the side, times 1 + 4 m.u for the mean m, and its
 * centre stays.
 */
#pragma once

namespace SurfelSplatting
{
constexpr int NumberOfSectors = 4;
constexpr int WholeLens = NumberOfSectors; ///< index of all sectors together

/// Signs of a sector; both 0: the whole lens.
struct LensSector
{
  float X = 0.0f, Y = 0.0f;
};

inline LensSector SectorOf(int index)
{
  if (index == WholeLens)
  {
    return {};
  }
  return { index % 2 == 0 ? -1.0f : 1.0f, index / 2 == 0 ? -1.0f : 1.0f };
}

/// Where the light of a splat passes the lens, over its footprint; per px, or per cell of a coarse
/// grid.
struct LensSlope
{
  float Point;        ///< M: the mean lens point is Point (dx, dy)
  float TiltX, TiltY; ///< the weight's factor is 1 + TiltX dx + TiltY dy, at least 0
};

/// A tile is drawn once for the whole lens, and again in sectors where they would change it: where
/// the lens points of a splat's footprint differ by the one, and more of the light than the other
/// depends on what covers which part of the lens. 0 for the other: sectors everywhere.
constexpr float LeastLensSpread = 0.02f;
constexpr float DefaultLeastConflict = 1.0f / 128.0f;
}
