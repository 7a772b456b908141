// SPDX-License-Identifier: BSD-3-Clause
#include "SurfelWeights.h"

#include "LocalCloud.h"
#include "SurfelFit.h"
#include "SurfelNeighborhood.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <memory>

namespace SurfelGeometry
{
namespace
{
constexpr double Pi = 3.14159265358979323846;

/// A point whose neighbours leave an angle of this much free may lie on a border: of 24 random
/// neighbours inside a surface, one point in 2000 has such a gap.
constexpr double BorderGap = 0.75 * Pi;

/// Near a border, the surface ends where the areas about, smoothed by a Gaussian of this many
/// spacings, cover half of the plane: at the edge of the outermost cells.
constexpr double BorderSmoothing = 1.0;
constexpr double BorderCoverage = 0.5;

/// Sums of weights below this are treated as this: it bounds one step of the iteration.
constexpr double SmallestSum = 1e-3;

/// Owners (surfels and their samples) per block: the unit of the parallel loops.
constexpr vtkIdType BlockSize = 4096;

/// Numerators are summed as integers of this unit: the order of the sum does not matter then.
constexpr double FixedPoint = 1.0 / 4294967296.0;
constexpr double LargestTerm = 65536.0;

/// Samples of the surfels of one block and the kernels that reach them.
struct SampleBlock
{
  std::vector<int> Ids;       // [entries] surfel
  std::vector<float> Kernels; // [entries] K at the sample, 1 / area
  std::vector<int> Ends{ 0 }; // [samples + 1]
  std::vector<float> Weights; // [samples] area
  std::vector<char> Inside;   // [samples] whether it is on the surface, or beyond its border

  size_t Count() const { return this->Weights.size(); }
};

/// Fractional part in [0, 1) of a hash of an id (Steele et al. 2014, splitmix64's finisher).
double Hash(std::uint64_t x)
{
  x += 0x9e3779b97f4a7c15ull;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return static_cast<double>((x ^ (x >> 31)) >> 11) * 0x1.0p-53;
}

/// Whether two surfels can be of one sheet.
bool AreCompatible(const WeightSurfel& a, const WeightSurfel& b)
{
  return (a.TwoSided == b.TwoSided) && (a.TwoSided || Dot(a.Normal, b.Normal) > 0.0);
}

/// Makes the samples of one surfel after the other.
class Sampler
{
public:
  Sampler(const LocalCloud& cloud, const std::vector<WeightSurfel>& surfels,
    const WeightSettings& settings, const SurfelNeighborhood& tree)
    : Cloud(cloud)
    , Surfels(surfels)
    , Settings(settings)
    , Tree(tree)
    , KernelScale(1.0 / (1.0 - std::exp(-settings.Support))) // unit mass within the support
  {
  }

  void Sample(int owner, SampleBlock& block)
  {
    const WeightSurfel& surfel = this->Surfels[owner];
    if (!surfel.Usable)
    {
      return;
    }
    Vector3 u, v;
    TangentFrame(surfel.Normal, u, v);
    const bool border = this->Gather(owner, u, v) > BorderGap;
    const double spacing = std::sqrt(surfel.Area);
    const double radius = this->Settings.SampleRadius * spacing;
    const int count = this->Settings.SamplesPerPoint;
    const float weight = static_cast<float>(Pi * radius * radius / count);
    // By the input's id, so that the samples do not depend on where the cloud lies.
    const auto seed = static_cast<std::uint64_t>(this->Cloud.InputIds[owner]);
    const double turn = 2.0 * Pi * Hash(2 * seed);
    const double shift = Hash(2 * seed + 1);
    for (int s = 0; s < count; ++s)
    {
      // Vogel's disc: equal areas, golden angle.
      const double r = radius * std::sqrt((s + shift) / count);
      const double angle = turn + 2.39996322972865332 * s;
      const Vector3 offset = (r * std::cos(angle)) * u + (r * std::sin(angle)) * v;
      if (!this->IsInCell(r * r, offset))
      {
        continue;
      }
      // Beyond the border the sum should be 0. Without samples there, it would be 1 up to the
      // very edge, at the price of a rim of surfels that are too heavy.
      block.Inside.push_back(
        !border || this->Coverage(offset, BorderSmoothing * spacing) >= BorderCoverage);
      this->AddEntries(offset, block);
      block.Weights.push_back(weight);
      block.Ends.push_back(static_cast<int>(block.Ids.size()));
    }
  }

private:
  struct Near
  {
    int Id;
    Vector3 Offset; // from the owner
  };

