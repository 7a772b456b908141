// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Splats/DepthImageSurfels.h"

#include "Core/Base/LinearLight.h"
#include "Core/Base/PixelBox.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace SurfelSplatting
{
namespace
{
/// Light times alpha of a code times alpha. What glows has more colour than alpha: it counts as
/// covering that much, so that it is not divided by next to nothing.
float PremultipliedLight(float code, float alpha)
{
  const float covered = std::fmax(alpha, std::fmin(code, 1.0f));
  return covered > 0.0f ? covered * static_cast<float>(LightOfCode(code / covered)) : 0.0f;
}
}

int MarginOf(
  const View& camera, const Lens& lens, double nearest, double farthest, double minConfusion)
{
  const double f = std::sqrt(std::abs(camera.Fx * camera.Fy));
  double widest = 0.0;
  for (const double z : { nearest, farthest })
  {
    const double blur = std::sqrt(lens.Shape.Largest()) * lens.RelativeCircleOfConfusion(z);
    widest = z > 0.0 ? std::fmax(widest, f * blur) : INFINITY;
  }
  // Kernels are up to a quarter wider than the disc; 3 px are for the pixel's own kernel. Squares
  // of pixels are the same whether or not there is a margin.
  const double margin = std::fmin(1.25 * widest + 3.0, MaxMargin);
  return widest < minConfusion
    ? 0
    : LargestSquare * static_cast<int>(std::ceil(margin / LargestSquare));
}

/// Computes the blur of all pixels, and counts the blurred ones of each row.
void DepthImageSurfels::FindConfusions(
  const View& camera, const Lens& lens, const DepthImage& image, const Executor& executor)
{
  const auto width = static_cast<std::size_t>(camera.Width + 2 * image.Margin);
  const auto height = static_cast<std::size_t>(camera.Height + 2 * image.Margin);
  const auto left = static_cast<std::size_t>(image.Margin), right = left + camera.Width;
  const auto low = static_cast<std::size_t>(image.Margin), high = low + camera.Height;
  const double k = std::sqrt(std::abs(camera.Fx * camera.Fy)) * lens.Radius;
  const auto focus = static_cast<float>(k / lens.FocalDistance);
  this->Nearness.resize(width * height);
  this->Confusions.resize(width * height);
  this->RowPixels.assign(height + 1, 0);
  executor.For(height, 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t y = begin; y < end; ++y)
    {
      for (std::size_t x = 0; x < width; ++x)
      {
        const std::size_t p = y * width + x;
        const double z = image.Depth[p];
        const bool drawn = z > 0.0 && std::isfinite(z);
        this->Nearness[p] = drawn ? static_cast<float>(k / z) : 0.0f;
        this->Confusions[p] = drawn ? std::abs(focus - this->Nearness[p]) : -1.0f;
        const std::size_t blurred = this->Confusions[p] >= image.MinConfusion ? 1 : 0;
        this->RowPixels[y + 1] += x >= left && x < right && y >= low && y < high ? blurred : 0;
      }
    }
  });
  std::partial_sum(this->RowPixels.begin(), this->RowPixels.end(), this->RowPixels.begin());
}

/// Whether a square of pixels can be one surfel.
bool DepthImageSurfels::IsBlock(int x, int y, int side) const
{
  const std::size_t corner = PixelIndex(x, y, this->Width);
  const float minConfusion =
    (this->Smooth.Has(x, y, side) ? MinSmoothConfusion : MinBlockConfusion)[side / 4];
  float nearest = this->Nearness[corner], farthest = nearest;
  for (int j = 0; j < side; ++j)
  {
    for (int i = 0; i < side; ++i)
    {
      const std::size_t p = corner + PixelIndex(i, j, this->Width);
      if (!(this->Confusions[p] >= minConfusion))
      {
        return false;
      }
      nearest = std::max(nearest, this->Nearness[p]);
      farthest = std::min(farthest, this->Nearness[p]);
    }
  }
  return nearest - farthest < SilhouetteExtension::MinStep;
}

