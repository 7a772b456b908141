// SPDX-License-Identifier: BSD-3-Clause
/**
 * Averages the pictures that the cells of a lens see.
 */
#pragma once

#include "Core/Base/Executor.h"
#include "Core/Picture/DoubtfulTiles.h"
#include "Core/Raster/Frame.h"

#include <cstddef>
#include <vector>

namespace SurfelSplatting
{
/// Colours are averaged in float. Depths have no mean across a silhouette: each pixel takes its
/// depth from the first picture that has one, beginning with the innermost cell; 0 where the mean
/// alpha stays below one half.
class FrameAverage
{
public:
  /// Begins a new mean; memory is kept.
  /// @param frame receives the mean
  /// @param where the tiles that are averaged; it must stay as it is until Finish
  void Start(const Frame& frame, const DoubtfulTiles& where, const Executor& executor);

  /// The frame to render the next picture into.
  const Frame& Next() const { return this->Scratch; }

  /// Adds a tile of the picture in Next(). Several threads may add different tiles.
  void Add(std::size_t tile);

  /// All tiles of a picture have been added.
  void EndPicture() { ++this->Count; }

  /// Divides the sum by the number of pictures.
  void Finish();

private:
  template <typename Function>
  void ForRows(std::size_t tile, const Function& function) const;

  Frame Mean{};
  Frame Scratch{};
  const DoubtfulTiles* Where = nullptr;
  const Executor* Threads = nullptr;
  std::vector<float> Color, Depth; // of the scratch frame
  int Count = 0;                   // of complete pictures
};
}
