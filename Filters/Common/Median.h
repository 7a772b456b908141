// SPDX-License-Identifier: BSD-3-Clause
/**
 * The median of some numbers.
 */
#pragma once

#include <algorithm>
#include <vector>

namespace SurfelGeometry
{
/// Of an even number of values, the larger of the two in the middle; of none, 0. Changes their
/// order.
template <typename Number>
Number Median(std::vector<Number>& values)
{
  if (values.empty())
  {
    return Number{};
  }
  const auto middle = values.begin() + values.size() / 2;
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}
}