/// Places surfels for the blurred pixels of a square, as large as possible.
void DepthImageSurfels::PlaceBlock(
  int x, int y, int side, double minConfusion, std::vector<Placed>& places) const
{
  if (x >= this->Width || y >= this->Height)
  {
    return;
  }
  const std::size_t corner = PixelIndex(x, y, this->Width);
  const bool inside = x + side <= this->Width && y + side <= this->Height;
  if (side == 1 ? this->Confusions[corner] >= minConfusion : inside && this->IsBlock(x, y, side))
  {
    places.push_back({ corner, corner, side });
  }
  else if (side > 1)
  {
    const int half = side / 2;
    this->PlaceBlock(x, y, half, minConfusion, places);
    this->PlaceBlock(x + half, y, half, minConfusion, places);
    this->PlaceBlock(x, y + half, half, minConfusion, places);
    this->PlaceBlock(x + half, y + half, half, minConfusion, places);
  }
}

void DepthImageSurfels::FindBlurredPixels(
  const View& camera, const DepthImage& image, const Executor& executor)
{
  constexpr int side = LargestSquare;
  this->Bands.resize((this->Height + side - 1) / side);
  executor.For(this->Bands.size(), 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t band = begin; band < end; ++band)
    {
      this->Bands[band].clear();
      for (int x = 0; x < this->Width; x += side)
      {
        this->PlaceBlock(
          x, static_cast<int>(band) * side, side, image.MinConfusion, this->Bands[band]);
      }
    }
  });
  this->TakeBands();
  const auto margin = static_cast<std::size_t>(image.Margin);
  this->BlurredPixels.resize(this->RowPixels.back());
  executor.For(
    static_cast<std::size_t>(camera.Height), 16, [&](std::size_t begin, std::size_t end) {
      for (std::size_t y = begin; y < end; ++y)
      {
        std::size_t pixel = this->RowPixels[y + margin];
        for (std::size_t x = 0; x < static_cast<std::size_t>(camera.Width); ++x)
        {
          const std::size_t p = (y + margin) * this->Width + x + margin;
          if (this->Confusions[p] >= image.MinConfusion)
          {
            this->BlurredPixels[pixel++] = { y * camera.Width + x, p, NoPixel };
          }
        }
      }
    });
}

/// A pixel of the same surface as (x, y), up to two steps of (dx, dy) away from the edge of the
/// surface in front of it.
std::size_t DepthImageSurfels::Unmixed(int x, int y, int dx, int dy) const
{
  const std::size_t own = PixelIndex(x, y, this->Width);
  for (int step = 2; step >= 1; --step)
  {
    const int i = x + step * dx, j = y + step * dy;
    if (i < 0 || i >= this->Width || j < 0 || j >= this->Height)
    {
      continue;
    }
    const std::size_t p = PixelIndex(i, j, this->Width);
    if (std::abs(this->Nearness[p] - this->Nearness[own]) < SilhouetteExtension::MinStep)
    {
      return p;
    }
  }
  return own;
}

/// The pixel whose surface continues behind a pixel, unmixed with the surface in front; NoPixel if
/// unknown.
std::size_t DepthImageSurfels::Behind(const DepthImage& image, std::size_t place) const
{
  const std::int32_t behind = this->Hidden.Behind(place);
  if (behind == SilhouetteExtension::None)
  {
    return NoPixel;
  }
  if (!image.Antialiased)
  {
    return static_cast<std::size_t>(behind);
  }
  const int x = behind % this->Width, y = behind / this->Width;
  const int dx = x - static_cast<int>(place % this->Width);
  const int dy = y - static_cast<int>(place / this->Width);
  return this->Unmixed(x, y, (dx > 0) - (dx < 0), (dy > 0) - (dy < 0));
}

