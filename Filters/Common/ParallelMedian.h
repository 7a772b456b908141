// SPDX-License-Identifier: BSD-3-Clause
/**
 * The median of many numbers by two parallel passes, without an array of them.
 */
#pragma once

#include "Filters/Common/ParallelFor.h"

#include "vtkSMPThreadLocal.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
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
  vtkSMPThreadLocal<std::vector<vtkIdType>> parts{ std::vector<vtkIdType>(bins, 0) };
  ParallelFor(0, count, [&](vtkIdType i, vtkIdType end) {
    std::vector<vtkIdType>& sizes = parts.Local();
    for (; i < end; ++i)
    {
      const float value = valueOf(i);
      if (value >= 0.0f)
      {
        ++sizes[MedianBin(value)];
      }
    }
  });
  std::vector<vtkIdType> sizes(bins, 0);
  vtkIdType total = 0;
  for (const std::vector<vtkIdType>& part : parts)
  {
    std::transform(sizes.begin(), sizes.end(), part.begin(), sizes.begin(),
      [](vtkIdType a, vtkIdType b) { return a + b; });
  }
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
  vtkSMPThreadLocal<std::vector<float>> found;
  ParallelFor(0, count, [&](vtkIdType i, vtkIdType end) {
    std::vector<float>& mine = found.Local();
    for (; i < end; ++i)
    {
      const float value = valueOf(i);
      if (value >= 0.0f && MedianBin(value) == bin)
      {
        mine.push_back(value);
      }
    }
  });
  std::vector<float> values;
  for (const std::vector<float>& part : found)
  {
    values.insert(values.end(), part.begin(), part.end());
  }
  std::nth_element(values.begin(), values.begin() + rank, values.end());
  return values[static_cast<std::size_t>(rank)];
}
}
