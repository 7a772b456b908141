// SPDX-License-Identifier: BSD-3-Clause
/**
 * Makes splats when a tile first needs them. Those behind opaque layers are never made.
 *
 * The runs of nodes of the cut (HierarchyCut.h) are sorted by near depth, and each tile has a list
 * of those that can reach it. A tile asks for one run after the other (TileRaster.h). Splats that
 * begin in front of the next run are complete and can be drawn. Once all of a tile is opaque, the
 * rest of its runs is skipped, and a run that no tile needs is never set up. A run is set up once,
 * by the first tile that needs it; its splats do not depend on which tile this is.
 *
 * Little shines through a capture in front of its far side, but not nothing. A tile that lets less
 * than CoarserBelow() through can ask for a run's ancestors instead, an eighth as many
 * (Core/Raster/AncestorChoice.h).
 */
#pragma once

#include "Core/Base/KeySorter.h"
#include "Core/Hierarchy/HierarchyCut.h"
#include "Core/Splats/SplatList.h"
#include "Core/Splats/SplatMaker.h"

#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

namespace SurfelSplatting
{
class LazySplats
{
public:
  /// Forgets the last frame's runs; keeps memory. @param context must outlive the frame
  void Clear(const SplatContext& context);

  /// Adds a cloud's runs that are not on coarse grids.
  void Add(const SurfelCloud& cloud, const CutRanges& runs);

  /// Sorts the runs and assigns them to the tiles of the picture.
  void Bin(const PictureSize& size);

  bool IsEmpty() const { return this->Runs.empty(); }

  /// The transmittance below which coarser runs are good enough; 0: there are none.
  struct LittleLight
  {
    float OfVolumes = 0.0f;
    float OfCaptures = 0.0f; ///< root mean square where a run is
    float InBlur = 0.0f;     ///< root mean square in a block of pixels, if the lens blurs the run
  };
  const LittleLight& CoarserBelow() const { return this->Little; }
  bool HasCoarser(std::uint32_t run) const { return this->Runs[run].HasCoarser; }

  /// Runs that can reach a tile, by ascending near depth.
  const std::uint32_t* Begin(std::size_t tile) const
  {
    return this->TileRuns.data() + this->Offsets[tile];
  }
  const std::uint32_t* End(std::size_t tile) const
  {
    return this->TileRuns.data() + this->Offsets[tile + 1];
  }
  /// Whether the lens blurs all of a run by a pixel or more.
  bool IsBlurred(std::uint32_t run) const { return this->Runs[run].Chosen.Blur >= 1.0f; }
  bool IsOfVolume(std::uint32_t run) const { return this->Runs[run].IsOfVolume; }
  /// Contains a run's splats, whatever they are made of.
  const PixelBox& Bounds(std::uint32_t run) const { return this->Runs[run].Chosen.Box; }
  float Near(std::uint32_t run) const { return this->Runs[run].Chosen.Near; }
  float Far(std::uint32_t run) const { return this->Runs[run].Chosen.Far; }

  /// A run's nodes, or their ancestors.
  struct Wanted
  {
    std::uint32_t Run;
    bool Coarser;
  };
  /// Prefetches the surfels of a run that will be needed soon, or what sorts its splats.
  void Prefetch(const Wanted& wanted) const;

  /// Lets surfels that are in a file be read in the background: those of the next runs of a tile.
  void Announce(const std::uint32_t* run, const std::uint32_t* end) const;

  /// A run's splats, as indices into Splats(). Makes them if necessary. Any thread may call it.
  const SplatList::Part& Get(const Wanted& wanted);

  /// Contains the boxes of a run's splats; after Get.
  const PixelBox& Box(const Wanted& wanted) const { return this->At(wanted).Box; }

  const SplatList& Splats() const { return this->List; }

  struct Counts
  {
    std::uint64_t Splats = 0;
    std::uint64_t Blurred = 0;
    std::uint64_t Invalid = 0;
    std::uint64_t Hidden = 0; ///< nodes and surfels that were never set up
    double Seconds = 0;       ///< summed over all threads
  };
  Counts Count() const;

private:
  enum Progress : unsigned char
  {
    NotStarted,
    InProgress,
    Ready
  };

  /// What is made of a run.
  struct Made
  {
    SplatList::Part Part{};
    PixelBox Box{ 0, 0, 0, 0 }; ///< of the part's splats
    float Seconds = 0;
  };

  struct Run
  {
    const SplatMaker* Maker;
    CutRange Chosen;
    bool HasCoarser, IsOfVolume;
    Made Own{};
  };

  void SortRuns();
  CutRange Range(const Wanted& wanted) const;
  const Made& At(const Wanted& wanted) const
  {
    return wanted.Coarser ? this->Coarser[wanted.Run] : this->Runs[wanted.Run].Own;
  }
  std::atomic<unsigned char>& State(const Wanted& wanted) const
  {
    return this->States[wanted.Run + (wanted.Coarser ? this->Runs.size() : 0)];
  }
  void Make(const Wanted& wanted, Made& made);
  PixelBox Union(const SplatList::Part& part) const;

  SplatContext Context;
  std::vector<std::unique_ptr<SplatMaker>> Makers; // of the clouds so far, and of earlier frames
  bool HasGuards = false;                          // some clouds are in files
  std::size_t NumberOfClouds = 0;
  LittleLight Little;
  std::vector<Run> Runs;
  std::vector<Made> Coarser;        // of each run, if some clouds have coarser ones
  std::vector<std::uint64_t> Order; // near depth above, index of the run below
  KeySorter Sorter;
  std::unique_ptr<std::atomic<unsigned char>[]> States;
  std::size_t NumberOfStates = 0;
  std::vector<std::uint64_t> Offsets, Cursors;
  std::vector<std::uint32_t> TileRuns;
  SplatList List; ///< without parts
};
}