/// Adds surfels for blurred surfaces that continue behind others.
void DepthImageSurfels::AddHidden(const DepthImage& image, const Executor& executor)
{
  const auto width = static_cast<std::size_t>(this->Width);
  const auto addRow = [&](std::size_t y, std::vector<Placed>& places) {
    for (std::size_t x = 0; x < width; ++x)
    {
      if (x % SilhouetteExtension::RunLength == 0 && !this->Hidden.HasAny(x, y))
      {
        x += SilhouetteExtension::RunLength - 1;
        continue;
      }
      const std::size_t place = y * width + x;
      const std::size_t behind = this->Behind(image, place);
      if (behind != NoPixel && this->Confusions[behind] >= image.MinConfusion)
      {
        places.push_back({ place, behind, 1 });
      }
    }
  };
  executor.For(this->Bands.size(), 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t band = begin; band < end; ++band)
    {
      this->Bands[band].clear();
      const std::size_t last =
        std::min((band + 1) * LargestSquare, static_cast<std::size_t>(this->Height));
      for (std::size_t y = band * LargestSquare; y < last; ++y)
      {
        addRow(y, this->Bands[band]);
      }
    }
  });
  this->TakeBands();
}

/// Adds the surfels of all bands of rows.
void DepthImageSurfels::TakeBands()
{
  for (const std::vector<Placed>& band : this->Bands)
  {
    this->Places.insert(this->Places.end(), band.begin(), band.end());
  }
}

/// Whether an antialiased pixel is beside the edge of blurred ones in front of it; then also the
/// direction away from them.
bool DepthImageSurfels::IsMixed(const DepthImage& image, int x, int y, int direction[2]) const
{
  const std::size_t p = PixelIndex(x, y, this->Width);
  int away[2] = { 0, 0 }, inFront = 0;
  for (int j = std::max(0, y - 1); j <= std::min(this->Height - 1, y + 1); ++j)
  {
    for (int i = std::max(0, x - 1); i <= std::min(this->Width - 1, x + 1); ++i)
    {
      const std::size_t n = PixelIndex(i, j, this->Width);
      if (this->Confusions[n] >= image.MinConfusion &&
        this->Nearness[n] - this->Nearness[p] >= SilhouetteExtension::MinStep)
      {
        ++inFront;
        away[0] += x - i;
        away[1] += y - j;
      }
    }
  }
  for (int c = 0; c < 2; ++c)
  {
    direction[c] = (away[c] > 0) - (away[c] < 0);
  }
  return inFront > 0;
}

void DepthImageSurfels::FindMixed(
  const View& camera, const DepthImage& image, const Executor& executor)
{
  const int margin = image.Margin;
  std::vector<std::vector<Pixel>> rows(camera.Height);
  executor.For(rows.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row)
    {
      const int y = static_cast<int>(row) + margin;
      for (int x = margin; x < camera.Width + margin; ++x)
      {
        const std::size_t p = PixelIndex(x, y, this->Width);
        int away[2];
        if (this->Confusions[p] < image.MinConfusion && this->IsMixed(image, x, y, away))
        {
          rows[row].push_back(
            { row * camera.Width + x - margin, p, this->Unmixed(x, y, away[0], away[1]) });
        }
      }
    }
  });
  for (const std::vector<Pixel>& row : rows)
  {
    this->MixedPixels.insert(this->MixedPixels.end(), row.begin(), row.end());
  }
}

/// A depth behind the surface at the rim: the depth of the farthest rim pixel nearby. 0: not at the
/// rim.
float DepthImageSurfels::RimDepth(const DepthImage& image, std::size_t place) const
{
  const double maxConfusion = image.MinConfusion + RimConfusion;
  if (this->Confusions[place] > maxConfusion)
  {
    return 0.0f;
  }
  const int x = static_cast<int>(place % this->Width), y = static_cast<int>(place / this->Width);
  float farthest = 0.0f;
  bool rim = false;
  for (int j = std::max(0, y - RimWidth); j <= std::min(this->Height - 1, y + RimWidth); ++j)
  {
    for (int i = std::max(0, x - RimWidth); i <= std::min(this->Width - 1, x + RimWidth); ++i)
    {
      const std::size_t p = PixelIndex(i, j, this->Width);
      const float confusion = this->Confusions[p];
      if (confusion >= 0.0f && confusion <= maxConfusion)
      {
        rim = rim || confusion < image.MinConfusion;
        farthest = std::max(farthest, image.Depth[p]);
      }
    }
  }
  return rim ? farthest : 0.0f;
}

