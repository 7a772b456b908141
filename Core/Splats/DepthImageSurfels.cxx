// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Splats/DepthImageSurfels.h"

#include "Core/Base/LinearLight.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace SurfelSplatting
{
namespace
{
Affine3 Inverse(const Affine3& a)
{
  // Rows of the inverse: cofactors over the determinant.
  Affine3 inverse;
  const double scale = 1.0 / a.Determinant();
  for (int i = 0; i < 3; ++i)
  {
    for (int j = 0; j < 3; ++j)
    {
      const int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
      inverse.L[j][i] = scale * (a.L[i1][j1] * a.L[i2][j2] - a.L[i1][j2] * a.L[i2][j1]);
    }
  }
  inverse.T = inverse.ApplyLinear({ -a.T[0], -a.T[1], -a.T[2] });
  return inverse;
}
}

int MarginOf(const View& camera, const Lens& lens, double nearest, double farthest, double least)
{
  const double f = std::sqrt(std::abs(camera.Fx * camera.Fy));
  double widest = 0.0;
  for (const double z : { nearest, farthest })
  {
    widest = z > 0.0 ? std::fmax(widest, f * lens.RelativeCircleOfConfusion(z)) : INFINITY;
  }
  // Kernels are up to a quarter wider than the disc, and the pixel's own.
  return widest < least
    ? 0
    : static_cast<int>(std::fmin(std::ceil(1.25 * widest) + 3.0, LargestMargin));
}

/// The blur of all pixels, and how many of each row are taken.
void DepthImageSurfels::FindConfusions(
  const View& camera, const Lens& lens, const DepthImage& others, const Executor& executor)
{
  const auto width = static_cast<std::size_t>(camera.Width + 2 * others.Margin);
  const auto height = static_cast<std::size_t>(camera.Height + 2 * others.Margin);
  const auto left = static_cast<std::size_t>(others.Margin), right = left + camera.Width;
  const auto low = static_cast<std::size_t>(others.Margin), high = low + camera.Height;
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
        const double z = others.Depth[p];
        const bool drawn = z > 0.0 && std::isfinite(z);
        this->Nearness[p] = drawn ? static_cast<float>(k / z) : 0.0f;
        this->Confusions[p] = drawn ? std::abs(focus - this->Nearness[p]) : -1.0f;
        const std::size_t taken = this->Confusions[p] >= others.LeastConfusion ? 1 : 0;
        this->RowPixels[y + 1] += x >= left && x < right && y >= low && y < high ? taken : 0;
      }
    }
  });
  std::partial_sum(this->RowPixels.begin(), this->RowPixels.end(), this->RowPixels.begin());
}

/// Whether a square of pixels can be one surfel.
bool DepthImageSurfels::IsBlock(std::size_t corner, int side) const
{
  const float least = LeastBlockConfusion[side / 4];
  float nearest = this->Nearness[corner], farthest = nearest;
  for (int j = 0; j < side; ++j)
  {
    for (int i = 0; i < side; ++i)
    {
      const std::size_t p = corner + static_cast<std::size_t>(j) * this->Width + i;
      if (!(this->Confusions[p] >= least))
      {
        return false;
      }
      nearest = std::max(nearest, this->Nearness[p]);
      farthest = std::min(farthest, this->Nearness[p]);
    }
  }
  return nearest - farthest < SilhouetteExtension::LeastStep;
}

/// The taken pixels of a square, in surfels as large as may be.
void DepthImageSurfels::PlaceBlock(
  int x, int y, int side, double least, std::vector<Placed>& places) const
{
  if (x >= this->Width || y >= this->Height)
  {
    return;
  }
  const std::size_t corner = static_cast<std::size_t>(y) * this->Width + x;
  const bool inside = x + side <= this->Width && y + side <= this->Height;
  if (side == 1 ? this->Confusions[corner] >= least : inside && this->IsBlock(corner, side))
  {
    places.push_back({ corner, corner, side });
  }
  else if (side > 1)
  {
    const int half = side / 2;
    this->PlaceBlock(x, y, half, least, places);
    this->PlaceBlock(x + half, y, half, least, places);
    this->PlaceBlock(x, y + half, half, least, places);
    this->PlaceBlock(x + half, y + half, half, least, places);
  }
}

