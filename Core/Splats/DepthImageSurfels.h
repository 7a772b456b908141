// SPDX-License-Identifier: BSD-3-Clause
/**
 * Turns an image with depth of other props (meshes, lines, glyphs) into surfels. Each pixel that
 * the lens blurs becomes a patch of the surface seen in it, and goes through the same lens, kernels
 * and A-buffer as the surfels of clouds. Parts in focus stay an image, as sharp as it was drawn.
 *
 * An image has one layer. Gaps at the edge of a blurred thing are filled from the neighbouring
 * surface (SilhouetteExtension.h). Other hidden surfaces are missing.
 */
#pragma once

#include "Core/Base/Executor.h"
#include "Core/Lens/Lens.h"
#include "Core/Lens/View.h"
#include "Core/Splats/SilhouetteExtension.h"
#include "Core/Splats/SmoothCells.h"
#include "Core/Surfels/SurfelCloud.h"

#include <vector>

namespace SurfelSplatting
{
/// Pixels whose circle of confusion has at least this radius, px, become surfels.
constexpr double MinPixelConfusion = 0.5;

/// Next to a sharp pixel, which is not a surfel, the sum of the kernels is below 1, and the
/// background would show as a line. Hence the rim: blurred pixels with at most RimConfusion px more
/// blur than the minimum, and within RimWidth px of a sharp one. They hide the background, and
/// their own colour is drawn under their surfels.
constexpr double RimConfusion = 1.0;
constexpr int RimWidth = 3;

/// Maximum width, px, of the margin that is drawn for blur from outside the picture.
constexpr int MaxMargin = 128;

/// Standard deviation of a pixel's reconstruction kernel, px; the same as that of surfels in units
/// of their spacing.
constexpr double PixelDeviation = 0.5;

/// Variance of the pixel filter for these surfels, px^2: small, since the pixels are filtered
/// already. With PixelDeviation and the minimum blur, the sum of the kernels of a grid of pixels
/// ripples by 2 exp(-2 pi^2 0.41) = 0.0006.
constexpr double PixelPrefilter = 0.1;

/// 2 x 2 or 4 x 4 pixels of one surface become one surfel if all have at least this circle
/// of confusion b, radius in px: the lost detail would not be visible. A square of side s adds
/// v = (s^2 - 1) / 12 to the variance of its pixels. Where the disc of an edge in the colours ends,
/// that changes the picture by v / 2 times the second derivative of the blurred edge, which is
/// about sqrt(2 b) / (pi b^2) of its contrast: one level of 255 of a full contrast. Against a
/// surfel for each pixel, pictures of striped meshes had 50 dB or more.
constexpr float MinBlockConfusion[] = { 6.0f, 16.0f };
constexpr int LargestSquare = 4; // px

/// The same where the image is smooth (SmoothCells.h): of a contrast of SmoothCells::MaxColorRange,
/// half a level is lost. Pictures with and without differ by 58 to 66 dB. Squares of 8 x 8 pixels
/// from 16 px on save another sixth of the time and cost up to 0.25 dB.
constexpr float MinSmoothConfusion[] = { 3.0f, 7.0f };

/// Ratio of the area of a pixel's surfel to that of the pixel. For clouds, errors of the sum of the
/// kernels average out. Pixels all have the same place in the raster, so the error is the same for
/// all: the sum is up to 0.012 too small where grids are coarse, and the background would shine
/// through.
constexpr double PixelSurplus = 1.0125;

/// There is an edge, not a slope, where nearness changes between pixels by more than this share of
/// the blur and by more than SilhouetteExtension::MinStep.
constexpr float MaxSlope = 0.25f;

/// An image with depth that shows the other props: the camera's picture with a margin on each side.
struct DepthImage
{
  const float* Depth = nullptr;  ///< [height + 2 margin][width + 2 margin] distance along the view
                                 ///< direction, world units; infinity where there is nothing
  const float* Colors = nullptr; ///< [height + 2 margin][width + 2 margin][4] RGBA,
                                 ///< premultiplied; may be above 1
  int Margin = 0;                ///< px
  double MinConfusion = MinPixelConfusion; ///< min. radius, px, of pixels that become surfels
  bool LinearLight = false; ///< whether colours are sRGB codes to be blurred in linear light
  bool Antialiased = false; ///< whether pixels at edges mix the colours of both sides
};

/// Width of the margin, px, a multiple of LargestSquare, from which things between two distances
/// blur into the picture; at most MaxMargin. 0 if none of them is blurred by minConfusion px.
int MarginOf(const View& camera, const Lens& lens, double nearest, double farthest,
  double minConfusion = MinPixelConfusion);

class DepthImageSurfels
{
public:
  /**
   * Turns the pixels that a lens blurs into surfels.
   * @param sharpDepth [height][width] receives the distances in the camera's picture. Blurred
   * pixels get those of what remains under the surfels, or infinity if that is unknown
   */
  void MakeSurfels(const View& camera, const Lens& lens, const DepthImage& image, float* sharpDepth,
    const Executor& executor);

