// SPDX-License-Identifier: BSD-3-Clause
/**
 * The median of some numbers.
 */
#pragma once

#include <algorithm>

namespace SurfelGeometry
{
/// Of a vector or an array. Of an even number of values, the larger of the two in the middle; of
/// none, 0. Changes their order.
template <typename Values>
typename Values::value_type Median(Values& values)
{
  if (values.empty())
  {
    return {};
  }
  const auto middle = values.begin() + values.size() / 2;
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}
}
