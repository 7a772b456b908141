// SPDX-License-Identifier: BSD-3-Clause
/**
 * Samples of the surface of a surfel cloud, and the kernels that reach them.
 */
#pragma once

#include "Filters/Common/StageProgress.h"
#include "Filters/Normalization/WeightProblem.h"

#include <cstddef>
#include <vector>

namespace SurfelGeometry
{
/// Owners (surfels and their samples) per block: the unit of the parallel loops.
constexpr vtkIdType SampleBlockSize = 4096;

/// A sample on the surface: in this process's statistics, or in the halo and thus in another's.
constexpr char CountedSample = 1, HaloSample = 2;

/// Samples of the surfels of one block and the kernels that reach them.
struct SampleBlock
{
  std::vector<int> Ids;       // [entries] surfel
  std::vector<float> Kernels; // [entries] K at the sample, 1 / area
  std::vector<int> Ends{ 0 }; // [samples + 1]
  std::vector<float> Weights; // [samples] area
  std::vector<char> Inside;   // [samples] CountedSample, HaloSample; 0: beyond the border

  std::size_t Count() const { return this->Weights.size(); }

  /// Keeps the memory.
  void Clear()
  {
    this->Ids.clear();
    this->Kernels.clear();
    this->Ends.assign(1, 0);
    this->Weights.clear();
    this->Inside.clear();
  }
};

/// Samples the cell of each surfel. Returns false if stopped.
bool MakeSamples(
  const WeightProblem& problem, const StageProgress& progress, std::vector<SampleBlock>& blocks);
}