  /// Number of surfels.
  std::size_t Size() const { return this->Places.size(); }

  struct Pixel
  {
    std::size_t Index; ///< in the camera's picture
    std::size_t Place; ///< in the image with its margin
    std::size_t Under; ///< the pixel of that image that is drawn under the surfels: at the rim
                       ///< itself, at an edge the sharp pixel behind it; NoPixel: not known
  };

  static constexpr std::size_t NoPixel = static_cast<std::size_t>(-1);

  /// The pixels of the camera's picture that became surfels, by ascending index.
  const std::vector<Pixel>& Blurred() const { return this->BlurredPixels; }

  /// Antialiased sharp pixels behind the edge of blurred ones. They stay, without the colour of
  /// these.
  const std::vector<Pixel>& Mixed() const { return this->MixedPixels; }

  /// The surfels as a cloud in world coordinates, valid until this object changes.
  SurfelCloud Get() const;

private:
  void FindConfusions(
    const View& camera, const Lens& lens, const DepthImage& image, const Executor& executor);
  void FindBlurredPixels(const View& camera, const DepthImage& image, const Executor& executor);
  void AddHidden(const DepthImage& image, const Executor& executor);
  void TakeBands();
  bool IsMixed(const DepthImage& image, int x, int y, int direction[2]) const;
  void FindMixed(const View& camera, const DepthImage& image, const Executor& executor);
  std::size_t Behind(const DepthImage& image, std::size_t place) const;
  std::size_t Unmixed(int x, int y, int dx, int dy) const;
  float PutUnder(const DepthImage& image, Pixel& pixel) const;
  float RimDepth(const DepthImage& image, std::size_t place) const;
  struct Sample
  {
    float Color[4];  // light, not premultiplied
    double Nearness; // 1 / depth
  };
  Sample MeanOf(const DepthImage& image, std::size_t corner, int side) const;
  double DepthSlope(
    const float* depth, std::size_t at, std::size_t step, bool hasBefore, bool hasAfter) const;
  void MakeSurfel(const View& camera, const DepthImage& image, std::size_t s);

  /// Where a surfel is seen, and the pixel whose depth and colour it has; for a square of pixels,
  /// its lower left one. Both are in the image with its margin.
  struct Placed
  {
    std::size_t Place, Source;
    int Side; // of the square, px
  };
  bool IsBlock(int x, int y, int side) const;
  void PlaceBlock(int x, int y, int side, double minConfusion, std::vector<Placed>& places) const;

  Affine3 CameraToWorld;
  std::vector<Pixel> BlurredPixels, MixedPixels;
  std::vector<float> Nearness;        // of the image with its margin, px (SilhouetteExtension.h)
  std::vector<float> Confusions;      // px; -1 where there is nothing
  std::vector<std::size_t> RowPixels; // blurred ones before each row
  std::vector<std::vector<Placed>> Bands; // of LargestSquare rows
  std::vector<Placed> Places;             // of the surfels
  int Width = 0, Height = 0;              // of the image with its margin
  SilhouetteExtension Hidden;
  SmoothCells Smooth;
  std::vector<float> Positions, Covariances, AreaVectors, Colors;
};
}
