// SPDX-License-Identifier: BSD-3-Clause
/**
 * A cloud cut into boxes of a bounded number of points, for what takes much memory a point.
 */
#pragma once

#include "vtkType.h"

#include <limits>
#include <vector>

namespace SurfelGeometry
{
/// Half-open box, lower <= x < upper, about a local origin; infinite where the cloud ends.
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

  /// All that is nearer than this, in each coordinate.
  CloudRegion Grown(double margin) const;

  /// From a point inside to the nearest side.
  double DistanceToSide(const float* p) const;
};

struct CloudPart
{
  CloudRegion Region;
  vtkIdType Size;  ///< points inside
  double Diagonal; ///< of these points' bounds
};

/**
 * Halves the cloud across its longest side until no part has more points than `largest`, but for
 * points that share a coordinate: equal positions are never parted.
 * @param positions [3n]; points that are NaN are in no part
 */
std::vector<CloudPart> CutCloud(const std::vector<float>& positions, vtkIdType largest);

/**
 * Cuts the cloud into regions of about as many points each, across its longest sides. Regions are
 * disjoint and cover space; where points share a coordinate, some may be empty.
 */
std::vector<CloudRegion> CutEvenly(const std::vector<float>& positions, int regions);

/// Ascending indices of the points in a region.
std::vector<vtkIdType> FindInside(const std::vector<float>& positions, const CloudRegion& region);
}
