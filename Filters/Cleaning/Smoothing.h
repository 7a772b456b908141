// SPDX-License-Identifier: BSD-3-Clause
/**
 * Noisy surfaces are smoothed by PCL's moving least squares (LocalQuadric.h).
 *
 * Smoothing rounds edges and moves points of thin things, so it must not touch surfaces without
 * noise. On these a quadric through the nearest points fits exactly, except at edges, where things
 * are thin, and where they cross. In noise it fits nowhere. So a part of the cloud is noisy if the
 * fit is bad at nearly all of its points. Two sheets near each other, whose residuals have two
 * values, may be a leaf or two scans of one surface. They become one sheet only if they have the
 * same colours. Folds between planes stay sharp (FoldFit.h). Colours of noisy points get into their
 * places by a vote (ColorVote.h).
 *
 * Foliage is as rough as noise, but on every scale: the more neighbours, the larger the residuals.
 * Points where they grow stay in their places, as soon as many of a part do.
 */
#pragma once

#include "Filters/Arrays/PointColors.h"
#include "Filters/Common/StageProgress.h"
#include "Filters/Common/VectorMath.h"

#include <vector>

class vtkPointSet;

namespace SurfelGeometry
{
struct CleaningProblem;

/// What is known of the points without noise; empty if there is no noise at all.
struct SmoothPoints
{
  std::vector<Float3> Shifts; // [n] to the smooth surface, world units; exactly 0 without noise
  CloudColors Colors;         // empty also if the points have none
  vtkIdType Thick = 0; // own points of parts that are no surface: they fill space, and are left
};

/// Collective, if several processes clean the cloud.
/// @param input has the colours of the cloud's points
/// Returns false if stopped.
bool SmoothNoise(const CleaningProblem& problem, vtkPointSet* input, const StageProgress& progress,
  SmoothPoints& smooth);
}