/// Sets what is drawn under a blurred pixel. Returns the depth beyond which it hides other things.
float DepthImageSurfels::PutUnder(const DepthImage& image, Pixel& pixel) const
{
  const float rim = this->RimDepth(image, pixel.Place);
  if (rim > 0.0f)
  {
    pixel.Under = pixel.Place;
    return rim;
  }
  const std::size_t behind = this->Behind(image, pixel.Place);
  if (behind == NoPixel || this->Confusions[behind] >= image.MinConfusion)
  {
    return std::numeric_limits<float>::infinity();
  }
  pixel.Under = behind;
  return image.Depth[behind];
}

void DepthImageSurfels::MakeSurfels(const View& camera, const Lens& lens, const DepthImage& image,
  float* sharpDepth, const Executor& executor)
{
  this->BlurredPixels.clear();
  this->MixedPixels.clear();
  this->Places.clear();
  this->CameraToWorld = camera.WorldToCamera.Inverse();
  if (camera.Parallel || lens.Radius == 0.0)
  {
    return;
  }
  this->Width = camera.Width + 2 * image.Margin;
  this->Height = camera.Height + 2 * image.Margin;
  this->FindConfusions(camera, lens, image, executor);
  this->Smooth.Find(
    { this->Width, this->Height, image.Colors, this->Nearness.data(), this->Confusions.data() },
    executor);
  this->FindBlurredPixels(camera, image, executor);
  if (this->Places.empty())
  {
    return;
  }
  this->Hidden.Find(
    this->Width, this->Height, this->Nearness, this->Confusions, image.MinConfusion, executor);
  this->AddHidden(image, executor);
  if (image.Antialiased)
  {
    this->FindMixed(camera, image, executor);
  }
  this->Positions.resize(3 * this->Size());
  this->Covariances.resize(6 * this->Size());
  this->AreaVectors.resize(3 * this->Size());
  this->Colors.resize(4 * this->Size());
  executor.For(this->Size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t s = begin; s < end; ++s)
    {
      this->MakeSurfel(camera, image, s);
    }
  });
  executor.For(this->BlurredPixels.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p)
    {
      sharpDepth[this->BlurredPixels[p].Index] = this->PutUnder(image, this->BlurredPixels[p]);
    }
  });
}

/// Change of depth from a pixel to the next along a row or column: the smaller of those to the two
/// neighbours, 0 if there is none. Neighbours whose nearness, which is linear along a plane,
/// differs too much are of another surface and do not count.
double DepthImageSurfels::DepthSlope(
  const float* depth, std::size_t at, std::size_t step, bool hasBefore, bool hasAfter) const
{
  const float maxStep = std::max(SilhouetteExtension::MinStep, MaxSlope * this->Confusions[at]);
  const auto isSame = [&](std::size_t p) {
    return std::abs(this->Nearness[p] - this->Nearness[at]) < maxStep;
  };
  const double z = depth[at];
  const double before = hasBefore && isSame(at - step) ? z - depth[at - step] : INFINITY;
  const double after = hasAfter && isSame(at + step) ? depth[at + step] - z : INFINITY;
  const double slope = std::abs(before) < std::abs(after) ? before : after;
  return std::isfinite(slope) ? slope : 0.0;
}