void DepthImageSurfels::TakePixels(
  const View& camera, const DepthImage& others, const Executor& executor)
{
  constexpr int side = 4;
  this->Bands.resize((this->Height + side - 1) / side);
  executor.For(this->Bands.size(), 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t band = begin; band < end; ++band)
    {
      this->Bands[band].clear();
      for (int x = 0; x < this->Width; x += side)
      {
        this->PlaceBlock(
          x, static_cast<int>(band) * side, side, others.LeastConfusion, this->Bands[band]);
      }
    }
  });
  for (const std::vector<Placed>& band : this->Bands)
  {
    this->Places.insert(this->Places.end(), band.begin(), band.end());
  }
  const auto margin = static_cast<std::size_t>(others.Margin);
  this->Pixels.resize(this->RowPixels.back());
  executor.For(
    static_cast<std::size_t>(camera.Height), 16, [&](std::size_t begin, std::size_t end) {
      for (std::size_t y = begin; y < end; ++y)
      {
        std::size_t pixel = this->RowPixels[y + margin];
        for (std::size_t x = 0; x < static_cast<std::size_t>(camera.Width); ++x)
        {
          const std::size_t p = (y + margin) * this->Width + x + margin;
          if (this->Confusions[p] >= others.LeastConfusion)
          {
            this->Pixels[pixel++] = { y * camera.Width + x, p, NoPixel };
          }
        }
      }
    });
}

/// A pixel of the surface of (x, y), or of nothing, from (dx, dy) on: not at the edge of what is
/// before it.
std::size_t DepthImageSurfels::Unmixed(int x, int y, int dx, int dy) const
{
  const std::size_t own = static_cast<std::size_t>(y) * this->Width + x;
  for (int step = 2; step >= 1; --step)
  {
    const int i = x + step * dx, j = y + step * dy;
    if (i < 0 || i >= this->Width || j < 0 || j >= this->Height)
    {
      continue;
    }
    const std::size_t p = static_cast<std::size_t>(j) * this->Width + i;
    if (std::abs(this->Nearness[p] - this->Nearness[own]) < SilhouetteExtension::LeastStep)
    {
      return p;
    }
  }
  return own;
}

/// What goes on behind a pixel, not mixed with what is before it; NoPixel where that is not known.
std::size_t DepthImageSurfels::Behind(const DepthImage& others, std::size_t place) const
{
  const std::int32_t behind = this->Hidden.Behind(place);
  if (behind == SilhouetteExtension::None)
  {
    return NoPixel;
  }
  if (!others.Antialiased)
  {
    return static_cast<std::size_t>(behind);
  }
  const int x = behind % this->Width, y = behind / this->Width;
  const int dx = x - static_cast<int>(place % this->Width);
  const int dy = y - static_cast<int>(place / this->Width);
  return this->Unmixed(x, y, (dx > 0) - (dx < 0), (dy > 0) - (dy < 0));
}

/// Blurred surfaces that go on behind others become further surfels.
void DepthImageSurfels::AddHidden(const DepthImage& others)
{
  for (std::size_t place = 0; place < this->Confusions.size(); ++place)
  {
    const std::size_t behind = this->Behind(others, place);
    if (behind != NoPixel && this->Confusions[behind] >= others.LeastConfusion)
    {
      this->Places.push_back({ place, behind, 1 });
    }
  }
}

