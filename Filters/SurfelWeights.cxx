// SPDX-License-Identifier: BSD-3-Clause
#include "SurfelWeights.h"

#include "LocalCloud.h"
#include "SurfelFit.h"
#include "SurfelNeighborhood.h"

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
constexpr double Pi = 3.14159265358979323846;

/// Near a border, the surface ends where the areas about, smoothed by a Gaussian of this many
/// spacings, cover half of the plane: at the edge of the outermost cells.
constexpr double BorderSmoothing = 1.0;
constexpr double BorderCoverage = 0.5;

/// Of the golden angle, 2.39996322972865332.
constexpr double GoldenCosine = -0.737368878078319730, GoldenSine = 0.675490294261523930;

/// Sums of weights below this are treated as this: it bounds one step of the iteration.
constexpr double SmallestSum = 1e-3;

/// The iteration ends where a step has taken less than 2 % off the standard deviation of the sums:
/// from there on it fits the samples rather than the surface. Sums at other samples of a sphere of
/// random points, whose cells start at 0.128, were at 0.126 after 1 to 4 steps and at 0.127
/// after 12.
constexpr double LeastProgress = 0.98;

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

  /// Keeps its memory.
  void Clear()
  {
    this->Ids.clear();
    this->Kernels.clear();
    this->Ends.assign(1, 0);
    this->Weights.clear();
    this->Inside.clear();
  }
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
    this->Spacing = std::sqrt(surfel.Area);
    const bool border = this->Gather(owner, u, v);
    const double radius = this->Settings.SampleRadius;
    const int count = this->Settings.SamplesPerPoint;
    const float weight = static_cast<float>(Pi * radius * radius * surfel.Area / count);
    // By the input's id, so that the samples do not depend on where the cloud lies.
    const auto seed = static_cast<std::uint64_t>(this->Cloud.InputIds[owner]);
    const double turn = 2.0 * Pi * Hash(2 * seed);
    const double shift = Hash(2 * seed + 1);
    // Vogel's disc: equal areas, golden angle.
    double cosine = std::cos(turn), sine = std::sin(turn);
    for (int s = 0; s < count; ++s)
    {
      const double r = radius * std::sqrt((s + shift) / count);
      const Vector3 offset = (r * cosine) * u + (r * sine) * v;
      const double turned = cosine * GoldenCosine - sine * GoldenSine;
      sine = sine * GoldenCosine + cosine * GoldenSine;
      cosine = turned;
      const Place at{ static_cast<float>(offset.X), static_cast<float>(offset.Y),
        static_cast<float>(offset.Z), static_cast<float>(r * r) };
      if (!this->IsInCell(at))
      {
        continue;
      }
      // Beyond the border the sum should be 0. Without samples there, it would be 1 up to the
      // very edge, at the price of a rim of surfels that are too heavy.
      block.Inside.push_back(!border || this->Coverage(at) >= BorderCoverage);
      this->AddEntries(at, block);
      block.Weights.push_back(weight);
      block.Ends.push_back(static_cast<int>(block.Ids.size()));
    }
  }

