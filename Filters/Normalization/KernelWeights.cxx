// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Normalization/KernelWeights.h"

#include "Filters/Common/ParallelFor.h"
#include "Filters/Neighbors/LocalCloud.h"
#include "Filters/Normalization/SurfaceSamples.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <utility>

namespace SurfelGeometry
{
namespace
{
/// Lower bound of a sum of kernels that is divided by: it bounds one step of the iteration.
constexpr double MinSum = 1e-3;

/// The iteration ends when a step reduces the standard deviation of the sums by less than 2 %: from
/// there on it fits the samples rather than the surface. On a sphere of random points, the
/// deviation at other samples was 0.128 at first, 0.126 after 1 to 4 steps and 0.127 after 12.
constexpr double MaxErrorRatio = 0.98;

/// Unit of the fixed-point numerators: integer sums do not depend on the order.
constexpr double FixedPoint = 1.0 / 4294967296.0;
constexpr double MaxTerm = 65536.0;

/// For each surfel a sum over the samples in fixed point: the same in any order.
class FixedSums
{
public:
  explicit FixedSums(std::size_t count)
    : Sums(new std::atomic<std::int64_t>[count])
    , Count(count)
  {
    this->Clear();
  }

  void Clear()
  {
    ParallelFor(0, static_cast<vtkIdType>(this->Count), [this](vtkIdType i, vtkIdType end) {
      for (; i < end; ++i)
      {
        this->Sums[i].store(0, std::memory_order_relaxed);
      }
    });
  }
  static std::int64_t ToFixed(double term)
  {
    return static_cast<std::int64_t>(std::min(term, MaxTerm) / FixedPoint);
  }
  void Add(std::size_t i, std::int64_t term)
  {
    if (term != 0)
    {
      this->Sums[i].fetch_add(term, std::memory_order_relaxed);
    }
  }
  double Get(std::size_t i) const
  {
    return FixedPoint * static_cast<double>(this->Sums[i].load(std::memory_order_relaxed));
  }

private:
  std::unique_ptr<std::atomic<std::int64_t>[]> Sums;
  std::size_t Count;
};

struct WeightSums
{
  FixedSums Denominators, Numerators;
  std::vector<SumMoments> Statistics; // of each block

  explicit WeightSums(std::size_t count)
    : Denominators(count)
    , Numerators(count)
  {
  }
};

/// A sample and its entries.
struct SamplePlace
{
  const std::uint16_t* Numbers; // in the block's table
  const std::uint16_t* Kernels;
  int Entries, Kind;
  double Area; // world units squared
};

/// Calls visit(place) for the samples of a block.
/// @param areas of the block's own surfels, before they are weighted
template <typename Visit>
void ForSamples(const SampleBlock& block, const float* areas, double share, Visit&& visit)
{
  SamplePlace place{ block.Numbers.data(), block.Kernels.data(), 0, 0, 0.0 };
  const std::uint16_t* sample = block.Samples.data();
  for (std::size_t i = 0; i < block.Owned.size(); ++i)
  {
    place.Area = share * areas[i];
    for (const std::uint16_t* end = sample + block.Owned[i]; sample < end; ++sample)
    {
      place.Entries = SampleBlock::Entries(*sample);
      place.Kind = SampleBlock::Kind(*sample);
      visit(place);
      place.Numbers += place.Entries;
      place.Kernels += place.Entries;
    }
  }
}

/// Sums over the samples of a block, for each surfel of its table.
class BlockTerms
{
public:
  void Begin(std::size_t count) { this->Terms.assign(count, 0); }

  /// @param peaks [count] what a kernel is a number of SampleBlock::Kernels times
  void Add(const SamplePlace& at, double factor, const std::vector<double>& peaks)
  {
    for (int e = 0; e < at.Entries; ++e)
    {
      const std::uint16_t number = at.Numbers[e];
      this->Terms[number] += FixedSums::ToFixed(factor * at.Kernels[e] * peaks[number]);
    }
  }

  void End(const SampleBlock& block, FixedSums& sums) const
  {
    for (std::size_t k = 0; k < this->Terms.size(); ++k)
    {
      sums.Add(static_cast<std::size_t>(block.Id(k)), this->Terms[k]);
    }
  }

private:
  std::vector<std::int64_t> Terms;
};

/// The kernels that a block reads.
struct BlockKernels
{
  std::vector<double>
    Peaks; // scaled, so that a kernel is a number of SampleBlock::Kernels times it
  std::vector<double> Weights; // areas times the peaks

