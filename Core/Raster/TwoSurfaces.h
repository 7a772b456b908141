// SPDX-License-Identifier: BSD-3-Clause
/**
 * Two surfaces in one layer of a coarse grid. (Its use is ours; Documentation/Method.md.)
 *
 * A cell's layer ends at a gap in depth. A few splats of hardly any weight between two surfaces
 * bridge the gap: the cell has one layer then, and its neighbour, or the next frame, has two.
 * Pictures would jump there, since surfaces of one layer add up, and those of two hide one another.
 * So a layer whose depths are those of two surfaces is drawn as two.
 *
 * The depths are taken for a mixture of two normal distributions of one standard deviation, fitted
 * by the method of moments (Pearson 1894). Let V, s and k be the layer's variance, skewness and
 * kurtosis, and r the share of V that is due to the distance between the two. Normal distributions
 * have no cumulants above the second, and for two points k = 1 + s^2, so that
 *
 *   k - 1 - s^2 = 2 (1 - r^2) + s^2 (1 / r - 1)
 *
 * The two means have the variance r V and the skewness s / r^(3/2), which give their distance and
 * their weights.
 */
#pragma once

#include "Core/Lens/LensVisibility.h"
#include "Core/Raster/LayerDepths.h"

#include <algorithm>
#include <cmath>

