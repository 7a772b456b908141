// SPDX-License-Identifier: BSD-3-Clause
/**
 * Cuts a cloud into boxes with a bounded number of points, for filters that need much memory.
 */
#pragma once

#include "Filters/Common/IdType.h"

#include <limits>
#include <vector>

namespace SurfelGeometry
{
/// Half-open box, lower <= x < upper, relative to a local origin; infinite at the cloud's ends.
struct CloudRegion
{
  float Lower[3], Upper[3];

  CloudRegion()
  {
    for (int c = 0; c < 3; ++c)
    {
      this->Lower[c] = -std::numeric_limits<float>::infinity();
      this->Upper[c] = std::numeric_limits<float>::infinity();
    }
  }

  bool Contains(const float* p) const
  {
    return this->Lower[0] <= p[0] && p[0] < this->Upper[0] && this->Lower[1] <= p[1] &&
      p[1] < this->Upper[1] && this->Lower[2] <= p[2] && p[2] < this->Upper[2];
  }

  /// The box widened by a margin on every side.
  CloudRegion Grown(double margin) const;

  /// Distance from a point inside to the nearest side.
  double DistanceToSide(const float* p) const;
};

struct CloudPart
{
  CloudRegion Region;
  vtkIdType Size;  ///< points inside
  double Diagonal; ///< of the bounds of these points
};

/**
 * Halves the cloud across its longest side until no part has more than `largest` points. Parts of
 * points that share a coordinate may be larger: equal positions stay together.
 * @param positions [3n]; NaN points are in no part
 */
std::vector<CloudPart> CutCloud(const std::vector<float>& positions, vtkIdType largest);

/**
 * Cuts the cloud across its longest sides into regions with about the same number of points.
 * Regions are disjoint and cover space; if points share a coordinate, some regions may be empty.
 */
std::vector<CloudRegion> CutEvenly(const std::vector<float>& positions, int regions);

/// Ascending indices of the points in a region.
std::vector<vtkIdType> FindInside(const std::vector<float>& positions, const CloudRegion& region);
}
