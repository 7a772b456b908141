// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Normalization/SurfaceSamples.h"

#include "Core/Base/Pool.h"
#include "Core/Simd/Multiversion.h"
#include "Filters/Common/Hash.h"
#include "Filters/Common/Intrinsics.h"
#include "Filters/Common/Median.h"
#include "Filters/Common/ParallelFor.h"
#include "Filters/Neighbors/AngularGap.h"
#include "Filters/Neighbors/LocalCloud.h"
#include "Filters/Neighbors/NeighborGraph.h"
#include "Filters/Neighbors/NeighborSearch.h"
#include "Filters/Normalization/OwnerSheet.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>

namespace SurfelGeometry
{
namespace
{
/// Near a border, the surface ends where the surrounding areas, smoothed by a Gaussian of this many
/// spacings, cover half of the plane: at the edge of the outermost cells.
constexpr double EdgeSmoothing = 1.0;
constexpr double EdgeCoverage = 0.5;

/// A surfel with no others on one side is beside a step of density, not on a border, if its area is
/// this many times the median of its neighbours': at a border, cells end. The first sparse surfels
/// beyond are not among its nearest ones.
constexpr float StepOfAreas = 8.0f;
constexpr float Everything = 1e30f;

constexpr double GoldenAngle = 2.39996322972865332;

/// Positions of some samples, in units of the owner's spacing.
struct SamplePositions
{
  static constexpr int Capacity = 16;

  alignas(64) float X[Capacity];
  alignas(64) float Y[Capacity];
  alignas(64) float Z[Capacity];
  alignas(64) int Nearer[Capacity]; // 1: another surfel of the sheet is nearer than the owner
};

/// Vogel's spiral in a disc: equal areas, golden angle.
struct Spiral
{
  static constexpr int MostSamples = 256;

  float SquaredStep;    // difference of the squared radii of two samples
  float Shift = 0.0f;   // along the spiral, in samples
  Float3 Along, Across; // unit
  float Cosines[MostSamples], Sines[MostSamples];

  explicit Spiral(const WeightSettings& settings)
    : SquaredStep(static_cast<float>(
        settings.SampleRadius * settings.SampleRadius / settings.SamplesPerPoint))
  {
    for (int s = 0; s < MostSamples; ++s)
    {
      this->Cosines[s] = static_cast<float>(std::cos(GoldenAngle * s));
      this->Sines[s] = static_cast<float>(std::sin(GoldenAngle * s));
    }
  }

  /// Begins in the plane of u and v, turned by an angle.
  void Begin(const Vector3& u, const Vector3& v, float turn, double shift)
  {
    const double cosine = std::cos(turn), sine = std::sin(turn);
    this->Along = cosine * u + sine * v;
    this->Across = cosine * v + (-sine) * u;
    this->Shift = static_cast<float>(shift);
  }

  float SquaredRadius(int sample) const
  {
    return (static_cast<float>(sample) + this->Shift) * this->SquaredStep;
  }
};

/// Places the samples from `first` on.
SURFEL_MULTIVERSION void PlaceSamples(const Spiral& spiral, int first, SamplePositions& at)
{
  for (int lane = 0; lane < SamplePositions::Capacity; ++lane)
  {
    const float r =
      std::sqrt((static_cast<float>(first + lane) + spiral.Shift) * spiral.SquaredStep);
    const float x = r * spiral.Cosines[first + lane], y = r * spiral.Sines[first + lane];
    at.X[lane] = x * spiral.Along.X + y * spiral.Across.X;
    at.Y[lane] = x * spiral.Along.Y + y * spiral.Across.Y;
    at.Z[lane] = x * spiral.Along.Z + y * spiral.Across.Z;
  }
}

/// @param squaredReach largest squared distance of a position from the owner
SURFEL_MULTIVERSION void FindNearer(
  const OwnerSheet& s, float squaredReach, SamplePositions& positions)
{
  for (int lane = 0; lane < SamplePositions::Capacity; ++lane)
  {
    positions.Nearer[lane] = 0;
  }
  // A surfel twice as far from the owner as a sample cannot be nearer to the sample.
  for (int k = 1; k < s.Count(); ++k)
  {
    if (s.Squared[k] >= 4.0f * squaredReach)
    {
      continue;
    }
    const SheetKernels& at = s.Kernels;
    const float x = 2.0f * at.X[k], y = 2.0f * at.Y[k], z = 2.0f * at.Z[k];
    const float squared = s.Squared[k];
    for (int lane = 0; lane < SamplePositions::Capacity; ++lane)
    {
      // |at - x|^2 < |at|^2
      const float twice = positions.X[lane] * x + positions.Y[lane] * y + positions.Z[lane] * z;
      positions.Nearer[lane] |= squared < twice ? 1 : 0;
    }
  }
}

/// A mean of numbers; 0 of none.
class Mean
{
public:
  void Add(float x)
  {
    this->Sum += x;
    ++this->Count;
  }
  float Get() const { return this->Count > 0 ? this->Sum / static_cast<float>(this->Count) : 0.0f; }

private:
  float Sum = 0.0f;
  int Count = 0;
};

/// Makes the samples of one surfel after another.
class Sampler
{
public:
  /// @param tree null: the problem has a graph
  Sampler(const WeightProblem& problem, const NeighborSearch* tree)
    : Problem(problem)
    , Settings(problem.Settings)
    , Tree(tree)
    , Table(problem)
    , Places(problem.Settings)
  {
  }

