// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Common/MortonGrid.h"

#include <algorithm>
#include <cstddef>
#include <limits>

namespace SurfelGeometry
{
namespace
{
constexpr double LastCell = (1 << 21) - 1;

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

MortonGrid::MortonGrid(const std::vector<float>& positions)
{
  constexpr double infinity = std::numeric_limits<double>::infinity();
  double extent = 0.0;
  for (std::size_t c = 0; c < 3 && !positions.empty(); ++c)
  {
    double lower = infinity, upper = -infinity;
    for (std::size_t i = c; i < positions.size(); i += 3)
    {
      const double x = positions[i];
      lower = std::min(lower, x);
      upper = std::max(upper, x);
    }
    this->Lower[c] = lower;
    extent = std::max(extent, upper - lower);
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