/// Mean colour of a square, not premultiplied, and mean of 1 / depth, which is linear along a
/// plane.
DepthImageSurfels::Sample DepthImageSurfels::MeanOf(
  const DepthImage& image, std::size_t corner, int side) const
{
  Sample mean{ { 0, 0, 0, 0 }, 0 };
  for (int j = 0; j < side; ++j)
  {
    for (int i = 0; i < side; ++i)
    {
      const std::size_t p = corner + PixelIndex(i, j, this->Width);
      const float* rgba = image.Colors + 4 * p;
      for (int c = 0; c < 4; ++c)
      {
        mean.Color[c] +=
          image.LinearLight && c < 3 ? PremultipliedLight(rgba[c], rgba[3]) : rgba[c];
      }
      mean.Nearness += 1.0 / image.Depth[p];
    }
  }
  const auto count = static_cast<float>(side * side);
  const float straight = mean.Color[3] > 0.0f ? 1.0f / mean.Color[3] : 0.0f;
  for (int c = 0; c < 3; ++c)
  {
    mean.Color[c] *= straight;
  }
  mean.Color[3] /= count;
  mean.Nearness /= count;
  return mean;
}

/// Makes the surfel of a pixel or of a square of pixels: the part that it sees of the plane through
/// its source's depth with its source's slopes. The cross product of the position's derivatives
/// along x and y of the screen is the area vector of a pixel.
void DepthImageSurfels::MakeSurfel(const View& camera, const DepthImage& image, std::size_t s)
{
  const std::size_t place = this->Places[s].Place, source = this->Places[s].Source;
  const int side = this->Places[s].Side;
  const auto width = static_cast<std::size_t>(this->Width);
  const auto height = static_cast<std::size_t>(this->Height);
  const std::size_t p = source + static_cast<std::size_t>(side / 2) * (width + 1); // in the middle
  const std::size_t x = p % width, y = p / width;
  const Sample mean = this->MeanOf(image, source, side);
  const double z = 1.0 / mean.Nearness;
  const double slopeX = this->DepthSlope(image.Depth, p, 1, x > 0, x + 1 < width);
  const double slopeY = this->DepthSlope(image.Depth, p, width, y > 0, y + 1 < height);
  const double middle = 0.5 * side - image.Margin;
  const double rayX = (static_cast<double>(place % width) + middle - camera.Cx) / camera.Fx;
  const double rayY = (static_cast<double>(place / width) + middle - camera.Cy) / camera.Fy;
  const Vector3 position{ rayX * z, rayY * z, z };
  const Vector3 alongX{ z / camera.Fx + rayX * slopeX, rayY * slopeX, slopeX };
  const Vector3 alongY{ rayX * slopeY, z / camera.Fy + rayY * slopeY, slopeY };
  const Vector3 area = Cross(alongX, alongY);
  const double faces = Dot(area, position) > 0.0 ? -1.0 : 1.0; // the lens
  // The variance of the mixture of the pixels' Gaussians.
  const double variance = PixelDeviation * PixelDeviation + (side * side - 1) / 12.0;
  const auto product = [&](int i, int j) {
    return static_cast<float>(variance * (alongX[i] * alongX[j] + alongY[i] * alongY[j]));
  };
  const float covariance[6] = { product(0, 0), product(1, 1), product(2, 2), product(0, 1),
    product(1, 2), product(0, 2) };
  std::copy_n(covariance, 6, this->Covariances.data() + 6 * s);
  std::copy_n(mean.Color, 4, this->Colors.data() + 4 * s);
  for (int i = 0; i < 3; ++i)
  {
    this->Positions[3 * s + i] = static_cast<float>(position[i]);
    this->AreaVectors[3 * s + i] = static_cast<float>(faces * PixelSurplus * side * side * area[i]);
  }
}

SurfelCloud DepthImageSurfels::Get() const
{
  SurfelCloud cloud;
  cloud.NumberOfSurfels = this->Size();
  cloud.PositionsFloat = this->Positions.data();
  cloud.Covariances = this->Covariances.data();
  cloud.AreaVectors = this->AreaVectors.data();
  cloud.ColorsFloat = this->Colors.data();
  cloud.LocalToWorld = this->CameraToWorld;
  cloud.Surface.Lit = false; // colours include light
  cloud.Prefilter = PixelPrefilter;
  return cloud;
}
}
