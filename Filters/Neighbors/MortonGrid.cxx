// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Neighbors/MortonGrid.h"

#include "Filters/Common/ParallelFor.h"

#include <algorithm>
#include <cstddef>
#include <limits>

namespace SurfelGeometry
{
namespace
{
constexpr double LastCell = (1 << 21) - 1;

constexpr vtkIdType PieceSize = 1 << 16;

struct Box
{
  static constexpr float Infinity = std::numeric_limits<float>::infinity();
  float Lower[3] = { Infinity, Infinity, Infinity };
  float Upper[3] = { -Infinity, -Infinity, -Infinity };

  void Add(const float* lower, const float* upper)
  {
    for (int c = 0; c < 3; ++c)
    {
      this->Lower[c] = std::min(this->Lower[c], lower[c]);
      this->Upper[c] = std::max(this->Upper[c], upper[c]);
    }
  }
};

/// Inserts two zero bits before each of the low 21 bits.
std::uint64_t SpreadBits(std::uint64_t x)
{
  x &= 0x1fffff;
  x = (x | x << 32) & 0x1f00000000ffff;
  x = (x | x << 16) & 0x1f0000ff0000ff;
  x = (x | x << 8) & 0x100f00f00f00f00f;
  x = (x | x << 4) & 0x10c30c30c30c30c3;
  return (x | x << 2) & 0x1249249249249249;
}
}

MortonGrid::MortonGrid(const RawVector<float>& positions)
{
  const auto count = static_cast<vtkIdType>(positions.size() / 3);
  std::vector<Box> boxes(static_cast<std::size_t>((count + PieceSize - 1) / PieceSize));
  ParallelFor(0, static_cast<vtkIdType>(boxes.size()), 1, [&](vtkIdType p, vtkIdType end) {
    for (; p < end; ++p)
    {
      const vtkIdType last = std::min(count, (p + 1) * PieceSize);
      for (vtkIdType i = p * PieceSize; i < last; ++i)
      {
        boxes[p].Add(positions.data() + 3 * i, positions.data() + 3 * i);
      }
    }
  });
  Box all;
  for (const Box& box : boxes)
  {
    all.Add(box.Lower, box.Upper);
  }
  double extent = 0.0;
  for (int c = 0; c < 3 && count > 0; ++c)
  {
    this->Lower[c] = all.Lower[c];
    extent = std::max(extent, static_cast<double>(all.Upper[c]) - all.Lower[c]);
  }
  this->Scale = extent > 0.0 ? LastCell / extent : 0.0;
}

std::uint64_t MortonGrid::Key(const float* position) const
{
  std::uint64_t key = 0;
  for (int c = 0; c < 3; ++c)
  {
    const double cell = (position[c] - this->Lower[c]) * this->Scale;
    key |= SpreadBits(static_cast<std::uint64_t>(std::clamp(cell, 0.0, LastCell))) << c;
  }
  return key;
}
}
