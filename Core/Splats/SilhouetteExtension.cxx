// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Splats/SilhouetteExtension.h"

#include "Core/Base/PixelBox.h"

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
  const std::vector<float>& confusions, double minConfusion, const Executor& executor)
{
  this->Width = width;
  this->Height = height;
  this->MinConfusion = static_cast<float>(minConfusion);
  this->Nearness = nearness.data();
  this->Confusions = confusions.data();
  this->RunsPerRow = static_cast<std::size_t>((width + RunLength - 1) / RunLength);
  this->Sources.resize(nearness.size());
  this->Squares.resize(nearness.size());
  this->Runs.resize(this->RunsPerRow * height);
  this->Clear(executor);
  this->Sweep(1);
  this->Sweep(-1);
}

/// Clears the sources and finds the steps.
void SilhouetteExtension::Clear(const Executor& executor)
{
  executor.For(static_cast<std::size_t>(this->Height), 16, [&](std::size_t begin, std::size_t end) {
    const std::size_t first = begin * this->Width, count = (end - begin) * this->Width;
    std::fill_n(this->Sources.data() + first, count, None);
    std::fill_n(this->Squares.data() + first, count, std::numeric_limits<std::int32_t>::max());
    for (std::size_t y = begin; y < end; ++y)
    {
      unsigned char* runs = this->Runs.data() + y * this->RunsPerRow;
      std::fill_n(runs, this->RunsPerRow, static_cast<unsigned char>(0));
      for (int x = 0; x < this->Width; ++x)
      {
        runs[x / RunLength] |= this->IsStep(x, static_cast<int>(y)) ? HasStep : 0;
      }
    }
  });
}

/// Whether any of the eight neighbours is farther by MinStep.
inline bool SilhouetteExtension::IsStep(int x, int y) const
{
  const std::size_t p = PixelIndex(x, y, this->Width);
  const float limit = this->Nearness[p] - MinStep;
  if (this->Confusions[p] < this->MinConfusion)
  {
    return false;
  }
  bool found = false;
  for (int j = std::max(0, y - 1); j <= std::min(this->Height - 1, y + 1); ++j)
  {
    const float* row = this->Nearness + static_cast<std::size_t>(j) * this->Width;
    const float left = row[std::max(0, x - 1)], right = row[std::min(this->Width - 1, x + 1)];
    found = found || std::min({ left, row[x], right }) <= limit;
  }
  return found;
}

/// The most by which the neighbours of a pixel are nearer.
float SilhouetteExtension::Rise(int x, int y) const
{
  float nearest = 0.0f;
  for (int j = std::max(0, y - 1); j <= std::min(this->Height - 1, y + 1); ++j)
  {
    for (int i = std::max(0, x - 1); i <= std::min(this->Width - 1, x + 1); ++i)
    {
      nearest = std::max(nearest, this->Nearness[PixelIndex(i, j, this->Width)]);
    }
  }
  return nearest - this->Nearness[PixelIndex(x, y, this->Width)];
}

/// Whether a surface ends between a pixel (x, y) and its neighbour (i, j) behind it. A slope goes
/// on: it is as steep before, or it falls on, or the surface ends beyond the neighbour.
inline bool SilhouetteExtension::IsEdge(int x, int y, int i, int j) const
{
  const float behind = this->Nearness[PixelIndex(i, j, this->Width)];
  const float step = this->Nearness[PixelIndex(x, y, this->Width)] - behind;
  if (!(step >= MinStep))
  {
    return false;
  }
  const int beyondX = std::clamp(2 * i - x, 0, this->Width - 1);
  const int beyondY = std::clamp(2 * j - y, 0, this->Height - 1);
  const float next = behind - this->Nearness[PixelIndex(beyondX, beyondY, this->Width)];
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
    this->Runs[static_cast<std::size_t>(y) * this->RunsPerRow + x / RunLength] |= HasSource;
  }
}

inline void SilhouetteExtension::OfferFrom(int x, int y, int i, int j)
{
  const std::size_t p = PixelIndex(x, y, this->Width);
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
}

/// Whether any pixel of a run may be offered a source: by its own steps, by the run itself, or by
/// those beside it in its row and in the row before.
inline bool SilhouetteExtension::IsActive(int run, int y, int direction) const
{
  const auto first = static_cast<std::size_t>(std::max(0, run - 1));
  const std::size_t last = std::min(this->RunsPerRow - 1, static_cast<std::size_t>(run) + 1);
  const unsigned char* own = this->Runs.data() + static_cast<std::size_t>(y) * this->RunsPerRow;
  const int rowBefore = y - direction;
  const unsigned char* before = rowBefore < 0 || rowBefore >= this->Height
    ? own
    : this->Runs.data() + static_cast<std::size_t>(rowBefore) * this->RunsPerRow;
  unsigned int bits = own[run];
  for (std::size_t r = first; r <= last; ++r)
  {
    bits |= static_cast<unsigned int>(own[r] | before[r]) & HasSource;
  }
  return bits != 0;
}

/// Goes through a row to and fro.
void SilhouetteExtension::SweepRow(int y, int direction)
{
  const int runs = static_cast<int>(this->RunsPerRow);
  for (int run = 0; run < runs; ++run)
  {
    const int end = std::min(this->Width, (run + 1) * RunLength);
    for (int x = this->IsActive(run, y, direction) ? run * RunLength : end; x < end; ++x)
    {
      for (int i = x - 1; i <= x + 1; ++i)
      {
        this->OfferFrom(x, y, i, y - direction);
      }
      this->OfferFrom(x, y, x - 1, y);
    }
  }
  for (int run = runs - 1; run >= 0; --run)
  {
    const int begin = run * RunLength;
    const int end = std::min(this->Width, begin + RunLength);
    for (int x = this->IsActive(run, y, direction) ? end - 1 : begin - 1; x >= begin; --x)
    {
      this->OfferFrom(x, y, x + 1, y);
    }
  }
}

/// Goes from the first row to the last or back.
void SilhouetteExtension::Sweep(int direction)
{
  for (int row = 0; row < this->Height; ++row)
  {
    this->SweepRow(direction > 0 ? row : this->Height - 1 - row, direction);
  }
}
}
