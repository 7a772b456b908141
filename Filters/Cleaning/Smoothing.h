// SPDX-License-Identifier: BSD-3-Clause
/**
 * Noisy surfaces are smoothed by PCL's moving least squares (pcl::MLSResult; Alexa et al. 2003,
 * "Computing and rendering point set surfaces"), whose code is in PCL's headers: no library of PCL
 * with another VTK comes along.
 *
 * Smoothing rounds edges and moves points of thin things, so it must not touch surfaces without
 * noise. On these a quadric through the nearest points fits exactly, except at edges, where things
 * are thin, and where they cross. In noise it fits nowhere. So a part of the cloud is noisy if the
 * fit is bad at nearly all of its points. Two sheets near each other, whose residuals have two
 * values, may be a leaf or two scans of one surface. They become one sheet only if they have the
 * same colours.
 */
#pragma once

#include "Filters/Common/StageProgress.h"
#include "Filters/Common/VectorMath.h"

#include <vector>

class vtkDataArray;

namespace SurfelGeometry
{
struct CleaningProblem;
struct LocalCloud;

/// The colours of a cloud's points, in an array in the order of the input. Few points are asked
/// for.
struct PointColors
{
  vtkDataArray* Array; // of three components at least; null: unknown
  const LocalCloud& Cloud;

  Vector3 Get(int i) const;
};

/// Collective, if several processes clean the cloud.
/// @param shifts [n] to the smooth surface, world units; exactly 0 where there is no noise; empty
/// if there is none at all. Returns false if stopped.
bool SmoothNoise(const CleaningProblem& problem, const PointColors& colors,
  const StageProgress& progress, std::vector<Float3>& shifts);
}
