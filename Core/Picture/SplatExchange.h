// SPDX-License-Identifier: BSD-3-Clause
/**
 * Exchanges splats between ranks that render one picture together, each with its own surfels.
 * Splats are sent to the ranks on whose part of the screen they lie (sort-middle; Molnar, Cox,
 * Ellsworth, Fuchs 1994, "A sorting classification of parallel rendering"), and each rank resolves
 * a band of the picture.
 *
 * Compositing one picture per rank would be wrong: surfels of two ranks that overlap in depth form
 * one layer, whose weights are added up before it is normalised, and blurred layers mix with what
 * lies between them. Splats carry all of that. If they come in the same order, the bands equal the
 * serial picture bit by bit. The amount of data follows the number of splats: with a level of
 * detail it depends on the number of pixels, not of surfels.
 */
#pragma once

#include "Core/Base/Executor.h"
#include "Core/Base/Ranks.h"
#include "Core/Raster/Frame.h"
#include "Core/Splats/SplatList.h"

#include <cstdint>
#include <functional>
#include <vector>

namespace SurfelSplatting
{
/// Half-open range of rows, px.
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

  /// Call before the splats of a new picture.
  void BeginPicture() { this->Bands.clear(); }

  /**
   * Collective. Replaces the splats of this rank's surfels by those of all ranks that reach its
   * rows, rank after rank. The first splats of a picture determine the bands, for even work.
   * @throw RanksLackMemory on all ranks if one lacks memory for splats
   */
  void Exchange(int width, int height, const Executor& executor, SplatList& list);

  /// Ranks::DoOwn, for what lies between exchanges: a rank that fails takes part in no more.
  void DoOwn(const std::function<void()>& work) const { this->Group.DoOwn(work); }

  /// This rank's rows, multiples of tiles. With more ranks than rows of tiles, some have none.
  RowRange Rows() const { return this->Bands[static_cast<std::size_t>(this->Group.Rank())]; }

  /// Collective. Replaces values by the largest ones of all ranks.
  void ShareLargest(std::vector<float>& values) const;

  /// Collective. Copies each rank's rows into rank 0's frame.
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
