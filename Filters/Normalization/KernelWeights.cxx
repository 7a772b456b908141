// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Normalization/KernelWeights.h"

#include "Filters/Common/LocalCloud.h"
#include "Filters/Common/NeighborGraph.h"
#include "Filters/Normalization/SurfaceSamples.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>

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

using Blocks = std::vector<SampleBlock>;

/// For each surfel a sum over the samples in fixed point: the same in any order.
class FixedSums
{
public:
  explicit FixedSums(size_t count)
    : Sums(new std::atomic<std::int64_t>[count])
    , Count(count)
  {
  }

  void Clear()
  {
    for (size_t i = 0; i < this->Count; ++i)
    {
      this->Sums[i].store(0, std::memory_order_relaxed);
    }
  }
  static std::int64_t ToFixed(double term)
  {
    return static_cast<std::int64_t>(std::min(term, MaxTerm) / FixedPoint);
  }
  void Add(size_t i, std::int64_t term)
  {
    if (term != 0)
    {
      this->Sums[i].fetch_add(term, std::memory_order_relaxed);
    }
  }
  double Get(size_t i) const
  {
    return FixedPoint * static_cast<double>(this->Sums[i].load(std::memory_order_relaxed));
  }

private:
  std::unique_ptr<std::atomic<std::int64_t>[]> Sums;
  size_t Count;
};

/// The areas of one surfel and its neighbours, and what its samples add to their sums.
class SheetSums
{
public:
  /// @param peaks of the surfels' kernels, 1 / area, over SampleBlock::Peak
  SheetSums(const NeighborRows& rows, const std::vector<float>& peaks)
    : Rows(rows)
    , AllPeaks(peaks)
    , Ids(static_cast<std::size_t>(rows.Used) + 1)
    , Areas(this->Ids.size())
    , Peaks(this->Ids.size())
    , Terms(this->Ids.size())
    , Own(SampleBlockSize)
  {
  }

  /// @param reached number of ranks that the samples reach
  /// @param areas null: not needed
  void Begin(int owner, int reached, const std::vector<double>* areas)
  {
    const int* row = this->Rows.Row(owner);
    this->Count = reached;
    this->Ids[0] = owner;
    std::copy_n(row, this->Count - 1, this->Ids.begin() + 1);
    for (int k = 0; k < this->Count; ++k)
    {
      this->Peaks[k] = this->AllPeaks[this->Ids[k]];
      this->Areas[k] = areas ? (*areas)[this->Ids[k]] * this->Peaks[k] : 0.0;
      this->Terms[k] = 0;
    }
  }

  double SumAt(const SampleBlock& block, int sample) const
  {
    double sum = 0.0;
    for (int e = block.Ends[sample]; e < block.Ends[sample + 1]; ++e)
    {
      sum += this->Areas[block.Ranks[e]] * block.Kernels[e];
    }
    return sum;
  }

  void Add(const SampleBlock& block, int sample, double factor)
  {
    for (int e = block.Ends[sample]; e < block.Ends[sample + 1]; ++e)
    {
      const unsigned char rank = block.Ranks[e];
      this->Terms[rank] += FixedSums::ToFixed(factor * this->Peaks[rank] * block.Kernels[e]);
    }
  }

  /// Adds the terms of the sheet. Most are of surfels in the block, whose first one is `first`:
  /// these need no atomic addition.
  void End(int first, FixedSums& sums)
  {
    for (int k = 0; k < this->Count; ++k)
    {
      const int local = this->Ids[k] - first;
      if (local >= 0 && local < SampleBlockSize)
      {
        this->Own[local] += this->Terms[k];
      }
      else
      {
        sums.Add(static_cast<std::size_t>(this->Ids[k]), this->Terms[k]);
      }
    }
  }

  void EndBlock(int first, FixedSums& sums)
  {
    for (int i = 0; i < SampleBlockSize; ++i) // zeros beyond the last surfel are not added
    {
      sums.Add(static_cast<std::size_t>(first) + i, this->Own[i]);
    }
    std::fill(this->Own.begin(), this->Own.end(), 0);
  }

private:
  const NeighborRows& Rows;
  const std::vector<float>& AllPeaks;
  std::vector<int> Ids;
  std::vector<double> Areas; // times the peaks
  std::vector<double> Peaks;
  std::vector<std::int64_t> Terms;
  std::vector<std::int64_t> Own; // [SampleBlockSize]
  int Count = 0;
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

/// The samples of all surfels, and what is left of the kernels.
struct Sampling
{
  NeighborRows Rows;
  Blocks All;
  std::vector<float> Areas; // [n] initial ones, world units squared
  std::vector<float> Peaks; // [n] of kernels with unit mass within the support, as SheetSums wants

  /// Frees the kernels.
  void Take(double support, std::vector<WeightedKernel>& kernels)
  {
    const double scale = 1.0 / (SampleBlock::Peak * (1.0 - std::exp(-support)));
    this->Areas.reserve(kernels.size());
    this->Peaks.reserve(kernels.size());
    for (const WeightedKernel& kernel : kernels)
    {
      this->Areas.push_back(kernel.Area);
      this->Peaks.push_back(static_cast<float>(scale * kernel.Peak));
    }
    kernels = std::vector<WeightedKernel>();
  }