namespace SurfelSplatting
{
/// A layer is one surface if its deviation is shorter than so many errors of its depth.
constexpr double LeastErrors = 200.0;

/// So is one whose mean is more than so many deviations behind its near end: its sums of float have
/// lost the digits of the fourth moment.
constexpr double MostDeviations = 8.0;

/// So is one whose fourth powers of depth have lost digits to underflow: shorter than some 3e-8
/// world units. (Of more than 4e9 units they are infinite, and it is one as well.)
constexpr float SmallestFourthPower = 1e-30f;

/// What LeastApart is for r, for the lighter surface's share of the weight: tails of kernels are
/// light, and with 0.05 a bunny at 36 px without level of detail loses 0.2 dB.
constexpr float LeastPart = 0.1f, FullPart = 0.2f;

/// From this weight of the lighter one on, all of the gap counts.
constexpr float WeightOfGap = 0.03f;

/// The mixture with the layer's first four moments.
struct TwoNormals
{
  float Apart;       ///< r
  float FrontWeight; ///< share of the weight
  float Front, Back; ///< their means, from the layer's
  float Deviation;   ///< of each
};

/// @return false unless r > LeastApart, and the z-ranges of the splats may leave a gap
inline bool FitTwoNormals(const LayerDepths& layer, TwoNormals& fit)
{
  const double inverse = 1.0 / layer.Weight, mean = layer.First * inverse;
  const double second = layer.Squared * inverse, variance = second - mean * mean;
  const double shortest = std::max(LeastErrors * DepthRounding * layer.Mean, mean / MostDeviations);
  if (!(variance > shortest * shortest) || !(layer.Fourth > SmallestFourthPower))
  {
    return false;
  }
  const double third = layer.Cubed * inverse, fourth = layer.Fourth * inverse;
  const double central3 = third - mean * (3.0 * second - 2.0 * mean * mean);
  const double central4 = fourth - mean * (4.0 * third - mean * (6.0 * second - 3.0 * mean * mean));
  // Both sides of the equation, times the cube of the variance.
  const double cube = variance * variance * variance, squared = central3 * central3;
  const double range = 2.0 * layer.HalfRange * variance;
  if (!(4.0 * cube + squared > range * range))
  {
    return false; // with r = 1 they would be no farther apart than the z-ranges are long
  }
  const double left = central4 * variance - cube - squared;
  constexpr double least = LeastApart;
  if (!(left < 2.0 * (1.0 - least * least) * cube + (1.0 / least - 1.0) * squared))
  {
    return false;
  }
  const double perCube = 1.0 / cube, s2 = squared * perCube, known = left * perCube;
  double r = 1.0; // Newton's method: two steps are off by 0.001 at most
  for (int i = 0; i < 2; ++i)
  {
    const double perShare = 1.0 / r;
    const double right = 2.0 * (1.0 - r * r) + s2 * (perShare - 1.0);
    const double step = (right - known) / (4.0 * r + s2 * perShare * perShare);
    r = std::min(std::max(r + step, least), 1.0);
  }
  const double deviation = std::sqrt(variance * r);
  const double half = 0.5 * central3 / (deviation * deviation * deviation);
  const double root = std::sqrt(1.0 + half * half);
  fit = { static_cast<float>(r), static_cast<float>(0.5 * (1.0 + half / root)),
    static_cast<float>(deviation * (half - root)), static_cast<float>(deviation * (half + root)),
    static_cast<float>(std::sqrt(variance * (1.0 - r))) };
  return true;
}

/// How far x is on its way from low to high, at most 1.
inline float ShareOfWay(float x, float low, float high)
{
  return std::min((x - low) / (high - low), 1.0f);
}

/// Share of the gap between the two surfaces that counts, > 0 if the layer is split. Full layers
/// have lost some of the farther surface (LimitWeight), but in front of it the nearer one hides
/// nearly all.
inline float GapThatCounts(const LayerDepths& layer, const TwoNormals& fit)
{
  const float lighter = std::min(fit.FrontWeight, 1.0f - fit.FrontWeight);
  if (!(lighter > LeastPart))
  {
    return 0.0f;
  }
  return ShareOfWay(fit.Apart, LeastApart, 1.0f) * ShareOfWay(lighter, LeastPart, FullPart) *
    std::min(lighter * layer.Weight / WeightOfGap, 1.0f);
}

/**
 * Splits a layer where there is a gap between its two surfaces. The gap that is left between the
 * z-ranges of the parts changes continuously with the moments, from 0 on. As long as little of it
 * counts, the parts' z-ranges are together that of the whole, which may begin behind the front
 * part's mean depth if this part is light.
 * @param whole WholeLayer
 * @param parts the front one first; their weights and mean depths are together the layer's
 * @return whether there are two; otherwise the parts are unchanged
 */
inline bool SplitLayer(
  const LayerDepths& layer, const LayerPart& whole, TwoNormals& fit, LayerPart (&parts)[2])
{
  if (!FitTwoNormals(layer, fit))
  {
    return false;
  }
  const float half = layer.HalfRange + RangePerDeviation * fit.Deviation;
  const float gap = fit.Back - fit.Front - 2.0f * half, counts = GapThatCounts(layer, fit);
  if (!(gap > 0.0f) || !(counts > 0.0f))
  {
    return false;
  }
  const float bridge = 0.5f * (1.0f - counts) * gap;
  const float front = layer.Mean + fit.Front, back = layer.Mean + fit.Back;
  parts[0] = { layer.Weight * fit.FrontWeight, front,
    whole.Near + counts * (front - half - whole.Near), front + half + bridge };
  parts[1] = { layer.Weight * (1.0f - fit.FrontWeight), back, back - half - bridge,
    whole.Far + counts * (back + half - whole.Far) };
  return true;
}

/// Means of something, such as a colour, over the two surfaces.
struct PartMeans
{
  float Front, Back;
};

/**
 * By the covariance with depth, that of the two means if each surface has one value. Neither is
 * negative, and together they are the layer's.
 * @param mean       over the layer; both have it if it is not positive
 * @param covariance with depth
 */
inline PartMeans SplitMean(float mean, float covariance, const TwoNormals& fit)
{
  if (!(mean > 0.0f))
  {
    return { mean, mean };
  }
  const float front = fit.FrontWeight, back = 1.0f - front;
  // The variance of the two means is -Front Back.
  const float shifted = mean - covariance / fit.Back;
  const float inFront = std::min(std::max(shifted, 0.0f), mean / front);
  return { inFront, std::max((mean - front * inFront) / back, 0.0f) };
}

/// Points of the lens, a unit disc, through which the two surfaces are seen on average.
struct PartPoints
{
  float FrontX, FrontY, BackX, BackY;
};

/// Longest way s in (dx, dy), at most 1, from (x, y) that does not leave the disc of a radius.
inline float WayInDisc(float x, float y, float dx, float dy, float radius)
{
  const float squared = dx * dx + dy * dy, along = x * dx + y * dy;
  const float left = radius * radius - x * x - y * y;
  if (!(left > 0.0f) || !(squared > 0.0f))
  {
    return 0.0f;
  }
  return std::min((std::sqrt(along * along + squared * left) - along) / squared, 1.0f);
}

/**
 * By the covariance with depth. The surfaces are no farther off the lens's middle than segments of
 * it that cover as much: covariances are uncertain, and layers at the rim cover little
 * (LargestCoverOfLayer). Together they have the layer's point.
 * @param x,y the layer's point @param covarianceX,covarianceY with depth
 */
inline PartPoints SplitPoint(const LayerDepths& layer, float x, float y, float covarianceX,
  float covarianceY, const TwoNormals& fit)
{
  const float front = fit.FrontWeight, back = 1.0f - front;
  const auto radius = [](float cover) {
    const double mean = std::min(static_cast<double>(cover), 1.0);
    return static_cast<float>(LargestMoment(mean) / mean);
  };
  // The variance of the two means is -Front Back.
  const float scale = 1.0f / (fit.Back * -fit.Front);
  const float dx = covarianceX * scale, dy = covarianceY * scale; // per depth
  const float way =
    std::min(WayInDisc(x, y, fit.Front * dx, fit.Front * dy, radius(front * layer.Weight)),
      WayInDisc(x, y, fit.Back * dx, fit.Back * dy, radius(back * layer.Weight)));
  return { x + way * fit.Front * dx, y + way * fit.Front * dy, x + way * fit.Back * dx,
    y + way * fit.Back * dy };
}
}
