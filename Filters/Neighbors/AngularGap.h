// SPDX-License-Identifier: BSD-3-Clause
/**
 * Finds angular gaps between directions in a plane: there a surface may end.
 */
#pragma once

#include <utility>
#include <vector>

namespace SurfelGeometry
{
class Directions
{
public:
  static constexpr int Capacity = 256;

  void Clear();

  /// Adds a direction, at most `Capacity` of them; not (0, 0).
  void Add(float x, float y)
  {
    this->X[this->Count] = x;
    this->Y[this->Count] = y;
    ++this->Count;
    // Octants in the order of their angles, by the signs of x and y and whether |y| > |x|.
    constexpr unsigned char octants[8] = { 0, 3, 7, 4, 1, 2, 6, 5 };
    const bool steep = y * y > x * x;
    this->Octants |= 1u << octants[(x < 0.0f ? 1 : 0) | (y < 0.0f ? 2 : 0) | (steep ? 4 : 0)];
  }

  /// Whether an angle of more than 3/4 pi has no direction in it.
  bool HaveGap();

  /// Whether HaveGap() may be true, with more directions too.
  bool MayHaveGap() const
  {
    // Such an angle contains at least two whole octants.
    const unsigned int free = ~this->Octants & 255u;
    return (free & (free >> 1 | free << 7)) != 0;
  }

private:
  float X[Capacity], Y[Capacity];
  int Count = 0;
  unsigned int Octants = 0;                 // bits of the octants that have a direction
  std::vector<std::pair<float, int>> Order; // pseudo-angle and index
};
}
