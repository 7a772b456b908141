// SPDX-License-Identifier: BSD-3-Clause
/**
 * Input of KernelWeights and SurfaceSamples: the kernels of a cloud and the settings.
 */
#pragma once

#include "Filters/Common/IdType.h"
#include "Filters/Common/VectorMath.h"

#include <algorithm>
#include <functional>
#include <limits>
#include <vector>

namespace SurfelGeometry
{
struct LocalCloud;
struct NeighborGraph;

/// The kernel of a surfel: K(x) = Peak exp(-|B (x - p)|^2 / 2) in its tangent plane.
struct WeightedKernel
{
  Float3 Normal; // unit
  Float3 B1, B2; // tangential rows of the inverse square root of the covariance, 1 / length
  float Area;    // initial |A|
  float Peak;    // 1 / (2 pi sqrt(det S)), 1 / area
  float Sigma;   // (det S)^(1/4)
  float LargestVariance;
  bool TwoSided;
  bool Usable; // false: no direction, no area or no extent; left out
};

struct WeightSettings
{
  int SamplesPerPoint = 16;
  int NumberOfIterations = 12;
  int NumberOfNeighbors = 20;
  double Support = 4.0;      // kernels end where the exponent |B y|^2 / 2 reaches this
  double SampleRadius = 1.2; // of the disc of samples, in spacings
  double NormalOffset = 2.0; // a kernel covers points up to this many sigma off its plane
  double OtherSheets = 3.0;  // kernels up to this many NormalOffsets off are of other sheets
  double MinimumFactor = 0.25;
  double MaximumFactor = 4.0;
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

/// For several processes that weight one cloud: each has a region and its halo. All do the same
/// number of steps, which the statistics of the whole cloud determine.
struct WeightSharing
{
  std::vector<char> IsOwn; ///< [n] whether a surfel is in this process's region, not in its halo

  /// Collective: sums the moments of all processes. Returns false if a process was stopped.
  std::function<bool(bool running, SumMoments& moments)> Sum;
};

/// Where the kernels come from: threads may ask for some of them several times.
class KernelSource
{
public:
  virtual ~KernelSource() = default;
  virtual WeightedKernel Make(int i) const = 0; // of surfel i of the cloud

  /// Starts loading what Make(i) reads.
  virtual void Prefetch(int i) const = 0;
};

/// Input of the solver for the weights.
struct WeightProblem
{
  const LocalCloud& Cloud;
  const KernelSource& Kernels;
  const WeightSettings& Settings;
  const WeightSharing* Sharing; // null: one process
  NeighborGraph* Graph;         // nearest neighbours, which the solver uses up; null: none known
};
}
