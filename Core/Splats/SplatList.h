// SPDX-License-Identifier: BSD-3-Clause
/**
 * Everything that a frame draws: the splats of the surfels or nodes in the cut of all clouds, and
 * the tents of coarse grids. Both are numbered together, so that tiles sort and draw them as one
 * stream:
 *
 *   index: 0 ... splats ... | Splats.Size() ... tents ...
 *
 * CoarseGrid.h makes the tents after all splats are made; TileBinning.h assigns both to tiles.
 */
#pragma once

#include "Core/Base/Buffer.h"
#include "Core/Base/Executor.h"
#include "Core/Hierarchy/CutRange.h"
#include "Core/Splats/SetupTarget.h"
#include "Core/Splats/Splat.h"
#include "Core/Splats/Tent.h"

#include <cstdint>
#include <vector>

namespace SurfelSplatting
{
class SplatMaker;

struct SplatList
{
  /// Splats that were made together. There may be gaps between parts, since splats are not moved.
  struct Part
  {
    std::size_t Begin;
    std::size_t Count = 0;
    std::size_t Invalid = 0;         ///< not drawn: non-finite values, or too large for float sums
    std::size_t Blurred = 0;         ///< by the lens
    float LargestCoarseColor = 0.0f; ///< of splats on coarse grids, all channels
    unsigned int Levels = 0;         ///< bit l: some are on the grid of level l (CoarseGrid.h)
    float LargestDelay = 0.0f;       ///< of Orders over Splat::Near

    void Take(const SplatOutput& output);
  };

  std::vector<Part> Parts; ///< in the order of the surfels
  Buffer<Splat> Splats;
  Buffer<PixelBox> Boxes;
  Buffer<float> Orders;             ///< depths by which they are sorted: Splat::Near, but of
                                    ///< surfels behind another sheet more (SetupConstants.h)
  Buffer<SplatGradient> Gradients;  ///< of the splats that have one
  Buffer<LensFootprint> Footprints; ///< of all splats if there is a lens; else empty
  Buffer<unsigned char> Levels;     ///< of the coarse grid that a splat is on; 0: the picture
  Buffer<const Tent*> Tents;        ///< of coarse grids, whose memory they are in (CoarseGrid.h)
  Buffer<PixelBox> TentBoxes;       ///< copies of Tent::Box and Near, close together for sorting
  Buffer<float> TentNears;

  /// Empties the list and keeps its memory. @param footprints whether splats will have footprints
  void Clear(bool footprints = false);
  void Resize(std::size_t size);
  /// @param s has a gradient
  const SplatGradient& GradientOf(const Splat& s) const
  {
    return this->Gradients[static_cast<std::size_t>(s.Gradient)];
  }
  void ResizeTents(std::size_t size);
  const LensFootprint* FootprintOf(std::size_t i) const
  {
    return this->HasFootprints ? &this->Footprints[i] : nullptr;
  }

  /// Returns the output for the splats of a part; there must be room for them.
  SplatOutput OutputAt(std::size_t begin);

  /// Adds one splat, as a separate part. Call before tents are added.
  void Add(const Splat& splat, const PixelBox& box);

  bool IsTent(std::size_t i) const { return i >= this->Splats.Size(); }
  const Tent& TentAt(std::size_t i) const { return *this->Tents[i - this->Splats.Size()]; }

  /// All parts as one; its Begin means nothing.
  Part Sum() const;

  bool HasFootprints = false;

  /// Up to a few thousand surfels whose splats one thread makes. They begin within a run and may
  /// continue in the next ones.
  struct Chunk
  {
    const CutRange* Run;
    std::size_t Skip;
    std::size_t Size = 0;
  };
  std::vector<Chunk> Chunks; ///< of the last AppendSplats
};

/// Half-open range of a frame's runs.
struct CutRanges
{
  const CutRange *Begin, *End;
};

/// Makes the visible splats of a cloud's runs of surfels or nodes and appends them to the list.
void AppendSplats(
  const SplatMaker& maker, const CutRanges& runs, const Executor& executor, SplatList& list);

/// Runs of all surfels, for a cloud without a hierarchy.
void AllSurfels(const SurfelCloud& cloud, std::vector<CutRange>& runs);
}
