// SPDX-License-Identifier: BSD-3-Clause
/**
 * One picture by several ranks, each with surfels of its own: splats are sorted to where they lie
 * on the screen (sort-middle; Molnar, Cox, Ellsworth, Fuchs 1994, "A sorting classification of
 * parallel rendering"), and each rank resolves a band of the picture.
 *
 * A picture of each rank's surfels alone would not do: where surfels of two ranks overlap in depth
 * they are one layer, whose weights are added up before it is normalized, and blurred layers mix
 * with what lies between them. Splats carry all of that; the bands are those of the serial picture,
 * bit by bit, where the splats come in the same order. What is sent follows the number of splats,
 * thus with a level of detail that of the pixels, not that of the surfels.
 */
#pragma once

#include "Core/Base/Executor.h"
#include "Core/Base/Ranks.h"
#include "Core/Raster/Frame.h"
#include "Core/Splats/SplatList.h"

#include <cstdint>
#include <vector>

namespace SurfelSplatting
{
/// Half-open, px.
struct RowRange
{
  int Begin, End;
};

class SplatExchange
{
public:
  /// @param ranks must outlive this
  explicit SplatExchange(Ranks& ranks)
    : Group(ranks)
  {
  }

  struct Counts
  {
    std::uint64_t Splats = 0, Gradients = 0;
  };

  /// Before the splats of a new picture.
  void BeginPicture() { this->Bands.clear(); }

  /**
   * Collective. Replaces the splats of this rank's surfels by those of all ranks that reach its
   * rows, rank after rank. The bands are chosen by the first splats of a picture, for even work.
   * @param good whether this rank's splats could be made
   * @throw RanksLackMemory on all ranks where one is not good or cannot pack its splats
   */
  void Exchange(int width, int height, bool good, const Executor& executor, SplatList& list);

  /// This rank's rows, multiples of tiles; where there are more ranks than tiles, perhaps none.
  RowRange Rows() const { return this->Bands[static_cast<std::size_t>(this->Group.Rank())]; }

  /// Collective. Each rank's rows into rank 0's frame.
  void Collect(const Frame& frame);

private:
  void ChooseBands(int width, int height, const SplatList& list);
  std::vector<Counts> CountSplats(const Executor& executor, const SplatList& list) const;
  std::vector<Message> Pack(const Executor& executor, const SplatList& list) const;
  void Unpack(const std::vector<Message>& messages, const Executor& executor, SplatList& list);

  Ranks& Group;
  std::vector<RowRange> Bands; ///< [rank]
};
}
