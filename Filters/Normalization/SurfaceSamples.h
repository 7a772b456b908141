// SPDX-License-Identifier: BSD-3-Clause
/**
 * Samples of the surface of a surfel cloud, and the kernels that reach them.
 */
#pragma once

#include "Filters/Common/StageProgress.h"
#include "Filters/Normalization/SurfelTable.h"
#include "Filters/Normalization/WeightProblem.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace SurfelGeometry
{
/// A sample on the surface: in this process's statistics, or in the halo and thus in another's.
constexpr std::uint16_t CountedSample = 1, HaloSample = 2;

/// Samples of the surfels of one block, the unit of the parallel loops, and the kernels that reach
/// them. A surfel's samples are reached by the kernels in its row only.
struct SampleBlock
{
  /// A kernel's peak in Kernels.
  static constexpr float Peak = 65535.0f;

  /// A sample is the number of its entries, and its kind above these bits: CountedSample,
  /// HaloSample, or 0 beyond the border.
  static constexpr int KindShift = 12;

  int First = 0;                       // surfel
  std::vector<int> Others;             // surfels of other blocks, see SurfelTable
  std::vector<std::uint16_t> Rows;     // numbers in the table, one row after another
  std::vector<std::uint16_t> RowSizes; // [surfels]
  std::vector<std::uint16_t> Owned;    // [surfels] number of samples
  std::vector<std::uint16_t> Samples;  // one surfel's after another's
  std::vector<unsigned char> Ranks;    // [entries] in the row of the sample's owner
  std::vector<std::uint16_t> Kernels;  // [entries] K at the sample over K's peak, times Peak

  static int Entries(std::uint16_t sample) { return sample & ((1 << KindShift) - 1); }
  static int Kind(std::uint16_t sample) { return sample >> KindShift; }

  /// Id of the surfel with this number in the table.
  int Id(std::uint16_t number) const
  {
    const std::size_t own = this->Owned.size();
    return number < own ? this->First + number : this->Others[number - own];
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
  std::vector<float> Areas; // [n] world units squared; 0: no usable kernel
  std::vector<float> Peaks; // [n] 1 / area
};

/// Samples the cell of each surfel. Returns false if stopped.
bool MakeSamples(
  const WeightProblem& problem, const StageProgress& progress, SampledSurface& surface);
}
