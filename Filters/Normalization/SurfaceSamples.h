// SPDX-License-Identifier: BSD-3-Clause
/**
 * Samples of the surface of a surfel cloud, and the kernels that reach them.
 */
#pragma once

#include "Filters/Common/RawVector.h"
#include "Filters/Common/StageProgress.h"
#include "Filters/Normalization/SheetKernels.h"
#include "Filters/Normalization/SurfelTable.h"
#include "Filters/Normalization/WeightProblem.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace SurfelGeometry
{
/// A sample on the surface: in this process's statistics, or in the halo and thus in another's.
constexpr std::uint16_t CountedSample = 1, HaloSample = 2;

/// Samples of the surfels of one block, the unit of the parallel loops, and the kernels that reach
/// them.
struct SampleBlock
{
  /// A sample is the number of its entries, and its kind above these bits: CountedSample,
  /// HaloSample, or 0 beyond the border.
  static constexpr int KindShift = 12;

  int First = 0;                      // surfel
  std::vector<int> Others;            // surfels of other blocks, see SurfelTable
  std::vector<std::uint16_t> Owned;   // [surfels] number of samples
  std::vector<std::uint16_t> Samples; // one surfel's after another's
  RawVector<std::uint16_t> Numbers;   // [entries] of the surfel in the table
  RawVector<std::uint16_t> Kernels;   // [entries] K at the sample over K's peak, times KernelPeak

  static int Entries(std::uint16_t sample) { return sample & ((1 << KindShift) - 1); }
  static int Kind(std::uint16_t sample) { return sample >> KindShift; }

  /// Id of the surfel with this number in the table.
  int Id(std::size_t number) const
  {
    const std::size_t own = this->Owned.size();
    return number < own ? this->First + static_cast<int>(number) : this->Others[number - own];
  }
  std::size_t TableSize() const { return this->Owned.size() + this->Others.size(); }

  /// Keeps the memory.
  void Clear();
};

/// The area of a sample over that of its surfel.
double SampleShare(const WeightSettings& settings);

/// Surfels per block: their table never overflows.
inline int SampleBlockSize(const WeightSettings& settings)
{
  return SurfelTable::Capacity / (settings.NumberOfNeighbors + 1);
}

/// The samples of all surfels, and what is left of the kernels.
struct SampledSurface
{
  std::vector<SampleBlock> Blocks;
  RawVector<float> Areas;    // [n] world units squared; 0: no usable kernel
  RawVector<float> Peaks;    // [n] 1 / area
  RawVector<float> Overlaps; // [n] SurfelCloud::OverlapOf, [0, 1]
};

/// Called with each block, by its index, while the block and its table are in the caches. Several
/// threads call it at once.
using BlockVisitor = std::function<void(std::size_t, const SampleBlock&, const SurfelTable&)>;

/// Sets the number of blocks; Blocks are filled by MakeSamples().
void BeginSamples(const WeightProblem& problem, SampledSurface& surface);

/// Samples the cell of each surfel. Returns false if stopped.
bool MakeSamples(const WeightProblem& problem, const StageProgress& progress,
  const BlockVisitor& visit, SampledSurface& surface);
}