  /// Samples the surfels from `first` to `last`.
  void SampleAll(int first, int last, SampledSurface& surface, SampleBlock& block)
  {
    block.Clear();
    block.First = first;
    this->Entries = 0;
    this->FindRows(first, last);
    for (int i = first; i < last; ++i)
    {
      const WeightedKernel& kernel = this->Table[static_cast<std::size_t>(i - first)].Kernel;
      surface.Areas[i] = kernel.Usable ? kernel.Area : 0.0f;
      surface.Peaks[i] = kernel.Usable ? kernel.Peak : 0.0f;
      const std::size_t samples = block.Samples.size();
      this->Overlap = Mean();
      if (kernel.Usable)
      {
        this->Sample(i, i - first, block);
      }
      surface.Overlaps[i] = static_cast<float>(this->Overlap.Get());
      block.Owned.push_back(static_cast<std::uint16_t>(block.Samples.size() - samples));
    }
    block.Others = this->Table.Others();
    block.Numbers.resize(this->Entries);
    block.Kernels.resize(this->Entries);
  }

  /// The surfels of the last block.
  const SurfelTable& GetTable() const { return this->Table; }

private:
  /// @param own number of the owner in the table
  void Sample(int owner, int own, SampleBlock& block)
  {
    const WeightedKernel& kernel = this->Table[static_cast<std::size_t>(own)].Kernel;
    Vector3 u, v;
    TangentFrame(kernel.Normal, u, v);
    this->Spacing = std::sqrt(kernel.Area);
    const bool border = this->Gather(own);
    // Seeded by the input's id, so that the samples do not depend on where the cloud lies.
    const auto seed = static_cast<std::uint64_t>(this->Problem.Cloud.SampleId(owner));
    const auto turn = static_cast<float>(2.0 * Pi * Hash(2 * seed));
    this->Places.Begin(u, v, turn, Hash(2 * seed + 1));
    const int count = this->Settings.SamplesPerPoint;
    for (int first = 0; first < count; first += SamplePositions::Capacity)
    {
      const int last = std::min(count, first + SamplePositions::Capacity);
      PlaceSamples(this->Places, first, this->At);
      FindNearer(this->Near, this->Places.SquaredRadius(last - 1), this->At);
      for (std::uint64_t own = this->OwnLanes(last - first); own != 0; own &= own - 1)
      {
        const int lane = LowestBit(own);
        Float3 at;
        at.X = this->At.X[lane];
        at.Y = this->At.Y[lane];
        at.Z = this->At.Z[lane];
        this->Add(owner, at, border, block);
      }
    }
  }

  /// Bits of the first `count` positions that are the owner's. No branch depends on which they are.
  std::uint64_t OwnLanes(int count) const
  {
    std::uint64_t own = 0;
    for (int lane = 0; lane < SamplePositions::Capacity; ++lane)
    {
      const float x = this->At.X[lane], y = this->At.Y[lane], z = this->At.Z[lane];
      const bool isOwn = (this->At.Nearer[lane] == 0) & (x * x + y * y + z * z < this->Known);
      own |= std::uint64_t{ isOwn } << lane;
    }
    return own & ((std::uint64_t{ 1 } << count) - 1);
  }

  void Add(int owner, const Float3& at, bool border, SampleBlock& block)
  {
    // Beyond the border the wanted sum is 0. Without samples there, the sum would be 1 up to the
    // very edge, and the surfels of the rim would be too heavy.
    const WeightSharing* sharing = this->Problem.Sharing;
    const bool isInside = !border || this->Coverage(at) >= EdgeCoverage;
    const bool isOwn = !sharing || sharing->IsOwn[static_cast<std::size_t>(owner)];
    const int kind = !isInside ? 0 : isOwn ? CountedSample : HaloSample;
    if (isInside)
    {
      this->Overlap.Add(this->OverlapAt(at));
    }
    const int entries = this->AddEntries(at, block);
    block.Samples.push_back(static_cast<std::uint16_t>(entries | kind << SampleBlock::KindShift));
  }

