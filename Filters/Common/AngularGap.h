// SPDX-License-Identifier: BSD-3-Clause
/**
 * Directions in a plane, and whether they leave a gap: where a surface may end.
 */
#pragma once

#include <vector>

namespace SurfelGeometry
{
class Directions
{
public:
  static constexpr int Most = 256;

  void Clear();

  /// At most `Most` of them, none of them (0, 0).
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

  /// Whether there is an angle of more than 3/4 pi without any direction.
  bool HaveGap();

private:
  float X[Most], Y[Most];
  int Count = 0;
  unsigned int Octants = 0; // that have a direction
  std::vector<double> Angles;
};
}
