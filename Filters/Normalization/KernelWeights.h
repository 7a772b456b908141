// SPDX-License-Identifier: BSD-3-Clause
/**
 * Weights that make the kernels of a surfel cloud sum to one over the surface.
 *
 * Zwicker et al. 2001 ("Surface splatting", sec. 5) and Ren et al. 2002 ("Object space EWA
 * surface splatting") normalize each surfel by the sum at its point. A point sits on the peak of
 * its own kernel, so here the sum is taken over the surface. The equation sum_i a_i K_i(x) = 1 for
 * x on the surface, a_i >= 0, is solved by Richardson-Lucy steps
 *
 *   a_i <- a_i [sum_j w_j K_ji d_j / s_j] / [sum_j w_j K_ji],   s_j = sum_i a_i K_ji,
 *
 * over samples x_j, each with the area w_j. The wanted sum d_j is 1 on the surface and 0 just
 * beyond its borders; this keeps the total area.
 */
#pragma once

#include "Filters/Common/RawVector.h"
#include "Filters/Common/StageProgress.h"
#include "Filters/Normalization/WeightProblem.h"

#include <vector>

namespace SurfelGeometry
{
/// Sum of the kernels over the samples, weighted by their areas.
struct SumStatistics
{
  double Mean = 0.0, StandardDeviation = 0.0, Minimum = 0.0, Maximum = 0.0;
};

struct WeightReport
{
  SumStatistics Before, After;
  double SampledArea = 0.0; // world units squared
  vtkIdType NumberOfSamples = 0;
  RawVector<float> InitialAreas; // [n] world units squared; 0: the surfel has no usable kernel
  RawVector<float> Overlaps;     // [n] SurfelCloud::OverlapOf, [0, 1]
};

/// The kernel of a surfel from its arrays (Documentation/DataContract.md), all but TwoSided.
WeightedKernel MakeWeightedKernel(const double areaVector[3], const double covariance[6]);

/// areas: [n] the weighted area, 0 without a usable kernel. Returns false if stopped.
bool SolveWeights(const WeightProblem& problem, const StageProgress& progress,
  RawVector<double>& areas, WeightReport& report);
}