  /// Finds the nearest surfels of those from `first` to `last`, and loads the kernels of all.
  void FindRows(int first, int last)
  {
    this->Table.Begin(first, last);
    const int wanted = this->Settings.NumberOfNeighbors;
    this->Row.resize(static_cast<std::size_t>(wanted) * static_cast<std::size_t>(last - first));
    this->RowEnds.assign(1, 0);
    std::size_t end = 0;
    for (int i = first; i < last; ++i)
    {
      const int* row = nullptr;
      int count = std::min(wanted, KeptNeighbors);
      if (this->Tree)
      {
        this->Tree->FindNearest(i, wanted, this->Found);
        row = this->Found.Ids.data();
        count = this->Found.Count();
      }
      else
      {
        row = this->Problem.Graph->Row(static_cast<std::size_t>(i));
      }
      for (int k = 0; k < count && row[k] >= 0; ++k)
      {
        this->Row[end++] = this->Table.NumberOf(row[k]);
      }
      this->RowEnds.push_back(end);
    }
    this->Table.Load();
  }

  /// Finds the owner's sheet. Returns whether the owner may lie on a border: with 24 random
  /// neighbours, one point in 2000 inside a surface has such a gap.
  bool Gather(int own)
  {
    const auto number = static_cast<std::size_t>(own);
    const std::size_t first = this->RowEnds[number], last = this->RowEnds[number + 1];
    OwnerSheet& near = this->Near;
    near.Load(this->Table, static_cast<std::uint16_t>(own), this->Row.data() + first,
      static_cast<int>(last - first), this->Settings);
    this->Around.Clear();
    for (int k = 1; k < near.Count() && this->Around.MayHaveGap(); ++k)
    {
      const float x = near.AlongU[k], y = near.AlongV[k], climb = near.Climbs[k];
      if (near.Has(k) && x * x + y * y > climb * climb)
      {
        this->Around.Add(x, y);
      }
    }
    this->Known = Everything;
    const bool gap = this->Around.HaveGap();
    if (gap && this->Table[number].Kernel.Area > StepOfAreas * this->MedianArea())
    {
      // Within half of their reach, the nearest surfels tell whose a place is.
      this->Known = 0.25f * this->SquaredReach();
      return false;
    }
    return gap;
  }

  /// Of the surfels of the owner's sheet.
  float SquaredReach() const
  {
    float reach = 0.0f;
    for (int k = 0; k < this->Near.Count(); ++k)
    {
      reach = this->Near.Has(k) ? std::max(reach, this->Near.Squared[k]) : reach;
    }
    return reach;
  }

  float AreaOf(int k) const { return this->Table[this->Near.Kernels.Numbers[k]].Kernel.Area; }

  /// Of the owner's sheet.
  float MedianArea()
  {
    this->Areas.clear();
    for (int k = 0; k < this->Near.Count(); ++k)
    {
      if (this->Near.Has(k))
      {
        this->Areas.push_back(this->AreaOf(k));
      }
    }
    return Median(this->Areas);
  }

  /// Share of the plane around a position that the areas of the sheet cover.
  double Coverage(const Float3& at) const
  {
    const SheetKernels& s = this->Near.Kernels;
    constexpr double variance = EdgeSmoothing * EdgeSmoothing;
    double sum = 0.0;
    for (int k = 0; k < s.Count; ++k)
    {
      if (this->Near.Has(k))
      {
        const double x = at.X - s.X[k], y = at.Y - s.Y[k], z = at.Z - s.Z[k];
        sum += this->AreaOf(k) * std::exp(-0.5 * (x * x + y * y + z * z) / variance);
      }
    }
    return sum / (2.0 * Pi * variance * this->Spacing * this->Spacing);
  }

  /// Share of its weight that a surfel loses at a sample to the sheets around it. Its own sheet
  /// covers the sample once, those in front f times, those behind it b times:
  ///
  ///   o = 2 f / (1 + f + b), at most 1
  ///
  /// The first of two sheets keeps its weight then, and the second has none. All together have as
  /// much as if each lost the same, (f + b) / (1 + f + b), as they do where none is in front.
  double OverlapAt(const Float3& at)
  {
    const double front = this->CoverAt(at, this->Near.InFront);
    const double behind = this->CoverAt(at, this->Near.Behind);
    const double sum = front + behind;
    const double twice = sum + static_cast<double>(this->Near.Distinct) * (front - behind);
    return std::min(twice / (1.0 + sum), 1.0);
  }

  /// How often sheets cover a sample.
  double CoverAt(const Float3& at, const SheetKernels& sheets)
  {
    if (sheets.Count == 0)
    {
      return 0.0;
    }
    FindKernels(sheets, at, static_cast<float>(this->Settings.Support), this->Values);
    double sum = 0.0;
    for (int k = 0; k < sheets.Count; ++k)
    {
      const WeightedKernel& kernel = this->Table[sheets.Numbers[k]].Kernel;
      sum += this->Values[k] * (static_cast<double>(kernel.Area) * kernel.Peak);
    }
    return sum / KernelPeak;
  }

