// SPDX-License-Identifier: BSD-3-Clause
/**
 * What others have drawn (meshes, lines, glyphs), pixel by pixel, as surfels: each pixel that the
 * lens blurs is a patch of the surface that is seen in it and goes through the same lens, kernels
 * and A-buffer as the surfels of clouds. What is in focus stays a picture, as sharp as it was
 * drawn.
 *
 * A picture has one layer: what a blurred thing hides is not there to be seen through its edge.
 */
#pragma once

#include "Executor.h"
#include "Lens.h"
#include "SurfelCloud.h"
#include "View.h"

#include <vector>

namespace SurfelSplatting
{
/// Circle of confusion, radius in px, from which on a pixel is taken for a surfel.
constexpr double LeastPixelConfusion = 0.5;

/// From there on over so many px of blur, what is under a pixel that was taken goes over from the
/// pixel itself to the background: next to a sharp pixel, which is no surfel, the kernels' sum
/// falls short of 1, and the background would show as a line.
constexpr double PixelFade = 1.0;

/// The picture's border goes on outside as far as its blur reaches, up to so many px: what is there
/// was not drawn, but without it the border would fade.
constexpr int LargestMargin = 128;

/// Standard deviation of a pixel's reconstruction kernel, px: as that of surfels in their spacing.
constexpr double PixelDeviation = 0.5;

/// Variance of the pixel filter over these kernels, px^2: the pixels have been filtered already.
/// With PixelDeviation and the least blur, the sum of the kernels of a grid of pixels ripples by
/// 2 exp(-2 pi^2 0.41) = 0.0006.
constexpr double PixelPrefilter = 0.1;

class PixelSurfels
{
public:
  /**
   * Takes the pixels that a lens blurs.
   * @param depth  [height][width] distance along the view direction, world units; infinity where
   * there is nothing. Set to infinity where a pixel is taken.
   * @param colors [height][width][4] linear RGBA, premultiplied; may be above 1
   */
  void Take(const View& camera, const Lens& lens, float* depth, const float* colors,
    const Executor& executor);

  /// Of the cloud.
  std::size_t Size() const { return this->Places.size(); }

  struct Pixel
  {
    std::size_t Index;
    float Absent; ///< share of the background in what is under it; the rest is the pixel itself
  };

  /// The pixels that were taken, by ascending index.
  const std::vector<Pixel>& Taken() const { return this->Pixels; }

  /// As a cloud in world coordinates, which lives as long as this object is not changed.
  SurfelCloud Get() const;

private:
  /// A surfel: pixel x, y, in the picture or beyond its border, as the pixel `Source` in it.
  struct Place
  {
    int X, Y;
    std::size_t Source;
  };

  void TakePixels(const View& camera, const Lens& lens, const float* depth);
  void AddMargin(const View& camera, const std::vector<float>& confusions);
  void MakeSurfel(const View& camera, const float* depth, const float* colors, std::size_t s);

  Affine3 CameraToWorld;
  std::vector<Pixel> Pixels;
  std::vector<Place> Places;
  std::vector<float> Positions, Covariances, AreaVectors, Colors;
};
}
