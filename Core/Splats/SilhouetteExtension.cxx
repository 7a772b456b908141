// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Splats/SilhouetteExtension.h"

#include <limits>

namespace SurfelSplatting
{
namespace
{
/// Kernels extend this many px beyond the disc.
constexpr float Reach = 2.0f;
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
  const float reach = this->Confusions[p] + Reach;
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
    this->Offer(x, y, p, n);
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
