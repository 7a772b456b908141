// SPDX-License-Identifier: BSD-3-Clause
/**
 * The plane of some points by PCL: their covariance and its principal directions, by the functions
 * that pcl::NormalEstimation calls, as instances in double.
 */
#pragma once

#include "Filters/Common/VectorMath.h"
#include "Filters/Neighbors/LocalCloud.h"

#include <pcl/common/centroid.h>
#include <pcl/common/eigen.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>

namespace SurfelGeometry
{
/// A point and some of its neighbours, relative to it. Each thread reuses one.
class Patch
{
public:
  /// Loads point i and its neighbours.
  /// @param ids [count]
  void Load(const LocalCloud& cloud, int i, const int* ids, int count)
  {
    const float* p = cloud.Position(i);
    this->Points.resize(static_cast<std::size_t>(count) + 1);
    this->Points[0] = pcl::PointXYZ(0.0f, 0.0f, 0.0f);
    for (int k = 0; k < count; ++k)
    {
      // Differences to the point itself are exact where neighbours are near each other.
      const float* q = cloud.Position(ids[k]);
      this->Points[k + 1] = pcl::PointXYZ(q[0] - p[0], q[1] - p[1], q[2] - p[2]);
    }
  }

  /// Covariance about the mean, divided by the number of neighbours: an unbiased estimate. In a
  /// disc of radius r, whose centre is the point itself and whose rim the outermost neighbour is
  /// on, it is exactly r^2/4 per axis.
  Eigen::Matrix3d Covariance() const
  {
    Eigen::Matrix3d covariance;
    Eigen::Vector4d mean;
    pcl::computeMeanAndCovarianceMatrix(this->Points, covariance, mean);
    const auto count = static_cast<double>(this->Points.size());
    return count / std::max(count - 1.0, 1.0) * covariance;
  }

private:
  pcl::PointCloud<pcl::PointXYZ> Points;
};

/// Minimum variance of the neighbours in p^2, where p is the distance of the second neighbour. A
/// line of points of pitch p then gets the area p^2 per point: n points have the variance p^2 n^2 /
/// 12 along the line, and AreaPerPoint gives 12 / (16 pi^2) across.
constexpr double LineVariance = 12.0 / (16.0 * 9.8696044);

/// Area per point of an even disc or ellipse of so many points with these variances.
inline double AreaPerPoint(double larger, double smaller, int count)
{
  return 4.0 * Pi / count * std::sqrt(larger * smaller);
}

/// Principal variances, ascending, and the direction of the first, of length 1.
struct Principal
{
  Eigen::Vector3d Variances;
  Eigen::Vector3d Normal;

  explicit Principal(const Eigen::Matrix3d& covariance)
  {
    pcl::eigen33(covariance, this->Variances);
    if (this->Variances[1] - this->Variances[0] > ClearGap * this->Variances[2])
    {
      pcl::computeCorrespondingEigenVector(covariance, this->Variances[0], this->Normal);
    }
    else
    {
      Eigen::Matrix3d directions; // columns
      pcl::eigen33(covariance, directions, this->Variances);
      this->Normal = directions.col(0);
    }
  }

private:
  /// Of the variances, in the largest. With less, only all directions together are exact.
  static constexpr double ClearGap = 0.05;
};

inline Vector3 ToVector(const Eigen::Vector3d& a)
{
  return { a[0], a[1], a[2] };
}
}
