// SPDX-License-Identifier: BSD-3-Clause
/**
 * Weights that make the kernels of a surfel cloud sum to one over the surface.
 *
 * Zwicker et al. 2001 ("Surface splatting", sec. 5) and Ren et al. 2002 ("Object space EWA
 * surface splatting") normalize each surfel; here the sum is taken over the surface rather than
 * at the points, since a point sits on its own kernel's peak. The equation
 * sum_i a_i K_i(x) = 1 for x on the surface, a_i >= 0, is solved by Richardson-Lucy steps
 *
 *   a_i <- a_i [sum_j w_j K_ji d_j / s_j] / [sum_j w_j K_ji],   s_j = sum_i a_i K_ji,
 *
 * over samples x_j that stand for the area w_j each; d_j, the sum that is wanted, is 1 on the
 * surface and 0 just beyond its borders, so that the total area is kept.
 */
#pragma once

#include "Filters/Common/StageProgress.h"
#include "Filters/Common/VectorMath.h"

#include <algorithm>
#include <functional>
#include <limits>
#include <vector>

namespace SurfelGeometry
{
struct LocalCloud;

/// A surfel as the normalization sees it: K(x) = Peak exp(-|B (x - p)|^2 / 2) in its tangent plane.
struct WeightSurfel
{
  Float3 Normal; // unit
  Float3 B1, B2; // tangential rows of the inverse square root of the covariance, 1 / length
  float Area;    // initial |A|
  float Peak;    // 1 / (2 pi sqrt(det S)), 1 / area
  float Sigma;   // (det S)^(1/4)
  bool TwoSided;
  bool Usable; // false: no direction, no area or no extent; takes no part
};

struct WeightSettings
{
  int SamplesPerPoint = 16;
  int NumberOfIterations = 12;
  int NumberOfNeighbors = 24;
  double Support = 4.0;      // kernels end where the exponent |B y|^2 / 2 reaches this
  double SampleRadius = 1.2; // of the disc of samples, in spacings
  double NormalOffset = 2.0; // a kernel covers points up to this many sigma off its plane
  double MinimumFactor = 0.25;
  double MaximumFactor = 4.0;
};

/// Sum of the kernels over the samples, weighted by their areas.
struct SumStatistics
{
  double Mean = 0.0, StandardDeviation = 0.0, Minimum = 0.0, Maximum = 0.0;
};

/// Moments of the sums over samples.
struct SumMoments
{
  double Area = 0.0, First = 0.0, Second = 0.0; // world units squared
  double Minimum = std::numeric_limits<double>::infinity();
  double Maximum = -std::numeric_limits<double>::infinity();
  vtkIdType Samples = 0;

  void Add(double weight, double sum)
  {
    this->Area += weight;
    this->First += weight * sum;
    this->Second += weight * sum * sum;
    this->Minimum = std::min(this->Minimum, sum);
    this->Maximum = std::max(this->Maximum, sum);
    ++this->Samples;
  }

  void Add(const SumMoments& other)
  {
    this->Area += other.Area;
    this->First += other.First;
    this->Second += other.Second;
    this->Minimum = std::min(this->Minimum, other.Minimum);
    this->Maximum = std::max(this->Maximum, other.Maximum);
    this->Samples += other.Samples;
  }
};

/// One cloud that several processes weight parts of, with the surfels about each: all take as many
/// steps, by the statistics of the whole.
struct WeightSharing
{
  std::vector<char> Mine; ///< [n] whether a surfel is of this process's part

  /// Collective: moments of all processes together; whether all are good, and none is stopped.
  std::function<bool(bool good, SumMoments& moments)> Sum;
};

struct WeightReport
{
  SumStatistics Before, After;
  double SampledArea = 0.0; // world units squared
  vtkIdType NumberOfSamples = 0;
};

/// Fills all of a WeightSurfel but TwoSided from the contract's arrays.
WeightSurfel MakeWeightSurfel(const double areaVector[3], const double covariance[6]);

/// areas: [n] in: |A|, out: the weighted area. Returns false if stopped. @param sharing or null
bool SolveWeights(const LocalCloud& cloud, const std::vector<WeightSurfel>& surfels,
  const WeightSettings& settings, const WeightSharing* sharing, const StageProgress& monitor,
  std::vector<double>& areas, WeightReport& report);
}