  /// Calls visit(sheet, b, begin, end) for each surfel with samples, in parallel over the blocks,
  /// whose index is b. The surfel has the samples from `begin` to `end`.
  /// @param sums get what the sheets' terms add up to; null: nothing was added
  template <typename Visit>
  void ForSheets(const std::vector<double>* areas, FixedSums* sums, Visit&& visit) const
  {
    const auto count = static_cast<vtkIdType>(this->All.size());
    vtkSMPTools::For(0, count, 1, [&](vtkIdType b, vtkIdType last) {
      SheetSums sheet(this->Rows, this->Peaks);
      for (; b < last; ++b)
      {
        const SampleBlock& block = this->All[b];
        const auto first = static_cast<int>(b * SampleBlockSize);
        for (int i = 0; i < block.Surfels(); ++i)
        {
          if (block.Owned[i] < block.Owned[i + 1])
          {
            sheet.Begin(first + i, block.Reached[i], areas);
            visit(sheet, b, block.Owned[i], block.Owned[i + 1]);
            if (sums)
            {
              sheet.End(first, *sums);
            }
          }
        }
        if (sums)
        {
          sheet.EndBlock(first, *sums);
        }
      }
    });
  }
};

/// Adds up sums_i += w_j K_ji d_j / s_j with d_j = 1 on the surface and 0 beyond its border; or
/// w_j K_ji if `areas` is null.
/// @param statistics of the sums with the given areas, for each block
void Accumulate(const Sampling& samples, const std::vector<double>* areas, FixedSums& sums,
  std::vector<SumMoments>& statistics)
{
  sums.Clear();
  statistics.assign(samples.All.size(), SumMoments());
  samples.ForSheets(areas, &sums, [&](SheetSums& sheet, vtkIdType b, int begin, int end) {
    const SampleBlock& block = samples.All[b];
    for (int s = begin; s < end; ++s)
    {
      if (areas && !block.Inside[s])
      {
        continue;
      }
      const double sum = areas ? sheet.SumAt(block, s) : 1.0;
      if (areas && block.Inside[s] == CountedSample)
      {
        statistics[b].Add(block.Weights[s], sum);
      }
      sheet.Add(block, s, block.Weights[s] / std::max(sum, MinSum));
    }
  });
}

SumMoments Measure(const Sampling& samples, const std::vector<double>& areas)
{
  std::vector<SumMoments> statistics(samples.All.size());
  samples.ForSheets(&areas, nullptr, [&](SheetSums& sheet, vtkIdType b, int begin, int end) {
    const SampleBlock& block = samples.All[b];
    for (int s = begin; s < end; ++s)
    {
      if (block.Inside[s] == CountedSample)
      {
        statistics[b].Add(block.Weights[s], sheet.SumAt(block, s));
      }
    }
  });
  return Total(statistics);
}

/// Samples the surface. Returns false if stopped.
/// @param found neighbours, if they were not known
bool FindSamples(const WeightProblem& problem, const StageProgress& progress,
  std::vector<int>& found, Sampling& samples)
{
  const int used = problem.Settings.NumberOfNeighbors;
  if (problem.Graph)
  {
    samples.Rows = { problem.Graph->Ids.data(), KeptNeighbors, used };
    return MakeSamples(problem, samples.Rows, progress, samples.All);
  }
  if (!FindRows(problem, progress.Part(0.0, 0.6), found))
  {
    return false;
  }
  samples.Rows = { found.data(), used, used };
  return MakeSamples(problem, samples.Rows, progress.Part(0.6, 1.0), samples.All);
}

struct StepInput
{
  const WeightSettings& Settings;
  const std::vector<float>& InitialAreas;
  const FixedSums &Denominators, &Numerators;
};

void Step(const StepInput& input, std::vector<double>& areas)
{
  vtkSMPTools::For(0, static_cast<vtkIdType>(areas.size()), [&](vtkIdType begin, vtkIdType end) {
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
    // Kernels are floats: peaks, 1 / area, end at 3e38.
    kernel.Usable = std::isfinite(kernel.Peak) && kernel.Sigma > 0.0f;
  }
  return kernel;
}

bool SolveWeights(const WeightProblem& problem, const StageProgress& progress,
  std::vector<double>& areas, WeightReport& report)
{
  const WeightSharing* sharing = problem.Sharing;
  const int iterations = problem.Settings.NumberOfIterations;
  const auto share = [sharing](bool running, SumMoments& moments) {
    return sharing ? sharing->Sum(running, moments) : running;
  };
  std::vector<int> found;
  Sampling samples{};
  bool running = FindSamples(problem, progress.Part(0.0, 0.5), found, samples);
  SumMoments moments;
  if (!share(running, moments))
  {
    return false;
  }
  samples.Take(problem.Settings.Support, problem.Kernels);
  // One or two points have no samples: no place is known to be on a surface.
  std::vector<SumMoments> statistics;
  FixedSums denominators(areas.size());
  Accumulate(samples, nullptr, denominators, statistics);
  FixedSums numerators(areas.size());
  double last = std::numeric_limits<double>::infinity();
  bool isMeasured = false; // of the final areas
  for (int step = 0; step < iterations; ++step)
  {
    Accumulate(samples, &areas, numerators, statistics);
    moments = Total(statistics);
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
    Step({ problem.Settings, samples.Areas, denominators, numerators }, areas);
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
  return progress.Step(1.0);
}
}