  /// Finds the owner's sheet around it, itself first; returns the largest angle without one.
  double Gather(int owner, const Vector3& u, const Vector3& v)
  {
    const WeightSurfel& surfel = this->Surfels[owner];
    const Vector3 p = Load(this->Cloud.Position(owner));
    this->Tree.FindNearest(owner, this->Settings.NumberOfNeighbors, this->Found);
    this->Sheet.clear();
    this->Angles.clear();
    this->Sheet.push_back({ owner, Vector3() });
    for (const int j : this->Found.Ids)
    {
      if (!this->Surfels[j].Usable || !AreCompatible(surfel, this->Surfels[j]))
      {
        continue;
      }
      const Vector3 offset = Load(this->Cloud.Position(j)) - p;
      this->Sheet.push_back({ j, offset });
      const double x = Dot(offset, u);
      const double y = Dot(offset, v);
      const double climb = Dot(offset, surfel.Normal);
      if (x * x + y * y > climb * climb)
      {
        this->Angles.push_back(std::atan2(y, x));
      }
    }
    return LargestGap(this->Angles);
  }

  /// Whether the sample is nearer to its owner than to any other surfel of the sheet.
  bool IsInCell(double squared, const Vector3& offset) const
  {
    for (size_t k = 1; k < this->Sheet.size(); ++k)
    {
      const Vector3 d = offset - this->Sheet[k].Offset;
      if (Dot(d, d) < squared)
      {
        return false;
      }
    }
    return true;
  }

  /// Share of the plane that the areas of the sheet cover about a place.
  double Coverage(const Vector3& offset, double sigma) const
  {
    double sum = 0.0;
    for (const Near& near : this->Sheet)
    {
      const Vector3 d = offset - near.Offset;
      sum += this->Surfels[near.Id].Area * std::exp(-0.5 * Dot(d, d) / (sigma * sigma));
    }
    return sum / (2.0 * Pi * sigma * sigma);
  }

  void AddEntries(const Vector3& offset, SampleBlock& block) const
  {
    const double largest = 2.0 * this->Settings.Support;
    for (const Near& near : this->Sheet)
    {
      const WeightSurfel& surfel = this->Surfels[near.Id];
      const Vector3 d = offset - near.Offset;
      const double b1 = Dot(surfel.B1, d);
      const double b2 = Dot(surfel.B2, d);
      const double q = b1 * b1 + b2 * b2;
      if (q < largest &&
        std::abs(Dot(surfel.Normal, d)) < this->Settings.NormalOffset * surfel.Sigma)
      {
        block.Ids.push_back(near.Id);
        block.Kernels.push_back(
          static_cast<float>(this->KernelScale * surfel.Peak * std::exp(-0.5 * q)));
      }
    }
  }

