// SPDX-License-Identifier: BSD-3-Clause
/**
 * What others have drawn (meshes, lines, glyphs), pixel by pixel, as surfels: each pixel that the
 * lens blurs is a patch of the surface that is seen in it and goes through the same lens, kernels
 * and A-buffer as the surfels of clouds. What is in focus stays a picture, as sharp as it was
 * drawn.
 *
 * A picture has one layer. What a blurred thing hides and lets through at its edge is taken to go
 * on from beside it (SilhouetteExtension.h); what is hidden elsewhere is not seen.
 */
#pragma once

#include "Core/Base/Executor.h"
#include "Core/Lens/Lens.h"
#include "Core/Lens/View.h"
#include "Core/Splats/SilhouetteExtension.h"
#include "Core/Surfels/SurfelCloud.h"

#include <vector>

namespace SurfelSplatting
{
/// Circle of confusion, radius in px, from which on a pixel is taken for a surfel.
constexpr double LeastPixelConfusion = 0.5;

/// Next to a sharp pixel, which is no surfel, the kernels' sum falls short of 1, and what is behind
/// would show as a line. Hence the rim: pixels that are taken with at most so many px more blur,
/// and so near to a sharp one, px, hide what is behind them and have themselves under their
/// surfels.
constexpr double RimConfusion = 1.0;
constexpr int RimWidth = 3;

/// What is drawn for the blur that reaches into the picture from outside, at most, px on each side.
constexpr int LargestMargin = 128;

/// Standard deviation of a pixel's reconstruction kernel, px: as that of surfels in their spacing.
constexpr double PixelDeviation = 0.5;

/// Variance of the pixel filter over these kernels, px^2: the pixels have been filtered already.
/// With PixelDeviation and the least blur, the sum of the kernels of a grid of pixels ripples by
/// 2 exp(-2 pi^2 0.41) = 0.0006.
constexpr double PixelPrefilter = 0.1;

/// Where all of 2 x 2 or 4 x 4 pixels are blurred by so many px, radius, and of one surface, they
/// are one surfel: what is lost of them would not be seen. Pictures of striped meshes were measured
/// to be within 50 dB of those with a surfel for each pixel.
constexpr float LeastBlockConfusion[] = { 6.0f, 16.0f };

/// Area of a pixel's surfel over that of its pixel. Pixels all have the same place in the raster,
/// so that the error of a kernel's sum over it, which averages out for clouds, is the same for all:
/// up to 0.012 short where grids are coarse, and what is behind would shine through.
constexpr double PixelSurplus = 1.0125;

/// Steeper than so much blur of its own from pixel to pixel, and than
/// SilhouetteExtension::LeastStep, there is an edge and no slope.
constexpr float LargestSlope = 0.25f;

/// A picture of what others have drawn, with so many px more on each side of the camera's picture.
struct DepthImage
{
  const float* Depth = nullptr;  ///< [height + 2 margin][width + 2 margin] distance along the view
                                 ///< direction, world units; infinity where there is nothing
  const float* Colors = nullptr; ///< [height + 2 margin][width + 2 margin][4] RGBA,
                                 ///< premultiplied; may be above 1
  int Margin = 0;                ///< px
  double LeastConfusion = LeastPixelConfusion; ///< radius, px, from which on pixels are taken
  bool LinearLight = false; ///< whether colours are sRGB codes of the light that is blurred
  bool Antialiased = false; ///< whether pixels at edges have something of both sides' colours
};

/// The margin from which a lens blurs into the picture, of things between two distances: at most
/// LargestMargin; 0 where none of them is blurred by `least` px.
int MarginOf(const View& camera, const Lens& lens, double nearest, double farthest,
  double least = LeastPixelConfusion);

class DepthImageSurfels
{
public:
  /**
   * Takes the pixels that a lens blurs.
   * @param limit [height][width] the distances in the camera's picture; where a pixel is taken set
   * to that of what is under it
   */
  void Take(const View& camera, const Lens& lens, const DepthImage& others, float* limit,
    const Executor& executor);

  /// Of the cloud.
  std::size_t Size() const { return this->Places.size(); }

  struct Pixel
  {
    std::size_t Index; ///< in the camera's picture
    std::size_t Place; ///< in the picture with its margin
    std::size_t Under; ///< the pixel of that picture that is under the surfels: at the rim its own,
                       ///< at an edge the sharp one, or nothing, behind it; or NoPixel: not known
  };

  static constexpr std::size_t NoPixel = static_cast<std::size_t>(-1);

  /// The pixels of the camera's picture that were taken, by ascending index.
  const std::vector<Pixel>& Taken() const { return this->Pixels; }

  /// Antialiased pixels behind the edge of one that was taken: they stay, but not with its colour.
  const std::vector<Pixel>& Mixed() const { return this->MixedPixels; }

  /// As a cloud in world coordinates, which lives as long as this object is not changed.
  SurfelCloud Get() const;

private:
  void FindConfusions(
    const View& camera, const Lens& lens, const DepthImage& others, const Executor& executor);
  void TakePixels(const View& camera, const DepthImage& others, const Executor& executor);
  void AddHidden(const DepthImage& others);
  bool IsMixed(const DepthImage& others, int x, int y, int direction[2]) const;
  void FindMixed(const View& camera, const DepthImage& others, const Executor& executor);
  std::size_t Behind(const DepthImage& others, std::size_t place) const;
  std::size_t Unmixed(int x, int y, int dx, int dy) const;
  float PutUnder(const DepthImage& others, Pixel& pixel) const;
  float RimDepth(const DepthImage& others, std::size_t place) const;
  struct Sample
  {
    float Color[4];  // light, not premultiplied
    double Nearness; // 1 / depth
  };
  Sample MeanOf(const DepthImage& others, std::size_t corner, int side) const;
  double DepthSlope(
    const float* depth, std::size_t at, std::size_t step, bool hasBefore, bool hasAfter) const;
  void MakeSurfel(const View& camera, const DepthImage& others, std::size_t s);

  /// Where a surfel is seen, and the pixel whose depth and colour it has, or the lowest left one of
  /// a square; both in the picture with its margin.
  struct Placed
  {
    std::size_t Place, Source;
    int Side; // of the square, px
  };
  bool IsBlock(std::size_t corner, int side) const;
  void PlaceBlock(int x, int y, int side, double least, std::vector<Placed>& places) const;

  Affine3 CameraToWorld;
  std::vector<Pixel> Pixels, MixedPixels;
  std::vector<float> Nearness;        // of the picture with its margin, px (SilhouetteExtension.h)
  std::vector<float> Confusions;      // px; -1 where there is nothing
  std::vector<std::size_t> RowPixels; // before each of its rows
  std::vector<std::vector<Placed>> Bands; // of rows
  std::vector<Placed> Places;             // of the surfels
  int Width = 0, Height = 0;              // of the picture with its margin
  SilhouetteExtension Hidden;
  std::vector<float> Positions, Covariances, AreaVectors, Colors;
};
}
