// SPDX-License-Identifier: BSD-3-Clause
/**
 * What goes on behind the edges of blurred things in a picture that has one layer: at most as far
 * as the blur lets it be seen, a surface is taken to go on behind its silhouette as its nearest
 * pixel is.
 *
 * Sources travel from pixel to pixel in two passes over the picture, as in the distance transform
 * by vectors of Danielsson (1980).
 */
#pragma once

#include <cstdint>
#include <vector>

namespace SurfelSplatting
{
class SilhouetteExtension
{
public:
  /**
   * @param nearness    [height][width] k / z: k is the focal length in px times the lens's radius,
   * so that differences are px of blur; 0 where there is nothing
   * @param confusions  [height][width] radius of the circle of confusion, px, negative where there
   * is nothing
   * @param least       confusion, px, from which on a pixel is seen through at its edges
   */
  void Find(int width, int height, const std::vector<float>& nearness,
    const std::vector<float>& confusions, double least);

  static constexpr std::int32_t None = -1;

  /// A surface ends where the blur behind it differs by so many px.
  static constexpr float LeastStep = 1.0f;

  /// The pixel whose surface, or nothing, goes on behind pixel p; None where that is not known.
  std::int32_t Behind(std::size_t p) const { return this->Sources[p]; }

private:
  void Sweep(int direction);
  void Offer(int x, int y, std::size_t p, std::int32_t source);

  int Width = 0;
  int Height = 0;
  float Least = 0.0f;
  const float* Nearness = nullptr; // during Find
  const float* Confusions = nullptr;
  std::vector<std::int32_t> Sources;
  std::vector<std::int32_t> Squares; // of the distances to them, px^2
};
}
