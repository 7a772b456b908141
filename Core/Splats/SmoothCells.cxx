// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Splats/SmoothCells.h"

#include "Core/Base/PixelBox.h"

#include <algorithm>
#include <limits>

namespace SurfelSplatting
{
namespace
{
constexpr int Channels = 5; // RGBA and nearness

/// Least and largest values of some pixels.
struct Range
{
  float Low[Channels], High[Channels];

  Range()
  {
    std::fill_n(this->Low, Channels, std::numeric_limits<float>::infinity());
    std::fill_n(this->High, Channels, -std::numeric_limits<float>::infinity());
  }

  void Join(const Range& other)
  {
    for (int c = 0; c < Channels; ++c)
    {
      this->Low[c] = std::min(this->Low[c], other.Low[c]);
      this->High[c] = std::max(this->High[c], other.High[c]);
    }
  }

  /// NaN is not small.
  bool IsSmall() const
  {
    bool isSmall = true;
    for (int c = 0; c < Channels; ++c)
    {
      const float most =
        c == Channels - 1 ? SmoothCells::MaxNearnessRange : SmoothCells::MaxColorRange;
      isSmall = isSmall && this->High[c] - this->Low[c] <= most;
    }
    return isSmall;
  }
};

Range RangeOfCell(const SmoothCells::Pixels& pixels, std::size_t corner)
{
  Range range;
  const auto width = static_cast<std::size_t>(pixels.Width);
  for (const std::size_t p : { corner, corner + 1, corner + width, corner + width + 1 })
  {
    const float drawn =
      pixels.Confusions[p] >= 0.0f ? 0.0f : std::numeric_limits<float>::infinity();
    for (int c = 0; c < Channels; ++c)
    {
      const float value = c < 4 ? pixels.Colors[4 * p + c] : pixels.Nearness[p];
      range.Low[c] = std::min(range.Low[c], value - drawn);
      range.High[c] = std::max(range.High[c], value + drawn);
    }
  }
  return range;
}

/// Ranges of a row's cells, each with those to its left and right.
void RangesOfRow(const SmoothCells::Pixels& pixels, int row, std::vector<Range>& ranges)
{
  const int columns = static_cast<int>(ranges.size());
  const std::size_t first = static_cast<std::size_t>(2 * row) * pixels.Width;
  Range before, own = RangeOfCell(pixels, first);
  for (int i = 0; i < columns; ++i)
  {
    const Range after = i + 1 < columns
      ? RangeOfCell(pixels, first + 2 * (static_cast<std::size_t>(i) + 1))
      : Range();
    ranges[i] = own;
    ranges[i].Join(before);
    ranges[i].Join(after);
    before = own;
    own = after;
  }
}
}

void SmoothCells::Find(const Pixels& pixels, const Executor& executor)
{
  const int rows = pixels.Height / 2;
  this->Columns = pixels.Width / 2;
  this->Cells.assign(static_cast<std::size_t>(rows) * this->Columns, 0);
  if (rows < 3 || this->Columns < 3)
  {
    return;
  }
  executor.For(static_cast<std::size_t>(rows), 16, [&](std::size_t begin, std::size_t end) {
    std::vector<Range> window[3]; // of rows
    for (std::vector<Range>& row : window)
    {
      row.resize(static_cast<std::size_t>(this->Columns));
    }
    const int first = std::max(1, static_cast<int>(begin));
    const int last = std::min(rows - 1, static_cast<int>(end));
    for (int row = first - 1; row <= last && first < last; ++row)
    {
      RangesOfRow(pixels, row, window[row % 3]);
      const int middle = row - 1;
      for (int i = 1; middle >= first && i + 1 < this->Columns; ++i)
      {
        Range range = window[0][i];
        range.Join(window[1][i]);
        range.Join(window[2][i]);
        this->Cells[PixelIndex(i, middle, this->Columns)] = range.IsSmall() ? 1 : 0;
      }
    }
  });
}

bool SmoothCells::Has(int x, int y, int side) const
{
  bool smooth = true;
  for (int j = y / 2; j < (y + side) / 2; ++j)
  {
    for (int i = x / 2; i < (x + side) / 2; ++i)
    {
      smooth = smooth && this->Cells[PixelIndex(i, j, this->Columns)] != 0;
    }
  }
  return smooth;
}
}
