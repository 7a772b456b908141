// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Splats/SilhouetteExtension.h"

#include <algorithm>
#include <limits>

namespace SurfelSplatting
{
namespace
{
/// Through the border of the lens, the edge of a thing is displaced against what is behind by the
/// difference of their nearness. Kernels extend beyond their discs by up to this share of the blur,
/// and by Reach px of their own.
constexpr float KernelReach = 0.125f;
constexpr float Reach = 2.0f;

/// Where a round surface turns away, nearness falls like a square root, by steps that grow by a
/// factor of at most 1 / (sqrt 2 - 1) = 2.4. Hence a step down is no edge if the next one is at
/// least this share of it.
constexpr float MinNextStep = 0.4f;
}

void SilhouetteExtension::Find(int width, int height, const std::vector<float>& nearness,
  const std::vector<float>& confusions, double minConfusion)
{
  this->Width = width;
  this->Height = height;
  this->MinConfusion = static_cast<float>(minConfusion);
  this->Nearness = nearness.data();
  this->Confusions = confusions.data();
  this->Sources.assign(nearness.size(), None);
  this->Squares.assign(nearness.size(), std::numeric_limits<std::int32_t>::max());
  this->Sweep(1);
  this->Sweep(-1);
}

/// The most by which the neighbours of a pixel are nearer.
float SilhouetteExtension::Rise(int x, int y) const
{
  float nearest = 0.0f;
  for (int j = std::max(0, y - 1); j <= std::min(this->Height - 1, y + 1); ++j)
  {
    for (int i = std::max(0, x - 1); i <= std::min(this->Width - 1, x + 1); ++i)
    {
      nearest = std::max(nearest, this->Nearness[static_cast<std::size_t>(j) * this->Width + i]);
    }
  }
  return nearest - this->Nearness[static_cast<std::size_t>(y) * this->Width + x];
}

/// Whether a surface ends between a pixel (x, y) and its neighbour (i, j) behind it. A slope goes
/// on: it is as steep before, or it falls on, or the surface ends beyond the neighbour.
inline bool SilhouetteExtension::IsEdge(int x, int y, int i, int j) const
{
  const float behind = this->Nearness[static_cast<std::size_t>(j) * this->Width + i];
  const float step = this->Nearness[static_cast<std::size_t>(y) * this->Width + x] - behind;
  if (!(step >= MinStep))
  {
    return false;
  }
  const int beyondX = std::clamp(2 * i - x, 0, this->Width - 1);
  const int beyondY = std::clamp(2 * j - y, 0, this->Height - 1);
  const float next =
    behind - this->Nearness[static_cast<std::size_t>(beyondY) * this->Width + beyondX];
  return next < MinNextStep * step && step > this->Rise(x, y);
}

/// Uses a source for a pixel if it is behind the pixel, near enough to be seen, and nearer than the
/// source so far.
inline void SilhouetteExtension::Offer(int x, int y, std::size_t p, std::int32_t source)
{
  if (source == None || !(this->Nearness[p] - this->Nearness[source] >= MinStep))
  {
    return;
  }
  const std::int32_t dx = x - source % this->Width, dy = y - source / this->Width;
  const std::int32_t square = dx * dx + dy * dy;
  const float behind = std::max(0.0f, this->Confusions[source]);
  const float reach = this->Nearness[p] - this->Nearness[source] +
    KernelReach * (this->Confusions[p] + behind) + Reach;
  if (square < this->Squares[p] && static_cast<float>(square) <= reach * reach)
  {
    this->Squares[p] = square;
    this->Sources[p] = source;
  }
}

/// Goes from the first row to the last or back, and in each row to and fro.
void SilhouetteExtension::Sweep(int direction)
{
  const bool forward = direction > 0;
  const auto offerFrom = [this](int x, int y, int i, int j) {
    const std::size_t p = static_cast<std::size_t>(y) * this->Width + x;
    if (i < 0 || i >= this->Width || j < 0 || j >= this->Height ||
      this->Confusions[p] < this->MinConfusion)
    {
      return;
    }
    const std::int32_t n = j * this->Width + i;
    if (this->IsEdge(x, y, i, j))
    {
      this->Offer(x, y, p, n);
    }
    this->Offer(x, y, p, this->Sources[n]);
  };
  for (int row = 0; row < this->Height; ++row)
  {
    const int y = forward ? row : this->Height - 1 - row;
    for (int x = 0; x < this->Width; ++x)
    {
      for (int i = x - 1; i <= x + 1; ++i)
      {
        offerFrom(x, y, i, y - direction);
      }
      offerFrom(x, y, x - 1, y);
    }
    for (int x = this->Width - 1; x >= 0; --x)
    {
      offerFrom(x, y, x + 1, y);
    }
  }
}
}