/// Whether an antialiased pixel is beside the edge of taken ones before it; then also
/// the direction away from them.
bool DepthImageSurfels::IsMixed(const DepthImage& others, int x, int y, int direction[2]) const
{
  const std::size_t p = static_cast<std::size_t>(y) * this->Width + x;
  int away[2] = { 0, 0 }, before = 0;
  for (int j = std::max(0, y - 1); j <= std::min(this->Height - 1, y + 1); ++j)
  {
    for (int i = std::max(0, x - 1); i <= std::min(this->Width - 1, x + 1); ++i)
    {
      const std::size_t n = static_cast<std::size_t>(j) * this->Width + i;
      if (this->Confusions[n] >= others.LeastConfusion &&
        this->Nearness[n] - this->Nearness[p] >= SilhouetteExtension::LeastStep)
      {
        ++before;
        away[0] += x - i;
        away[1] += y - j;
      }
    }
  }
  for (int c = 0; c < 2; ++c)
  {
    direction[c] = (away[c] > 0) - (away[c] < 0);
  }
  return before > 0;
}

void DepthImageSurfels::FindMixed(
  const View& camera, const DepthImage& others, const Executor& executor)
{
  const int margin = others.Margin;
  std::vector<std::vector<Pixel>> rows(camera.Height);
  executor.For(rows.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row)
    {
      const int y = static_cast<int>(row) + margin;
      for (int x = margin; x < camera.Width + margin; ++x)
      {
        const std::size_t p = static_cast<std::size_t>(y) * this->Width + x;
        int away[2];
        if (this->Confusions[p] < others.LeastConfusion && this->IsMixed(others, x, y, away))
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

/// Behind the surface at the rim: the farthest of its pixels that are near. 0: not at the rim.
float DepthImageSurfels::RimDepth(const DepthImage& others, std::size_t place) const
{
  const double most = others.LeastConfusion + RimConfusion;
  if (this->Confusions[place] > most)
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
      const std::size_t p = static_cast<std::size_t>(j) * this->Width + i;
      const float confusion = this->Confusions[p];
      if (confusion >= 0.0f && confusion <= most)
      {
        rim = rim || confusion < others.LeastConfusion;
        farthest = std::max(farthest, others.Depth[p]);
      }
    }
  }
  return rim ? farthest : 0.0f;
}

/// What is under a taken pixel; returns the depth from which on it hides.
float DepthImageSurfels::PutUnder(const DepthImage& others, Pixel& pixel) const
{
  const float rim = this->RimDepth(others, pixel.Place);
  if (rim > 0.0f)
  {
    pixel.Under = pixel.Place;
    return rim;
  }
  const std::size_t behind = this->Behind(others, pixel.Place);
  if (behind == NoPixel || this->Confusions[behind] >= others.LeastConfusion)
  {
    return std::numeric_limits<float>::infinity();
  }
  pixel.Under = behind;
  return others.Depth[behind];
}

void DepthImageSurfels::Take(const View& camera, const Lens& lens, const DepthImage& others,
  float* limit, const Executor& executor)
{
  this->Pixels.clear();
  this->MixedPixels.clear();
  this->Places.clear();
  this->CameraToWorld = Inverse(camera.WorldToCamera);
  if (camera.Parallel || lens.Radius == 0.0)
  {
    return;
  }
  this->Width = camera.Width + 2 * others.Margin;
  this->Height = camera.Height + 2 * others.Margin;
  this->FindConfusions(camera, lens, others, executor);
  this->TakePixels(camera, others, executor);
  if (this->Places.empty())
  {
    return;
  }
  this->Hidden.Find(
    this->Width, this->Height, this->Nearness, this->Confusions, others.LeastConfusion);
  this->AddHidden(others);
  if (others.Antialiased)
  {
    this->FindMixed(camera, others, executor);
  }
  this->Positions.resize(3 * this->Size());
  this->Covariances.resize(6 * this->Size());
  this->AreaVectors.resize(3 * this->Size());
  this->Colors.resize(4 * this->Size());
  executor.For(this->Size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t s = begin; s < end; ++s)
    {
      this->MakeSurfel(camera, others, s);
    }
  });
  executor.For(this->Pixels.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p)
    {
      limit[this->Pixels[p].Index] = this->PutUnder(others, this->Pixels[p]);
    }
  });
}

