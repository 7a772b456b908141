// SPDX-License-Identifier: BSD-3-Clause
/**
 * Data of a hierarchy that a mapper keeps from frame to frame: bounds of its clusters for choosing
 * the level of detail, and colours and leaf covariances of its nodes. A hierarchy from a file
 * brings bounds and colours along. Internal to the module.
 */
#pragma once

#include "Core/Base/Buffer.h"
#include "Core/Base/Executor.h"
#include "Core/Files/ArrayFile.h"
#include "Core/Hierarchy/ClusterBounds.h"
#include "Core/Hierarchy/LeafPlacement.h"
#include "Core/Surfels/SurfelCloud.h"

#include <vtkType.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

class vtkPolyData;
class vtkDataArray;

namespace SurfelSplatting
{
class HierarchyCache
{
public:
  /**
   * Points the cloud, whose surfel arrays are set, to the hierarchy's nodes, cluster bounds and
   * colours. Computes the last two again only if the input or its colours have changed. Returns an
   * empty string, or what is wrong with the input and what to do. Throws DamagedMemory if the input
   * is from a file that is damaged.
   *
   * Where what nodes average was changed, added or removed behind vtkSurfelHierarchy, the cloud
   * gets nodes of its own. Where an affine map has moved the points, the cloud gets their old
   * places, and the map becomes its LocalToWorld. If points were selected, or moved otherwise, the
   * cloud gets no nodes: TakeWarning.
   * @param colors   of all surfels, or null
   * @param paperCut whether the paper's rule chooses the level of detail; it needs leaf covariances
   */
  std::string Update(vtkPolyData* input, vtkDataArray* colors, bool paperCut,
    const Executor& executor, SurfelCloud& cloud);

  /// Points the cloud to its harmonics, packed; after Update, if the input is a hierarchy. Packs
  /// them again only if the input has changed.
  /// @param coefficients point array Arrays::GaussianHarmonics of a valid size
  void UpdateHarmonics(
    vtkPolyData* input, vtkDataArray* coefficients, const Executor& executor, SurfelCloud& cloud);

  /// What the last updates have to say, once for each state of an input; otherwise empty.
  std::string TakeWarning();

  /// Number of surfels whose cluster bounds or colours were computed, in all updates together.
  std::uint64_t NumberOfPreparedSurfels() const { return this->PreparedSurfels; }

private:
  void NoteSelection(vtkPolyData* input);
  void Examine(vtkPolyData* input, const Executor& executor, SurfelCloud& cloud);
  void Settle(const SurfelCloud& moved, const Executor& executor);
  void UseSettled(SurfelCloud& cloud) const;
  bool RemakeNodes(vtkPolyData* input, const HierarchyLayout& layout, const Executor& executor,
    SurfelCloud& cloud);
  void CheckFile(const Executor& executor) const;
  const NodeColor* UpdateColors(vtkPolyData* input, vtkDataArray* colors,
    const HierarchyLayout& layout, const Executor& executor, const SurfelCloud& cloud);

  /// An object in a certain state. No MTime is ever given twice.
  struct State
  {
    const void* Object = nullptr;
    vtkMTimeType Time = 0;
    bool operator==(const State& other) const
    {
      return this->Object == other.Object && this->Time == other.Time;
    }
  };

  State InputState, ColorState, HarmonicsState;
  LeafPlacement Placement;
  std::vector<float> SettledPoints, SettledAreas; ///< where the nodes know them; empty: the input's
  Buffer<HierarchyNode> Nodes; ///< if the input's are no longer those of its surfels; else empty
  std::string Warning;
  ClusterBounds Bounds;
  Buffer<NodeColor> Colors;
  std::vector<float> LeafCovariances;
  std::vector<float> Uncovered; ///< of FindUncovered, if HasUncovered; colours do not change it
  bool HasUncovered = false;
  std::vector<PackedHarmonics> Harmonics;
  Buffer<NodeColor> HarmonicColors;
  std::shared_ptr<const ArrayFile> File; ///< that the hierarchy is in and checked by, or null
  vtkMTimeType StoredTime = 0;           ///< of the bounds in the file
  std::uint64_t PreparedSurfels = 0;
};
}
