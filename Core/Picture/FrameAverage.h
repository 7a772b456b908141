// SPDX-License-Identifier: BSD-3-Clause
/**
 * The mean of the pictures that the cells of a lens see.
 */
#pragma once

#include "Core/Base/Executor.h"
#include "Core/Raster/Frame.h"

#include <cstddef>
#include <vector>

namespace SurfelSplatting
{
/// Colours are averaged in float. A depth, which has no mean across a silhouette, is that of the
/// first picture, the lens's innermost cell's, which has one; 0 where the mean alpha stays below
/// one half.
class FrameAverage
{
public:
  /// Begins a mean; keeps its memory. @param frame receives the mean
  void Start(const Frame& frame, const Executor& executor);

  /// A frame to render the next picture into.
  const Frame& Next() const { return this->Scratch; }

  /// Adds the picture in Next().
  void Add();

  /// Divides the sum by the number of pictures.
  void Finish();

private:
  template <typename Function>
  void ForPixels(const Function& function) const;

  Frame Mean{};
  Frame Scratch{};
  const Executor* Threads = nullptr;
  std::vector<float> Color, Depth; // of the scratch frame
  int Count = 0;
};
}