  /// The sum of the kernels at a sample, times their areas.
  double SumAt(const SamplePlace& at) const
  {
    double sum = 0.0;
    for (int e = 0; e < at.Entries; ++e)
    {
      sum += this->Weights[at.Numbers[e]] * at.Kernels[e];
    }
    return sum;
  }

  /// Of stored samples.
  void Load(const SampleBlock& block, const SampledSurface& surface, const RawVector<double>& areas,
    double scale)
  {
    this->Resize(block.TableSize());
    for (std::size_t k = 0; k < this->Peaks.size(); ++k)
    {
      const auto id = static_cast<std::size_t>(block.Id(k));
      this->Peaks[k] = scale * surface.Peaks[id];
      this->Weights[k] = areas[id] * this->Peaks[k];
    }
  }

  /// Of new samples: the areas before they are weighted.
  void Load(const SurfelTable& table, std::size_t count, double scale)
  {
    this->Resize(count);
    for (std::size_t k = 0; k < count; ++k)
    {
      const WeightedKernel& kernel = table[k].Kernel;
      this->Peaks[k] = kernel.Usable ? scale * kernel.Peak : 0.0;
      this->Weights[k] = kernel.Usable ? kernel.Area * this->Peaks[k] : 0.0;
    }
  }

private:
  void Resize(std::size_t count)
  {
    this->Peaks.resize(count);
    this->Weights.resize(count);
  }
};

SumMoments Total(const std::vector<SumMoments>& blocks)
{
  SumMoments all;
  for (const SumMoments& block : blocks)
  {
    all.Add(block);
  }
  return all;
}

SumStatistics Statistics(const SumMoments& all, WeightReport& report)
{
  SumStatistics result;
  if (all.Area > 0.0)
  {
    result.Minimum = all.Minimum;
    result.Maximum = all.Maximum;
    result.Mean = all.First / all.Area;
    const double variance = all.Second / all.Area - result.Mean * result.Mean;
    result.StandardDeviation = std::sqrt(std::max(variance, 0.0));
  }
  report.SampledArea = all.Area;
  report.NumberOfSamples = all.Samples;
  return result;
}

/// What all passes over the samples read.
struct Sampling
{
  const double Share; // area of a sample over that of its surfel
  const double Scale; // of the peaks: kernels have unit mass within the support
  SampledSurface Surface;

  explicit Sampling(const WeightSettings& settings)
    : Share(SampleShare(settings))
    , Scale(1.0 / (KernelPeak * (1.0 - std::exp(-settings.Support))))
  {
  }

  const float* AreasOf(const SampleBlock& block) const
  {
    return this->Surface.Areas.data() + block.First;
  }

