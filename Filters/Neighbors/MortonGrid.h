// SPDX-License-Identifier: BSD-3-Clause
/**
 * Keys whose order keeps points near each other in space near each other (Morton 1966).
 */
#pragma once

#include "Filters/Common/RawVector.h"

#include <cstdint>

namespace SurfelGeometry
{
/// A cube of 2^21 cells a side.
struct MortonGrid
{
  double Lower[3] = { 0.0, 0.0, 0.0 };
  double Scale = 0.0; // cells per length

  /// The cube about these positions, [3n].
  explicit MortonGrid(const RawVector<float>& positions);

  /// Positions outside are taken to the nearest cell.
  std::uint64_t Key(const float* position) const;
};
}
