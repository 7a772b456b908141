// SPDX-License-Identifier: BSD-3-Clause
/**
 * Samples of the surface of a surfel cloud, and the kernels that reach them.
 */
#pragma once

#include "Filters/Common/StageProgress.h"
#include "Filters/Normalization/KernelWeights.h"

#include <cstddef>
#include <vector>

namespace SurfelGeometry
{
/// Owners (surfels and their samples) per block: the unit of the parallel loops.
constexpr vtkIdType SampleBlockSize = 4096;

/// A sample on the surface that statistics count, and one that another process's do.
constexpr char CountedSample = 1, GuestSample = 2;

/// Samples of the surfels of one block and the kernels that reach them.
struct SampleBlock
{
  std::vector<int> Ids;       // [entries] surfel
  std::vector<float> Kernels; // [entries] K at the sample, 1 / area
  std::vector<int> Ends{ 0 }; // [samples + 1]
  std::vector<float> Weights; // [samples] area
  std::vector<char> Inside;   // [samples] whether it is on the surface, or beyond its border: of
                              // CountedSample, GuestSample, 0

  std::size_t Count() const { return this->Weights.size(); }

  /// Keeps its memory.
  void Clear()
  {
    this->Ids.clear();
    this->Kernels.clear();
    this->Ends.assign(1, 0);
    this->Weights.clear();
    this->Inside.clear();
  }
};

/// Samples each surfel's own cell. Returns false if stopped. @param sharing or null
bool MakeSamples(const LocalCloud& cloud, const std::vector<WeightSurfel>& surfels,
  const WeightSettings& settings, const WeightSharing* sharing, const StageProgress& monitor,
  std::vector<SampleBlock>& blocks);
}