  const LocalCloud& Cloud;
  const std::vector<WeightSurfel>& Surfels;
  const WeightSettings& Settings;
  const SurfelNeighborhood& Tree;
  double KernelScale;
  Neighbors Found;
  std::vector<Near> Sheet;
  std::vector<double> Angles;
};

using Blocks = std::vector<SampleBlock>;

bool MakeBlocks(const LocalCloud& cloud, const std::vector<WeightSurfel>& surfels,
  const WeightSettings& settings, const SurfelMonitor& monitor, Blocks& blocks)
{
  const SurfelNeighborhood tree(cloud.Positions.data(), cloud.Size());
  const vtkIdType count = cloud.Size();
  blocks.resize((count + BlockSize - 1) / BlockSize);
  const vtkIdType blockCount = static_cast<vtkIdType>(blocks.size());
  constexpr vtkIdType stride = 32; // blocks between two looks at abort
  for (vtkIdType first = 0; first < blockCount; first += stride)
  {
    const vtkIdType last = std::min(first + stride, blockCount);
    vtkSMPTools::For(first, last, 1, [&](vtkIdType begin, vtkIdType end) {
      Sampler sampler(cloud, surfels, settings, tree);
      for (vtkIdType b = begin; b < end; ++b)
      {
        for (vtkIdType i = b * BlockSize; i < std::min(count, (b + 1) * BlockSize); ++i)
        {
          sampler.Sample(static_cast<int>(i), blocks[b]);
        }
      }
    });
    if (!monitor.Step(static_cast<double>(last) / blockCount))
    {
      return false;
    }
  }
  return true;
}

/// Per surfel sum over the samples of a term, in fixed point: the same in any order.
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
    return static_cast<std::int64_t>(std::min(term, LargestTerm) / FixedPoint);
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

double SumAt(const SampleBlock& block, size_t sample, const std::vector<double>& areas)
{
  double sum = 0.0;
  for (int e = block.Ends[sample]; e < block.Ends[sample + 1]; ++e)
  {
    sum += areas[block.Ids[e]] * block.Kernels[e];
  }
  return sum;
}

/// sums_i = sum_j w_j K_ji d_j / s_j with d_j = 1 on the surface and 0 beyond its border; or
/// sum_j w_j K_ji if `areas` is null.
void Accumulate(const Blocks& blocks, const std::vector<double>* areas, FixedSums& sums)
{
  sums.Clear();
  vtkSMPTools::For(
    0, static_cast<vtkIdType>(blocks.size()), 1, [&](vtkIdType begin, vtkIdType end) {
      // Most terms belong to the block's own surfels: those need no atomic addition.
      std::vector<std::int64_t> own(BlockSize);
      for (vtkIdType b = begin; b < end; ++b)
      {
        const SampleBlock& block = blocks[b];
        const vtkIdType first = b * BlockSize;
        std::fill(own.begin(), own.end(), 0);
        for (size_t s = 0; s < block.Count(); ++s)
        {
          if (areas && !block.Inside[s])
          {
            continue;
          }
          const double sum = areas ? std::max(SumAt(block, s, *areas), SmallestSum) : 1.0;
          const double factor = block.Weights[s] / sum;
          for (int e = block.Ends[s]; e < block.Ends[s + 1]; ++e)
          {
            const std::int64_t term = FixedSums::ToFixed(factor * block.Kernels[e]);
            const vtkIdType local = block.Ids[e] - first;
            if (local >= 0 && local < BlockSize)
            {
              own[local] += term;
            }
            else
            {
              sums.Add(block.Ids[e], term);
            }
          }
        }
        for (vtkIdType i = 0; i < BlockSize; ++i)
        {
          sums.Add(first + i, own[i]);
        }
      }
    });
}

SumStatistics Measure(const Blocks& blocks, const std::vector<double>& areas, WeightReport& report)
{
  SumStatistics result;
  double area = 0.0;
  double first = 0.0;
  double second = 0.0;
  vtkIdType samples = 0;
  for (const SampleBlock& block : blocks)
  {
    for (size_t s = 0; s < block.Count(); ++s)
    {
      if (!block.Inside[s])
      {
        continue;
      }
      const double sum = SumAt(block, s, areas);
      result.Minimum = samples == 0 ? sum : std::min(result.Minimum, sum);
      result.Maximum = samples == 0 ? sum : std::max(result.Maximum, sum);
      area += block.Weights[s];
      first += block.Weights[s] * sum;
      second += block.Weights[s] * sum * sum;
      ++samples;
    }
  }
  if (area > 0.0)
  {
    result.Mean = first / area;
    const double variance = second / area - result.Mean * result.Mean;
    result.StandardDeviation = std::sqrt(std::max(variance, 0.0));
  }
  report.SampledArea = area;
  report.NumberOfSamples = samples;
  return result;
}

void Step(const Blocks& blocks, const std::vector<WeightSurfel>& surfels,
  const WeightSettings& settings, const FixedSums& denominators, FixedSums& numerators,
  std::vector<double>& areas)
{
  Accumulate(blocks, &areas, numerators);
  for (size_t i = 0; i < areas.size(); ++i)
  {
    const double denominator = denominators.Get(i);
    if (denominator > 0.0)
    {
      const double start = surfels[i].Area;
      areas[i] = std::clamp(areas[i] * numerators.Get(i) / denominator,
        settings.MinimumFactor * start, settings.MaximumFactor * start);
    }
  }
}
}

WeightSurfel MakeWeightSurfel(const double areaVector[3], const double covariance[6])
{
  WeightSurfel surfel{};
  const Vector3 area{ areaVector[0], areaVector[1], areaVector[2] };
  surfel.Area = Length(area);
  surfel.Normal = Normalized(area, { 0.0, 0.0, 1.0 });
  Vector3 u, v;
  TangentFrame(surfel.Normal, u, v);
  const double* s = covariance;
  const auto apply = [s](const Vector3& a) {
    return Vector3{ s[0] * a.X + s[3] * a.Y + s[5] * a.Z, s[3] * a.X + s[1] * a.Y + s[4] * a.Z,
      s[5] * a.X + s[4] * a.Y + s[2] * a.Z };
  };
  const double uu = Dot(u, apply(u));
  const double uv = Dot(u, apply(v));
  const double vv = Dot(v, apply(v));
  const double determinant = uu * vv - uv * uv;
  surfel.Usable = surfel.Area > 0.0 && uu > 0.0 && determinant > 0.0 &&
    std::isfinite(surfel.Area) && std::isfinite(determinant);
  if (surfel.Usable)
  {
    // y' S^-1 y = x^2 / uu + (y - x uv / uu)^2 uu / det: Cholesky's factors of the inverse.
    surfel.B1 = (1.0 / std::sqrt(uu)) * u;
    surfel.B2 = std::sqrt(uu / determinant) * (v - (uv / uu) * u);
    surfel.Peak = 1.0 / (2.0 * Pi * std::sqrt(determinant));
    surfel.Sigma = std::sqrt(std::sqrt(determinant));
  }
  return surfel;
}

bool SolveWeights(const LocalCloud& cloud, const std::vector<WeightSurfel>& surfels,
  const WeightSettings& settings, const SurfelMonitor& monitor, std::vector<double>& areas,
  WeightReport& report)
{
  Blocks blocks;
  if (!MakeBlocks(cloud, surfels, settings, monitor.Part(0.0, 0.5), blocks))
  {
    return false;
  }
  report.Before = Measure(blocks, areas, report);
  if (report.NumberOfSamples == 0)
  {
    // A point or two: no place is known to be surface, and there is nothing to normalize.
    report.After = report.Before;
    return true;
  }
  FixedSums denominators(areas.size());
  Accumulate(blocks, nullptr, denominators);
  FixedSums numerators(areas.size());
  for (int step = 0; step < settings.NumberOfIterations; ++step)
  {
    Step(blocks, surfels, settings, denominators, numerators, areas);
    if (!monitor.Step(0.5 + 0.5 * (step + 1) / settings.NumberOfIterations))
    {
      return false;
    }
  }
  report.After = Measure(blocks, areas, report);
  return true;
}
}
