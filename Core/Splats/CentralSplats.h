// SPDX-License-Identifier: BSD-3-Clause
/**
 * Splats through a cell at the centre of a divided lens (SubApertures.h), which those of all cells
 * of its shape follow from. Most of the set-up does not depend on the place and is done once.
 *
 * Depth and z-range are the same from everywhere on the lens. Through the cell at point u of the
 * lens, a unit disc, a splat is displaced by C u, and sees the part of Lens.h's VisibleArea that is
 * within the cell. Footprint and colour are taken to be those of the lens's centre. Pictures of
 * seven cells differ from those of cells set up one by one by 85 to 107 dB, a pixel by at most 1.2
 * levels of 255, and are as near to the limit of many cells.
 */
#pragma once

#include "Core/Base/Buffer.h"
#include "Core/Hierarchy/CutRange.h"
#include "Core/Splats/SetupTarget.h"
#include "Core/Splats/SplatContext.h"

#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

namespace SurfelSplatting
{
/// Bounds of a group of splats along x or y, px.
struct ReachAlong
{
  float Low, High;   ///< of what they may change, from the lens's centre
  float Least, Most; ///< of the displacements at the border of the whole lens
};

/// Bounds of a group of splats.
struct GroupReach
{
  ReachAlong X, Y;

  /// What they may change through a cell.
  PixelBox From(const CellOfLens& cell) const;
};

class CentralSplats
{
public:
  /// Forgets the last picture's splats; keeps memory.
  /// @param whole the picture through the lens that is divided; must outlive it
  void Clear(const SplatContext& whole);

  /// Whether splats of a cloud are shared: those of hierarchies of surfels.
  bool Holds(const SurfelCloud& cloud) const { return cloud.Clusters && !cloud.IsInSpace(); }

  /// Makes room for the splats of a cut's runs, and sets their places (CutRange::Central).
  void Add(std::vector<CutRange>& runs);

  /// The cell whose splats are asked for. @param radius of the cells, world units
  void SetCell(const Vector3& center, double radius);

  const SplatContext& Whole() const { return *this->Context; }
  const CellOfLens& Cell() const { return this->Current; }
  const Buffer<SplatGradient>& AllGradients() const { return this->Gradients; }

  /// Makes a run's splats by calling make(output) if they have not been made. Any thread may call
  /// it.
  template <typename Function>
  CentralOutput Get(const CutRange& run, const Function& make)
  {
    const CentralOutput output = this->At(run);
    if (this->Begin(run))
    {
      try
      {
        make(output);
      }
      catch (...)
      {
        this->Leave(run); // others must not wait forever
        throw;
      }
      this->Bound(run);
      this->End(run);
    }
    return output;
  }

  /// Bounds of the group that begins at a multiple of its size in a run; after Get.
  const GroupReach& Reach(const CutRange& run, std::size_t first) const
  {
    return this->Reaches[(run.Central + first) / CentralOutput::Group];
  }

  /// Prefetches a run's splats; false if they have not been made.
  bool Prefetch(const CutRange& run) const;

private:
  enum State : unsigned char
  {
    NotStarted,
    InProgress,
    Ready
  };

  CentralOutput At(const CutRange& run);
  bool Begin(const CutRange& run);
  void End(const CutRange& run);
  void Leave(const CutRange& run);
  void Bound(const CutRange& run);

  const SplatContext* Context = nullptr;
  CellOfLens Current;
  Buffer<Splat> Splats;
  Buffer<SplatGradient> Gradients;
  Buffer<float> Fields;
  Buffer<GroupReach> Reaches;                           // [place / Group]
  std::unique_ptr<std::atomic<unsigned char>[]> States; // [place / Group] of a run's first splat
  std::size_t NumberOfStates = 0;
};
}