  /// @return the number of kernels that reach the sample
  int AddEntries(const Float3& at, SampleBlock& block)
  {
    const SheetKernels& near = this->Near.Kernels;
    FindKernels(near, at, static_cast<float>(this->Settings.Support), this->Values);
    const auto needed = this->Entries + static_cast<std::size_t>(near.Count);
    if (needed > block.Numbers.size())
    {
      block.Numbers.resize(2 * needed);
      block.Kernels.resize(2 * needed);
    }
    std::uint16_t* numbers = block.Numbers.data() + this->Entries;
    std::uint16_t* kernels = block.Kernels.data() + this->Entries;
    // Branch-free: whether a kernel reaches a sample is hard to predict.
    int entries = 0;
    for (int k = 0; k < near.Count; ++k)
    {
      numbers[entries] = near.Numbers[k];
      kernels[entries] = static_cast<std::uint16_t>(this->Values[k]);
      entries += this->Values[k] != 0 ? 1 : 0;
    }
    this->Entries += static_cast<std::size_t>(entries);
    return entries;
  }

  const WeightProblem& Problem;
  const WeightSettings& Settings;
  const NeighborSearch* Tree;
  SurfelTable Table;
  std::vector<std::uint16_t> Row;   // numbers of the nearest surfels, one surfel's after another's
  std::vector<std::size_t> RowEnds; // [surfels + 1] in Row
  Spiral Places;
  double Spacing = 1.0; // the owner's
  OwnerSheet Near;
  SamplePositions At{};
  Mean Overlap; // of the owner's samples
  alignas(64) int Values[SheetKernels::Capacity];
  std::size_t Entries = 0; // of the block
  Neighbors Found;
  Directions Around;
  float Known =
    Everything; // squared distance, in spacings, up to which it is clear whose a place is
  std::vector<float> Areas; // scratch
};
}

void SampleBlock::Clear()
{
  this->Others.clear();
  this->Owned.clear();
  this->Samples.clear();
  this->Numbers.clear();
  this->Kernels.clear();
}

double SampleShare(const WeightSettings& settings)
{
  return Pi * settings.SampleRadius * settings.SampleRadius / settings.SamplesPerPoint;
}

void BeginSamples(const WeightProblem& problem, SampledSurface& surface)
{
  const auto count = static_cast<std::size_t>(problem.Cloud.Size());
  const auto size = static_cast<std::size_t>(SampleBlockSize(problem.Settings));
  surface.Areas.resize(count);
  surface.Peaks.resize(count);
  surface.Overlaps.resize(count);
  surface.Blocks.resize((count + size - 1) / size);
}

bool MakeSamples(const WeightProblem& problem, const StageProgress& progress,
  const BlockVisitor& visit, SampledSurface& surface)
{
  const LocalCloud& cloud = problem.Cloud;
  const int count = cloud.Size(), size = SampleBlockSize(problem.Settings);
  const std::unique_ptr<NeighborSearch> tree(
    problem.Graph ? nullptr : new NeighborSearch(cloud.Positions.data(), count));
  const auto blockCount = static_cast<vtkIdType>(surface.Blocks.size());
  const vtkIdType stride = std::max(1, (1 << 18) / size); // blocks between two checks for an abort
  // Kept from one range of blocks to the next: fresh memory takes time.
  SurfelSplatting::Pool<std::optional<std::pair<Sampler, SampleBlock>>> workers;
  for (vtkIdType first = 0; first < blockCount; first += stride)
  {
    const vtkIdType last = std::min(first + stride, blockCount);
    ParallelFor(first, last, 1, [&](vtkIdType b, vtkIdType end) {
      const decltype(workers)::Loan worker(workers);
      if (!*worker)
      {
        worker->emplace(Sampler(problem, tree.get()), SampleBlock());
      }
      auto& [sampler, block] = **worker;
      for (; b < end; ++b)
      {
        const int from = static_cast<int>(b) * size;
        sampler.SampleAll(from, std::min(count, from + size), surface, block);
        visit(static_cast<std::size_t>(b), block, sampler.GetTable());
        surface.Blocks[static_cast<std::size_t>(b)] = block; // the copy has no spare capacity
      }
    });
    if (problem.Graph)
    {
      const auto rows = static_cast<std::size_t>(size);
      problem.Graph->Release(static_cast<std::size_t>(first) * rows,
        std::min(static_cast<std::size_t>(last) * rows, static_cast<std::size_t>(count)));
    }
    if (!progress.Step(static_cast<double>(last) / static_cast<double>(blockCount)))
    {
      return false;
    }
  }
  return true;
}
}
