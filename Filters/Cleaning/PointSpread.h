// SPDX-License-Identifier: BSD-3-Clause
/**
 * How the neighbours of a point are spread: PCL's mean, covariance and eigenvalues.
 */
#pragma once

#include "Filters/Neighbors/LocalCloud.h"
#include "Filters/Neighbors/Neighbors.h"

#include <pcl/common/centroid.h>
#include <pcl/common/eigen.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

namespace SurfelGeometry
{
/// Neighbours of a mean distance. Fewer than this many points that are near each other, and far
/// from all others, are stray points too.
constexpr int StrayNeighbors = 16;

/// A set of points fills space if its smallest variance is above this part of its largest: 16
/// uniform points in a ball have 0.35, in a disc with noise of a quarter of their spacing 0.05.
constexpr double FillsSpace = 0.05;

/// Neighbours relative to their point, whose differences are exact at any coordinates. Each thread
/// reuses one.
using NearCloud = pcl::PointCloud<pcl::PointXYZ>;

inline void LoadNear(const LocalCloud& cloud, int i, const Neighbors& neighbors, NearCloud& near)
{
  const float* p = cloud.Position(i);
  near.resize(neighbors.Ids.size());
  for (int k = 0; k < neighbors.Count(); ++k)
  {
    const float* q = cloud.Position(neighbors.Ids[k]);
    near[k] = pcl::PointXYZ(q[0] - p[0], q[1] - p[1], q[2] - p[2]);
  }
}

/// Principal variances, ascending, and their axes, of points about their mean. World units.
struct PointSpread
{
  Eigen::Vector3d Mean;
  Eigen::Vector3d Variances;
  Eigen::Matrix3d Axes; // columns
};

/// The variances alone.
inline Eigen::Vector3d VariancesOf(const NearCloud& near)
{
  Eigen::Matrix3d covariance;
  Eigen::Vector4d mean;
  Eigen::Vector3d variances;
  pcl::computeMeanAndCovarianceMatrix(near, covariance, mean);
  pcl::eigen33(covariance, variances);
  return variances.cwiseMax(0.0);
}

inline PointSpread SpreadOf(const NearCloud& near)
{
  Eigen::Matrix3d covariance;
  Eigen::Vector4d mean;
  pcl::computeMeanAndCovarianceMatrix(near, covariance, mean);
  PointSpread spread;
  spread.Mean = mean.head<3>();
  pcl::eigen33(covariance, spread.Axes, spread.Variances);
  spread.Variances = spread.Variances.cwiseMax(0.0);
  return spread;
}

/// @param variances ascending
inline bool FillsSpaceAround(const Eigen::Vector3d& variances)
{
  return variances[0] > FillsSpace * variances[2];
}

/// Whether the point itself is outside of its neighbours: farther from their mean than they are in
/// RMS.
inline bool IsBeside(const PointSpread& spread)
{
  return spread.Mean.squaredNorm() > spread.Variances.sum();
}
}
