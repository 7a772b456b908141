// SPDX-License-Identifier: BSD-3-Clause
/**
 * Colours of noisy points. Noise along a surface puts colours into wrong places: at an edge of a
 * texture, points of both sides are mixed. A straight edge is where half of the points come from
 * either side, so the neighbours vote: each point gets the colour among them that has the least sum
 * of differences to all, weighted by their distances (the vector median; Astola, Haavisto, Neuvo
 * 1990). Edges stay sharp.
 *
 * Scanners have noise along their rays, which keeps colours in place. Whether they are is told by
 * their variogram.
 */
#pragma once

#include "Filters/Common/VectorMath.h"
#include "Filters/Neighbors/ColorVariogram.h"

namespace SurfelGeometry
{
class ColorVote
{
public:
  /// More neighbours than these do not vote.
  static constexpr int Capacity = 48;

  void Begin() { this->Count = 0; }

  /// Adds a point of the neighbourhood, at first the one whose colour is chosen.
  /// @param u,v place in the tangent plane, spacings
  /// @param color red, green, blue, 0 to 255
  void Add(float u, float v, const Vector3& color);

  bool IsFull() const { return this->Count == Capacity; }

  /// Of all pairs of the points.
  ColorVariogram Measure() const;

  /// How far colours are from their places, over the noise: 0 to 1.
  /// @param sum of the variograms of a part of the cloud
  static float Displacement(const ColorVariogram& sum);

  /// The vector median.
  /// @param displacement standard deviation of the places, spacings, above 0
  void Choose(float displacement, unsigned char* result) const;

private:
  float SquaredDistance(int i, int k) const;

  int Count = 0;
  float U[Capacity], V[Capacity], Red[Capacity], Green[Capacity], Blue[Capacity];
};
}