/// Change of depth from a pixel to the next along a row or column: of the two neighbours' the
/// smaller one. Neighbours of another surface are none: by their nearness, which is linear along a
/// plane. 0 where there is none.
double DepthImageSurfels::DepthSlope(
  const float* depth, std::size_t at, std::size_t step, bool hasBefore, bool hasAfter) const
{
  const float most = std::max(SilhouetteExtension::LeastStep, LargestSlope * this->Confusions[at]);
  const auto isSame = [&](std::size_t p) {
    return std::abs(this->Nearness[p] - this->Nearness[at]) < most;
  };
  const double z = depth[at];
  const double before = hasBefore && isSame(at - step) ? z - depth[at - step] : INFINITY;
  const double after = hasAfter && isSame(at + step) ? depth[at + step] - z : INFINITY;
  const double slope = std::abs(before) < std::abs(after) ? before : after;
  return std::isfinite(slope) ? slope : 0.0;
}

/// Mean colour of a square, not premultiplied, and mean nearness, which is linear along a plane.
DepthImageSurfels::Sample DepthImageSurfels::MeanOf(
  const DepthImage& others, std::size_t corner, int side) const
{
  Sample mean{ { 0, 0, 0, 0 }, 0 };
  for (int j = 0; j < side; ++j)
  {
    for (int i = 0; i < side; ++i)
    {
      const std::size_t p = corner + static_cast<std::size_t>(j) * this->Width + i;
      const float* rgba = others.Colors + 4 * p;
      for (int c = 0; c < 4; ++c)
      {
        mean.Color[c] +=
          others.LinearLight && c < 3 ? static_cast<float>(LightOfCode(rgba[c])) : rgba[c];
      }
      mean.Nearness += 1.0 / others.Depth[p];
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

/// The patch that a pixel, or a square of them, sees of the plane through its source's depth with
/// its slopes of depth: position and its derivatives along x and y on the screen, whose cross
/// product is a pixel's area vector.
void DepthImageSurfels::MakeSurfel(const View& camera, const DepthImage& others, std::size_t s)
{
  const std::size_t place = this->Places[s].Place, source = this->Places[s].Source;
  const int side = this->Places[s].Side;
  const auto width = static_cast<std::size_t>(this->Width);
  const auto height = static_cast<std::size_t>(this->Height);
  const std::size_t p = source + static_cast<std::size_t>(side / 2) * (width + 1); // in the middle
  const std::size_t x = p % width, y = p / width;
  const Sample mean = this->MeanOf(others, source, side);
  const double z = 1.0 / mean.Nearness;
  const double slopeX = this->DepthSlope(others.Depth, p, 1, x > 0, x + 1 < width);
  const double slopeY = this->DepthSlope(others.Depth, p, width, y > 0, y + 1 < height);
  const double middle = 0.5 * side - others.Margin;
  const double rayX = (static_cast<double>(place % width) + middle - camera.Cx) / camera.Fx;
  const double rayY = (static_cast<double>(place / width) + middle - camera.Cy) / camera.Fy;
  const Vector3 position{ rayX * z, rayY * z, z };
  const Vector3 alongX{ z / camera.Fx + rayX * slopeX, rayY * slopeX, slopeX };
  const Vector3 alongY{ rayX * slopeY, z / camera.Fy + rayY * slopeY, slopeY };
  const Vector3 area{ alongX[1] * alongY[2] - alongX[2] * alongY[1],
    alongX[2] * alongY[0] - alongX[0] * alongY[2], alongX[0] * alongY[1] - alongX[1] * alongY[0] };
  const double faces = Dot(area, position) > 0.0 ? -1.0 : 1.0; // the lens
  // Kernels of a grid's points, a Gaussian each, taken together.
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
  cloud.Surface.Lit = false; // light is in the colours
  cloud.Prefilter = PixelPrefilter;
  return cloud;
}
}
