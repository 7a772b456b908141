// SPDX-License-Identifier: BSD-3-Clause
/**
 * Visibility by sectors of the lens: tracks what covers which part of the lens.
 *
 * A single picture treats the visibility of different layers over the lens as independent. If two
 * layers cover half of the lens each, a quarter of the light behind them passes, although it should
 * be one half where they cover the same half, and nothing where they cover different ones. But a
 * fragment's place tells where its light passes through the lens. At d px from the centre of its
 * splat, the mean point is
 *
 *   u = M d,   M = C / (4 sqrt(det W)),   C signed: negative in front of the focus
 *
 * in units of the lens's radius (the regression of C u, of variance C^2/4, on the footprint's W).
 * In a wide blur this is on one side of the lens; in focus it is anywhere. The fragment is divided
 * among four sectors (s_x, s_y) = (+-1, +-1) with the shares
 *
 *   f(s_x u_x) f(s_y u_y),   f(t) = 1/2 + t, clamped to [0, 1],
 *
 * whose sum is 1 and whose means over the lens are 1/4 each. Each sector has its own layers, with
 * four times these weights, and the pixel is the mean of the four sectors: what covers one side of
 * the lens does not hide what is seen through the other. A fragment in focus is the same in all
 * four.
 *
 * A tilted surfel covers more from one side of the lens than from the other (Lens.h,
 * MeanAperturePoint). With sectors, its centre stays, and its weight is multiplied by 1 + 4 m.u,
 * where m is that mean.
 */
#pragma once

namespace SurfelSplatting
{
constexpr int NumberOfSectors = 4;
constexpr int WholeLens = NumberOfSectors; ///< index of all sectors together

/// Signs s_x, s_y of a sector; both 0: the whole lens.
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

/// How the mean aperture point and the weight change over a splat's footprint, per px, or per cell
/// of a coarse grid.
struct LensSlope
{
  float Point;        ///< M: the mean aperture point u is Point (dx, dy)
  float MeanX, MeanY;
  float TiltX, TiltY; ///< the weight's factor is 1 + TiltX dx + TiltY dy, at least 0
};

/// A tile is drawn once for the whole lens. It is drawn again in sectors if these would change it:
/// if the aperture points of a splat's footprint differ by MinLensSpread, and more than a share
/// SplatContext::MinConflict of the light depends on what covers which part of the lens. A
/// MinConflict of 0 means sectors everywhere.
constexpr float MinLensSpread = 0.02f;
constexpr float DefaultMinConflict = 1.0f / 128.0f;
}
