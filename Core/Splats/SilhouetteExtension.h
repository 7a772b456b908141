// SPDX-License-Identifier: BSD-3-Clause
/**
 * Extends surfaces behind the silhouettes of blurred things in an image with one layer: where the
 * blur of a thing lets its background shine through, the nearest pixel of the background is used.
 *
 * Sources are passed from pixel to pixel in two sweeps over the image, as in the vector distance
 * transform of Danielsson (1980).
 */
#pragma once

#include "Core/Base/Executor.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace SurfelSplatting
{
class SilhouetteExtension
{
public:
  /**
   * @param nearness    [height][width] k / z, where k is the focal length in px times the lens's
   * radius, so that differences are px of blur; 0 where there is nothing
   * @param confusions  [height][width] radius of the circle of confusion, px, negative where there
   * is nothing
   * @param minConfusion pixels with at least this confusion, px, are transparent at their edges
   */
  void Find(int width, int height, const std::vector<float>& nearness,
    const std::vector<float>& confusions, double minConfusion, const Executor& executor);

  static constexpr std::int32_t None = -1;

  /// A surface ends where nearness decreases by this many px and not as a slope does.
  static constexpr float MinStep = 1.0f;

  /// The pixel whose surface (or empty background) continues behind pixel p; None if not known.
  std::int32_t Behind(std::size_t p) const { return this->Sources[p]; }

  /// Whether any pixel of a row from column x on, to the next multiple of RunLength, has one.
  bool HasAny(std::size_t x, std::size_t y) const
  {
    return this->Runs[y * this->RunsPerRow + x / RunLength] & HasSource;
  }

  /// Pixels of a row that are passed over together where nothing can change.
  static constexpr int RunLength = 16;

private:
  /// Bits of a run.
  enum : unsigned char
  {
    HasStep = 1,  ///< some pixel has a neighbour that is farther by MinStep
    HasSource = 2 ///< some pixel has a source
  };
  void Clear(const Executor& executor);
  bool IsStep(int x, int y) const;
  bool IsActive(int run, int y, int direction) const;
  void Sweep(int direction);
  void SweepRow(int y, int direction);
  void OfferFrom(int x, int y, int i, int j);
  float Rise(int x, int y) const;
  bool IsEdge(int x, int y, int i, int j) const;
  void Offer(int x, int y, std::size_t p, std::int32_t source);

  int Width = 0;
  int Height = 0;
  float MinConfusion = 0.0f;
  const float* Nearness = nullptr; // during Find
  const float* Confusions = nullptr;
  std::vector<std::int32_t> Sources;
  std::vector<std::int32_t> Squares; // squared distances to them, px^2
  std::vector<unsigned char> Runs;   // [height][RunsPerRow]
  std::size_t RunsPerRow = 0;
};
}