  /// Calls visit(b, block, kernels) for the stored blocks, in parallel.
  template <typename Visit>
  void ForBlocks(const RawVector<double>& areas, Visit&& visit) const
  {
    const auto count = static_cast<vtkIdType>(this->Surface.Blocks.size());
    ParallelFor(0, count, 1, [&](vtkIdType b, vtkIdType last) {
      BlockKernels kernels;
      for (; b < last; ++b)
      {
        const SampleBlock& block = this->Surface.Blocks[b];
        kernels.Load(block, this->Surface, areas, this->Scale);
        visit(b, block, kernels);
      }
    });
  }
};

/// Adds w_j K_ji d_j / s_j to sum i for the samples j of a block, with d_j = 1 on the surface and 0
/// beyond its border.
void AddNumerators(const Sampling& samples, const SampleBlock& block, const BlockKernels& kernels,
  FixedSums& sums, SumMoments& statistics)
{
  BlockTerms terms;
  terms.Begin(block.TableSize());
  ForSamples(block, samples.AreasOf(block), samples.Share, [&](const SamplePlace& at) {
    if (at.Kind != 0)
    {
      const double sum = kernels.SumAt(at);
      if (at.Kind == CountedSample)
      {
        statistics.Add(at.Area, sum);
      }
      terms.Add(at, at.Area / std::max(sum, MinSum), kernels.Peaks);
    }
  });
  terms.End(block, sums);
}

/// Adds to both sums at once: w_j K_ji to the denominators, and the numerators as above.
void AddToBoth(const Sampling& samples, const SampleBlock& block, const BlockKernels& kernels,
  WeightSums& sums, SumMoments& statistics)
{
  BlockTerms denominators, numerators;
  denominators.Begin(block.TableSize());
  numerators.Begin(block.TableSize());
  ForSamples(block, samples.AreasOf(block), samples.Share, [&](const SamplePlace& at) {
    const double sum = kernels.SumAt(at);
    if (at.Kind == CountedSample)
    {
      statistics.Add(at.Area, sum);
    }
    denominators.Add(at, at.Area, kernels.Peaks);
    if (at.Kind != 0)
    {
      numerators.Add(at, at.Area / std::max(sum, MinSum), kernels.Peaks);
    }
  });
  denominators.End(block, sums.Denominators);
  numerators.End(block, sums.Numerators);
}

/// @param statistics of the sums with these areas, for each block
void SumNumerators(const Sampling& samples, const RawVector<double>& areas, FixedSums& sums,
  std::vector<SumMoments>& statistics)
{
  sums.Clear();
  statistics.assign(samples.Surface.Blocks.size(), SumMoments());
  samples.ForBlocks(areas, [&](vtkIdType b, const SampleBlock& block, const BlockKernels& kernels) {
    AddNumerators(samples, block, kernels, sums, statistics[b]);
  });
}

SumMoments Measure(const Sampling& samples, const RawVector<double>& areas)
{
  std::vector<SumMoments> statistics(samples.Surface.Blocks.size());
  samples.ForBlocks(areas, [&](vtkIdType b, const SampleBlock& block, const BlockKernels& kernels) {
    ForSamples(block, samples.AreasOf(block), samples.Share, [&](const SamplePlace& at) {
      if (at.Kind == CountedSample)
      {
        statistics[b].Add(at.Area, kernels.SumAt(at));
      }
    });
  });
  return Total(statistics);
}

struct StepInput
{
  const WeightSettings& Settings;
  const RawVector<float>& InitialAreas;
  const FixedSums &Denominators, &Numerators;
};

void Step(const StepInput& input, RawVector<double>& areas)
{
  ParallelFor(0, static_cast<vtkIdType>(areas.size()), [&](vtkIdType begin, vtkIdType end) {
    for (vtkIdType i = begin; i < end; ++i)
    {
      const double denominator = input.Denominators.Get(i);
      if (denominator > 0.0)
      {
        const double start = input.InitialAreas[i];
        areas[i] = std::clamp(areas[i] * input.Numerators.Get(i) / denominator,
          input.Settings.MinimumFactor * start, input.Settings.MaximumFactor * start);
      }
    }
  });
}
}

WeightedKernel MakeWeightedKernel(const double areaVector[3], const double covariance[6])
{
  WeightedKernel kernel{};
  const Vector3 area{ areaVector[0], areaVector[1], areaVector[2] };
  const Vector3 normal = Normalized(area, { 0.0, 0.0, 1.0 });
  kernel.Area = static_cast<float>(Norm(area));
  kernel.Normal = normal;
  Vector3 u, v;
  TangentFrame(normal, u, v);
  const double* s = covariance;
  const auto apply = [s](const Vector3& a) {
    return Vector3{ s[0] * a[0] + s[3] * a[1] + s[5] * a[2],
      s[3] * a[0] + s[1] * a[1] + s[4] * a[2], s[5] * a[0] + s[4] * a[1] + s[2] * a[2] };
  };
  const double uu = Dot(u, apply(u));
  const double uv = Dot(u, apply(v));
  const double vv = Dot(v, apply(v));
  const double determinant = uu * vv - uv * uv;
  kernel.Usable = kernel.Area > 0.0 && uu > 0.0 && determinant > 0.0 &&
    std::isfinite(kernel.Area) && std::isfinite(determinant);
  if (kernel.Usable)
  {
    // y' S^-1 y = x^2 / uu + (y - x uv / uu)^2 uu / det: Cholesky's factors of the inverse.
    kernel.B1 = (1.0 / std::sqrt(uu)) * u;
    kernel.B2 = std::sqrt(uu / determinant) * (v - (uv / uu) * u);
    kernel.Peak = static_cast<float>(1.0 / (2.0 * Pi * std::sqrt(determinant)));
    kernel.Sigma = static_cast<float>(std::sqrt(std::sqrt(determinant)));
    kernel.LargestVariance =
      static_cast<float>(0.5 * (uu + vv) + std::sqrt(0.25 * (uu - vv) * (uu - vv) + uv * uv));
    // Kernels are floats: peaks, 1 / area, end at 3e38.
    kernel.Usable = std::isfinite(kernel.Peak) && kernel.Sigma > 0.0f;
  }
  return kernel;
}

namespace
{
/// Samples the surface and makes the first pass over the samples while they are in the caches.
/// Returns false if stopped.
bool MakeSamplesAndSums(
  const WeightProblem& problem, const StageProgress& progress, Sampling& samples, WeightSums& sums)
{
  BeginSamples(problem, samples.Surface);
  sums.Statistics.resize(samples.Surface.Blocks.size());
  const auto addUp = [&](std::size_t b, const SampleBlock& block, const SurfelTable& table) {
    BlockKernels kernels;
    kernels.Load(table, block.TableSize(), samples.Scale);
    AddToBoth(samples, block, kernels, sums, sums.Statistics[b]);
  };
  return MakeSamples(problem, progress, addUp, samples.Surface);
}

/// From this step on, most iterations end before they need their numerators.
constexpr int OftenLast = 2;

/// The statistics of the sums with the areas so far. The numerators of the first step were made
/// with the samples.
SumMoments BeginStep(
  int step, const Sampling& samples, const RawVector<double>& areas, WeightSums& sums)
{
  if (step >= OftenLast)
  {
    return Measure(samples, areas);
  }
  if (step > 0)
  {
    SumNumerators(samples, areas, sums.Numerators, sums.Statistics);
  }
  return Total(sums.Statistics);
}

void EndStep(const WeightSettings& settings, int step, const Sampling& samples, WeightSums& sums,
  RawVector<double>& areas)
{
  if (step >= OftenLast)
  {
    SumNumerators(samples, areas, sums.Numerators, sums.Statistics);
  }
  Step({ settings, samples.Surface.Areas, sums.Denominators, sums.Numerators }, areas);
}

void Assign(const RawVector<float>& values, RawVector<double>& to)
{
  to.resize(values.size());
  ParallelFor(0, static_cast<vtkIdType>(to.size()), [&](vtkIdType begin, vtkIdType end) {
    std::copy(values.data() + begin, values.data() + end, to.data() + begin);
  });
}
}

bool SolveWeights(const WeightProblem& problem, const StageProgress& progress,
  RawVector<double>& areas, WeightReport& report)
{
  const WeightSharing* sharing = problem.Sharing;
  const int iterations = problem.Settings.NumberOfIterations;
  const auto share = [sharing](bool running, SumMoments& moments) {
    return sharing ? sharing->Sum(running, moments) : running;
  };
  Sampling samples(problem.Settings);
  WeightSums sums(static_cast<std::size_t>(problem.Cloud.Size()));
  bool running = MakeSamplesAndSums(problem, progress.Part(0.0, 0.5), samples, sums);
  SumMoments moments;
  if (!share(running, moments))
  {
    return false;
  }
  Assign(samples.Surface.Areas, areas);
  // One or two points have no samples: no place is known to be on a surface.
  double last = std::numeric_limits<double>::infinity();
  bool isMeasured = false; // of the final areas
  for (int step = 0; step < iterations; ++step)
  {
    moments = BeginStep(step, samples, areas, sums);
    if (!share(running, moments))
    {
      return false;
    }
    const SumStatistics now = Statistics(moments, report);
    report.Before = step == 0 ? now : report.Before;
    isMeasured = now.StandardDeviation > MaxErrorRatio * last || report.NumberOfSamples == 0;
    if (isMeasured)
    {
      report.After = now;
      break;
    }
    last = now.StandardDeviation;
    EndStep(problem.Settings, step, samples, sums, areas);
    running = progress.Step(0.5 + 0.5 * (step + 1) / iterations);
    if (!running && !sharing)
    {
      return false;
    }
  }
  if (!isMeasured)
  {
    moments = Measure(samples, areas);
    if (!share(running, moments))
    {
      return false;
    }
    report.After = Statistics(moments, report);
    report.Before = iterations == 0 ? report.After : report.Before;
  }
  report.Overlaps = std::move(samples.Surface.Overlaps);
  report.InitialAreas = std::move(samples.Surface.Areas);
  return progress.Step(1.0);
}
}
