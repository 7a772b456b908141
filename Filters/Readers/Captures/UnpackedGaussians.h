// SPDX-License-Identifier: BSD-3-Clause
/**
 * Gaussians of compressed files, unpacked to the floats of LayoutOfUnpacked.
 */
#pragma once

#include "Filters/Common/ParallelFor.h"
#include "Filters/Readers/Captures/GaussianLayout.h"
#include "Filters/Readers/Points/FieldCloud.h"

#include <cstdint>
#include <cstring>

namespace PointCloud
{
/// 4 bytes, the lowest first, whatever the machine's order.
inline std::uint32_t LoadUnsigned(const std::uint8_t* at)
{
  return at[0] | at[1] << 8 | at[2] << 16 | static_cast<std::uint32_t>(at[3]) << 24;
}

/// Calls unpack(i, store) for i in [0, count) in parallel, which calls store(number) for each
/// number of Gaussian i, in the order of the layout. Throws std::bad_alloc.
template <typename Unpack>
FieldCloud UnpackGaussians(GaussianLayout layout, std::uint64_t count, const Unpack& unpack)
{
  FieldCloud gaussians;
  gaussians.Width = static_cast<std::uint32_t>(count);
  gaussians.Height = 1;
  gaussians.PointStep = layout.Step;
  gaussians.Fields.swap(layout.Fields);
  gaussians.Data.resize(count * gaussians.PointStep);
  SurfelGeometry::ParallelFor(0, static_cast<vtkIdType>(count), [&](vtkIdType i, vtkIdType end) {
    for (; i < end; ++i)
    {
      std::uint8_t* to = gaussians.Data.data() + i * gaussians.PointStep;
      unpack(static_cast<std::uint64_t>(i), [&to](double number) {
        const auto value = static_cast<float>(number);
        std::memcpy(to, &value, sizeof value);
        to += sizeof value;
      });
    }
  });
  return gaussians;
}
}