private:
  /// The owner's sheet, itself first, then nearest first, field by field: what a loop takes all of.
  /// Lengths from the owner and in units of its spacing.
  struct Sheet
  {
    static constexpr int Most = 264; // a query's 256 neighbours, the owner, and full vectors
    int Count;
    int Ids[Most];
    float X[Most], Y[Most], Z[Most], Squared[Most];
    float B1X[Most], B1Y[Most], B1Z[Most], B2X[Most], B2Y[Most], B2Z[Most];
    float NX[Most], NY[Most], NZ[Most], Climb[Most];
  };

  void AddToSheet(int id, const Vector3& offset)
  {
    Sheet& s = this->Near;
    const WeightSurfel& surfel = this->Surfels[id];
    const double scale = this->Spacing;
    const int k = s.Count++;
    s.Ids[k] = id;
    const double inverse = 1.0 / scale;
    s.X[k] = static_cast<float>(offset.X * inverse);
    s.Y[k] = static_cast<float>(offset.Y * inverse);
    s.Z[k] = static_cast<float>(offset.Z * inverse);
    s.Squared[k] = s.X[k] * s.X[k] + s.Y[k] * s.Y[k] + s.Z[k] * s.Z[k];
    s.B1X[k] = static_cast<float>(scale * surfel.B1.X);
    s.B1Y[k] = static_cast<float>(scale * surfel.B1.Y);
    s.B1Z[k] = static_cast<float>(scale * surfel.B1.Z);
    s.B2X[k] = static_cast<float>(scale * surfel.B2.X);
    s.B2Y[k] = static_cast<float>(scale * surfel.B2.Y);
    s.B2Z[k] = static_cast<float>(scale * surfel.B2.Z);
    s.NX[k] = surfel.Normal.X;
    s.NY[k] = surfel.Normal.Y;
    s.NZ[k] = surfel.Normal.Z;
    s.Climb[k] = static_cast<float>(this->Settings.NormalOffset * surfel.Sigma * inverse);
  }

  /// Finds the owner's sheet around it; returns whether it may lie on a border: of 24 random
  /// neighbours inside a surface, one point in 2000 has such a gap.
  bool Gather(int owner, const Vector3& u, const Vector3& v)
  {
    const WeightSurfel& surfel = this->Surfels[owner];
    const Vector3 p = Load(this->Cloud.Position(owner));
    this->Tree.FindNearest(owner, this->Settings.NumberOfNeighbors, this->Found);
    this->Near.Count = 0;
    this->Gap.Clear();
    this->AddToSheet(owner, Vector3());
    for (const int j : this->Found.Ids)
    {
      if (!this->Surfels[j].Usable || !AreCompatible(surfel, this->Surfels[j]))
      {
        continue;
      }
      const Vector3 offset = Load(this->Cloud.Position(j)) - p;
      this->AddToSheet(j, offset);
      const double x = Dot(offset, u);
      const double y = Dot(offset, v);
      const double climb = Dot(offset, surfel.Normal);
      if (x * x + y * y > climb * climb)
      {
        this->Gap.Add(x, y);
      }
    }
    return this->Gap.Exists();
  }

  /// A sample's place, in units of the owner's spacing.
  struct Place
  {
    float X, Y, Z;
    float Squared; // distance to the owner
  };

  /// Whether a sample is nearer to its owner than to any other surfel of the sheet.
  bool IsInCell(const Place& at) const
  {
    const Sheet& s = this->Near;
    // What is twice as far from the owner as the sample cannot be nearer to the sample.
    for (int k = 1; k < s.Count && s.Squared[k] < 4.0f * at.Squared; ++k)
    {
      const float x = at.X - s.X[k], y = at.Y - s.Y[k], z = at.Z - s.Z[k];
      if (x * x + y * y + z * z < at.Squared)
      {
        return false;
      }
    }
    return true;
  }

  /// Share of the plane that the areas of the sheet cover about a place.
  double Coverage(const Place& at) const
  {
    const Sheet& s = this->Near;
    constexpr double variance = BorderSmoothing * BorderSmoothing;
    double sum = 0.0;
    for (int k = 0; k < s.Count; ++k)
    {
      const double x = at.X - s.X[k], y = at.Y - s.Y[k], z = at.Z - s.Z[k];
      sum += this->Surfels[s.Ids[k]].Area * std::exp(-0.5 * (x * x + y * y + z * z) / variance);
    }
    return sum / (2.0 * Pi * variance * this->Spacing * this->Spacing);
  }

  void AddEntries(const Place& at, SampleBlock& block)
  {
    const Sheet& s = this->Near;
    float* exponents = this->Exponents;
    for (int k = 0; k < s.Count; ++k)
    {
      const float x = at.X - s.X[k], y = at.Y - s.Y[k], z = at.Z - s.Z[k];
      const float b1 = s.B1X[k] * x + s.B1Y[k] * y + s.B1Z[k] * z;
      const float b2 = s.B2X[k] * x + s.B2Y[k] * y + s.B2Z[k] * z;
      const float climb = s.NX[k] * x + s.NY[k] * y + s.NZ[k] * z;
      const float q = 0.5f * (b1 * b1 + b2 * b2);
      exponents[k] = climb * climb < s.Climb[k] * s.Climb[k] ? q : Far;
    }
    const float support = static_cast<float>(this->Settings.Support);
    for (int k = 0; k < s.Count; ++k)
    {
      if (exponents[k] < support)
      {
        const double peak = this->KernelScale * this->Surfels[s.Ids[k]].Peak;
        block.Ids.push_back(s.Ids[k]);
        block.Kernels.push_back(static_cast<float>(peak) * std::exp(-exponents[k]));
      }
    }
  }

  static constexpr float Far = 1e30f;

  const LocalCloud& Cloud;
  const std::vector<WeightSurfel>& Surfels;
  const WeightSettings& Settings;
  const SurfelNeighborhood& Tree;
  double KernelScale;
  double Spacing = 1.0; // of the owner
  Neighbors Found;
  Sheet Near;
  float Exponents[Sheet::Most];
  DirectionGap Gap;
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
      SampleBlock block;
      for (vtkIdType b = begin; b < end; ++b)
      {
        block.Clear();
        for (vtkIdType i = b * BlockSize; i < std::min(count, (b + 1) * BlockSize); ++i)
        {
          sampler.Sample(static_cast<int>(i), block);
        }
        blocks[b] = block; // without the room that it grew into
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

/// Moments of the sums over the samples of a block that are on the surface.
struct BlockSums
{
  double Area = 0.0, First = 0.0, Second = 0.0;
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

  void Add(const BlockSums& other)
  {
    this->Area += other.Area;
    this->First += other.First;
    this->Second += other.Second;
    this->Minimum = std::min(this->Minimum, other.Minimum);
    this->Maximum = std::max(this->Maximum, other.Maximum);
    this->Samples += other.Samples;
  }
};

SumStatistics Statistics(const std::vector<BlockSums>& blocks, WeightReport& report)
{
  BlockSums all;
  for (const BlockSums& block : blocks)
  {
    all.Add(block);
  }
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

/// Terms of one block: sums_i += w_j K_ji d_j / s_j with d_j = 1 on the surface and 0 beyond its
/// border; or w_j K_ji if `areas` is null.
/// @param own [BlockSize] of the block's own surfels, most terms: these need no atomic addition
void AccumulateBlock(const SampleBlock& block, vtkIdType first, const std::vector<double>* areas,
  std::vector<std::int64_t>& own, FixedSums& sums, BlockSums& statistics)
{
  std::fill(own.begin(), own.end(), 0);
  for (size_t s = 0; s < block.Count(); ++s)
  {
    if (areas && !block.Inside[s])
    {
      continue;
    }
    const double sum = areas ? SumAt(block, s, *areas) : 1.0;
    const double factor = block.Weights[s] / std::max(sum, SmallestSum);
    if (areas)
    {
      statistics.Add(block.Weights[s], sum);
    }
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

/// @param statistics of the sums at the given areas, block by block
void Accumulate(const Blocks& blocks, const std::vector<double>* areas, FixedSums& sums,
  std::vector<BlockSums>& statistics)
{
  sums.Clear();
  statistics.assign(blocks.size(), BlockSums());
  vtkSMPTools::For(
    0, static_cast<vtkIdType>(blocks.size()), 1, [&](vtkIdType begin, vtkIdType end) {
      std::vector<std::int64_t> own(BlockSize);
      for (vtkIdType b = begin; b < end; ++b)
      {
        AccumulateBlock(blocks[b], b * BlockSize, areas, own, sums, statistics[b]);
      }
    });
}

SumStatistics Measure(const Blocks& blocks, const std::vector<double>& areas, WeightReport& report)
{
  std::vector<BlockSums> statistics(blocks.size());
  vtkSMPTools::For(
    0, static_cast<vtkIdType>(blocks.size()), 1, [&](vtkIdType begin, vtkIdType end) {
      for (vtkIdType b = begin; b < end; ++b)
      {
        for (size_t s = 0; s < blocks[b].Count(); ++s)
        {
          if (blocks[b].Inside[s])
          {
            statistics[b].Add(blocks[b].Weights[s], SumAt(blocks[b], s, areas));
          }
        }
      }
    });
  return Statistics(statistics, report);
}

void Step(const std::vector<WeightSurfel>& surfels, const WeightSettings& settings,
  const FixedSums& denominators, const FixedSums& numerators, std::vector<double>& areas)
{
  vtkSMPTools::For(0, static_cast<vtkIdType>(areas.size()), [&](vtkIdType begin, vtkIdType end) {
    for (vtkIdType i = begin; i < end; ++i)
    {
      const double denominator = denominators.Get(i);
      if (denominator > 0.0)
      {
        const double start = surfels[i].Area;
        areas[i] = std::clamp(areas[i] * numerators.Get(i) / denominator,
          settings.MinimumFactor * start, settings.MaximumFactor * start);
      }
    }
  });
}
}

WeightSurfel MakeWeightSurfel(const double areaVector[3], const double covariance[6])
{
  WeightSurfel surfel{};
  const Vector3 area{ areaVector[0], areaVector[1], areaVector[2] };
  const Vector3 normal = Normalized(area, { 0.0, 0.0, 1.0 });
  surfel.Area = static_cast<float>(Length(area));
  surfel.Normal = normal;
  Vector3 u, v;
  TangentFrame(normal, u, v);
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
    surfel.Peak = static_cast<float>(1.0 / (2.0 * Pi * std::sqrt(determinant)));
    surfel.Sigma = static_cast<float>(std::sqrt(std::sqrt(determinant)));
    // Kernels are floats: peaks, 1 / area, end at 3e38.
    surfel.Usable = std::isfinite(surfel.Peak) && surfel.Sigma > 0.0f;
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
  // A point or two: no place is known to be surface, and there is nothing to normalize.
  std::vector<BlockSums> statistics;
  FixedSums denominators(areas.size());
  Accumulate(blocks, nullptr, denominators, statistics);
  FixedSums numerators(areas.size());
  double last = std::numeric_limits<double>::infinity();
  for (int step = 0; step < settings.NumberOfIterations; ++step)
  {
    Accumulate(blocks, &areas, numerators, statistics);
    const SumStatistics now = Statistics(statistics, report);
    report.Before = step == 0 ? now : report.Before;
    if (now.StandardDeviation > LeastProgress * last || report.NumberOfSamples == 0)
    {
      break;
    }
    last = now.StandardDeviation;
    Step(surfels, settings, denominators, numerators, areas);
    if (!monitor.Step(0.5 + 0.5 * (step + 1) / settings.NumberOfIterations))
    {
      return false;
    }
  }
  report.After = Measure(blocks, areas, report);
  if (settings.NumberOfIterations == 0)
  {
    report.Before = report.After;
  }
  return monitor.Step(1.0);
}
}
