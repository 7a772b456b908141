// SPDX-License-Identifier: BSD-3-Clause
#include "PixelSurfels.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace SurfelSplatting
{
namespace
{
/// Change of depth from a pixel to the next along a row or column: of the two neighbours' the
/// smaller one, since across a silhouette it is no slope. 0 where there is none.
double DepthSlope(
  const float* depth, std::size_t at, std::size_t step, bool hasBefore, bool hasAfter)
{
  const double z = depth[at];
  const double before = hasBefore ? z - depth[at - step] : INFINITY;
  const double after = hasAfter ? depth[at + step] - z : INFINITY;
  const double slope = std::abs(before) < std::abs(after) ? before : after;
  return std::isfinite(slope) ? slope : 0.0;
}

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

void PixelSurfels::TakePixels(const View& camera, const Lens& lens, const float* depth)
{
  const auto width = static_cast<std::size_t>(camera.Width);
  const double f = std::sqrt(std::abs(camera.Fx * camera.Fy));
  std::vector<float> confusions(width * camera.Height, 0.0f); // of the pixels that are taken
  for (std::size_t p = 0; p < confusions.size(); ++p)
  {
    const double z = depth[p];
    const double confusion =
      z > 0.0 && std::isfinite(z) ? f * lens.RelativeCircleOfConfusion(z) : 0.0;
    if (confusion >= LeastPixelConfusion)
    {
      const double absent = std::fmin(1.0, (confusion - LeastPixelConfusion) / PixelFade);
      this->Pixels.push_back({ p, static_cast<float>(absent) });
      this->Places.push_back({ static_cast<int>(p % width), static_cast<int>(p / width), p });
      confusions[p] = static_cast<float>(confusion);
    }
  }
  this->AddMargin(camera, confusions);
}

/// Places beyond the border, as the nearest pixel of the picture.
void PixelSurfels::AddMargin(const View& camera, const std::vector<float>& confusions)
{
  constexpr int margin = LargestMargin;
  const int width = camera.Width, height = camera.Height;
  for (int y = -margin; y < height + margin; ++y)
  {
    const bool inside = y >= 0 && y < height;
    for (int x = -margin; x < width + margin; ++x)
    {
      if (inside && x == 0)
      {
        x = width;
      }
      const int nearX = std::clamp(x, 0, width - 1), nearY = std::clamp(y, 0, height - 1);
      const std::size_t source = static_cast<std::size_t>(nearY) * width + nearX;
      const int distance = std::max(std::abs(x - nearX), std::abs(y - nearY));
      if (confusions[source] > 0.0f && static_cast<float>(distance) <= confusions[source] + 2.0f)
      {
        this->Places.push_back({ x, y, source });
      }
    }
  }
}

void PixelSurfels::Take(
  const View& camera, const Lens& lens, float* depth, const float* colors, const Executor& executor)
{
  this->Pixels.clear();
  this->Places.clear();
  this->CameraToWorld = Inverse(camera.WorldToCamera);
  if (camera.Parallel || lens.Radius == 0.0)
  {
    return;
  }
  this->TakePixels(camera, lens, depth);
  this->Positions.resize(3 * this->Size());
  this->Covariances.resize(6 * this->Size());
  this->AreaVectors.resize(3 * this->Size());
  this->Colors.resize(4 * this->Size());
  executor.For(this->Size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t s = begin; s < end; ++s)
    {
      this->MakeSurfel(camera, depth, colors, s);
    }
  });
  for (const Pixel& pixel : this->Pixels)
  {
    depth[pixel.Index] = std::numeric_limits<float>::infinity();
  }
}

/// The patch that a pixel sees of the plane through its point with its slopes of depth: position
/// and its derivatives along x and y on the screen, whose cross product is its area vector.
void PixelSurfels::MakeSurfel(
  const View& camera, const float* depth, const float* colors, std::size_t s)
{
  const Place& place = this->Places[s];
  const std::size_t p = place.Source;
  const auto width = static_cast<std::size_t>(camera.Width);
  const std::size_t x = p % width, y = p / width;
  const double z = depth[p];
  const double slopeX = DepthSlope(depth, p, 1, x > 0, x + 1 < width);
  const double slopeY =
    DepthSlope(depth, p, width, y > 0, y + 1 < static_cast<std::size_t>(camera.Height));
  const double rayX = (place.X + 0.5 - camera.Cx) / camera.Fx;
  const double rayY = (place.Y + 0.5 - camera.Cy) / camera.Fy;
  const Vector3 position{ rayX * z, rayY * z, z };
  const Vector3 alongX{ z / camera.Fx + rayX * slopeX, rayY * slopeX, slopeX };
  const Vector3 alongY{ rayX * slopeY, z / camera.Fy + rayY * slopeY, slopeY };
  Vector3 area{ alongX[1] * alongY[2] - alongX[2] * alongY[1],
    alongX[2] * alongY[0] - alongX[0] * alongY[2], alongX[0] * alongY[1] - alongX[1] * alongY[0] };
  const double side = Dot(area, position) > 0.0 ? -1.0 : 1.0; // it faces the lens
  float* s6 = this->Covariances.data() + 6 * s;
  constexpr double variance = PixelDeviation * PixelDeviation;
  const auto product = [&](int i, int j) {
    return static_cast<float>(variance * (alongX[i] * alongX[j] + alongY[i] * alongY[j]));
  };
  const float covariance[6] = { product(0, 0), product(1, 1), product(2, 2), product(0, 1),
    product(1, 2), product(0, 2) };
  for (int i = 0; i < 6; ++i)
  {
    s6[i] = covariance[i];
  }
  const float* rgba = colors + 4 * p;
  const float straight = rgba[3] > 0.0f ? 1.0f / rgba[3] : 0.0f;
  for (int i = 0; i < 3; ++i)
  {
    this->Positions[3 * s + i] = static_cast<float>(position[i]);
    this->AreaVectors[3 * s + i] = static_cast<float>(side * area[i]);
    this->Colors[4 * s + i] = rgba[i] * straight;
  }
  this->Colors[4 * s + 3] = rgba[3];
}

SurfelCloud PixelSurfels::Get() const
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
