// SPDX-License-Identifier: BSD-3-Clause
/**
 * Samples of the surface of a surfel cloud, and the kernels that reach them.
 */
#pragma once

#include "Filters/Common/StageProgress.h"
#include "Filters/Normalization/WeightProblem.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace SurfelGeometry
{
/// Owners (surfels and their samples) per block: the unit of the parallel loops.
constexpr vtkIdType SampleBlockSize = 4096;

/// A sample on the surface: in this process's statistics, or in the halo and thus in another's.
constexpr char CountedSample = 1, HaloSample = 2;

/// The nearest surfels of each surfel: only their kernels may reach its samples.
struct NeighborRows
{
  const int* Ids; // [Stride n], -1 where a surfel has fewer
  int Stride;
  int Used; // of each row

  const int* Row(int i) const { return this->Ids + this->Stride * static_cast<std::size_t>(i); }
};

/// Samples of the surfels of one block and the kernels that reach them.
struct SampleBlock
{
  /// A kernel's peak in Kernels.
  static constexpr float Peak = 65535.0f;

  std::vector<unsigned char> Ranks;   // [entries] 0: the sample's owner; k: Row(owner)[k - 1]
  std::vector<std::uint16_t> Kernels; // [entries] K at the sample over K's peak, times Peak
  std::vector<int> Ends{ 0 };         // [samples + 1] first entry of a sample
  std::vector<float> Weights;         // [samples] area
  std::vector<char> Inside;           // [samples] CountedSample, HaloSample; 0: beyond the border
  std::vector<int> Owned{ 0 };        // [surfels + 1] first sample of a surfel
  std::vector<unsigned char> Reached; // [surfels] number of ranks that its samples reach

  std::size_t Count() const { return this->Weights.size(); }
  int Surfels() const { return static_cast<int>(this->Owned.size()) - 1; }

  /// Keeps the memory.
  void Clear()
  {
    this->Ranks.clear();
    this->Kernels.clear();
    this->Ends.assign(1, 0);
    this->Weights.clear();
    this->Inside.clear();
    this->Owned.assign(1, 0);
    this->Reached.clear();
  }
};

/// Searches for the neighbours of all surfels. Returns false if stopped.
bool FindRows(const WeightProblem& problem, const StageProgress& progress, std::vector<int>& ids);

/// Samples the cell of each surfel. Returns false if stopped.
bool MakeSamples(const WeightProblem& problem, const NeighborRows& rows,
  const StageProgress& progress, std::vector<SampleBlock>& blocks);
}
