// SPDX-License-Identifier: BSD-3-Clause
/**
 * The median of many numbers by two parallel passes, without an array of them.
 */
#pragma once

#include "Filters/Common/ParallelFor.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <mutex>
#include <vector>

namespace SurfelGeometry
{
/// The bin of a number that is not negative: bits of floats are in their order.
inline std::size_t MedianBin(float number)
{
  std::uint32_t bits;
  number += 0.0f; // not -0
  std::memcpy(&bits, &number, sizeof bits);
  return bits >> 16;
}

/// The median, as Median() has it, of those float numbers valueOf(i), i < count, that are not
/// negative: the same at any number of threads. valueOf is called twice for each i.
template <typename ValueOf>
float ParallelMedian(vtkIdType count, const ValueOf& valueOf)
{
  constexpr std::size_t bins = 1 << 15;
  constexpr vtkIdType grain = 1 << 17; // several times the bins
  std::mutex mutex;
  std::vector<vtkIdType> sizes(bins, 0);
  ParallelFor(0, count, grain, [&](vtkIdType i, vtkIdType end) {
    std::vector<vtkIdType> part(bins, 0);
    for (; i < end; ++i)
    {
      const float value = valueOf(i);
      if (value >= 0.0f)
      {
        ++part[MedianBin(value)];
      }
    }
    const std::lock_guard<std::mutex> lock(mutex);
    std::transform(sizes.begin(), sizes.end(), part.begin(), sizes.begin(),
      [](vtkIdType a, vtkIdType b) { return a + b; });
  });
  vtkIdType total = 0;
  for (const vtkIdType size : sizes)
  {
    total += size;
  }
  if (total == 0)
  {
    return 0.0f;
  }
  vtkIdType rank = total / 2; // in the bin
  std::size_t bin = 0;
  for (; rank >= sizes[bin]; ++bin)
  {
    rank -= sizes[bin];
  }
  std::vector<float> values;
  ParallelFor(0, count, grain, [&](vtkIdType i, vtkIdType end) {
    std::vector<float> part;
    for (; i < end; ++i)
    {
      const float value = valueOf(i);
      if (value >= 0.0f && MedianBin(value) == bin)
      {
        part.push_back(value);
      }
    }
    const std::lock_guard<std::mutex> lock(mutex);
    values.insert(values.end(), part.begin(), part.end());
  });
  std::nth_element(values.begin(), values.begin() + rank, values.end());
  return values[static_cast<std::size_t>(rank)];
}
}
