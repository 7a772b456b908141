// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Normalization/SurfaceSamples.h"

#include "Filters/Common/AngularGap.h"
#include "Filters/Common/Hash.h"
#include "Filters/Common/LocalCloud.h"
#include "Filters/Common/Median.h"
#include "Filters/Common/Multiversion.h"
#include "Filters/Common/NeighborGraph.h"
#include "Filters/Common/NeighborSearch.h"
#include "Filters/Common/SurfaceFold.h"

#include "vtkSMPThreadLocal.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
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

/// Whether two surfels can be on the same sheet of surface.
/// @param cosine of their normals
bool AreCompatible(const WeightedKernel& a, const WeightedKernel& b, float cosine)
{
  return a.TwoSided == b.TwoSided && (a.TwoSided || cosine > SharpestFold);
}

/// A kernel as it covers what lies behind or in front of it along a direction: it is evaluated
/// where the line through a sample meets its plane. At a crease the kernels of the other side do
/// not count then. One that is seen edge-on covers nothing.
WeightedKernel SeenAlong(const Float3& direction, const WeightedKernel& kernel)
{
  const Float3& n = kernel.Normal;
  const float inverse = 1.0f / SingleDot(direction, n);
  WeightedKernel seen = kernel;
  for (Float3* row : { &seen.B1, &seen.B2 })
  {
    const float along = SingleDot(direction, *row) * inverse;
    row->X -= along * n.X;
    row->Y -= along * n.Y;
    row->Z -= along * n.Z;
  }
  return seen;
}

/// A neighbour's kernel at the owner's samples, across a fold. It is evaluated along the mean of
/// both normals, which unrolls the surface: a place beyond the fold is that on the other side of
/// it.
/// @param at the neighbour, seen from the owner
/// @param cosine of the normals
WeightedKernel Unrolled(
  const WeightedKernel& owner, const WeightedKernel& kernel, const Float3& at, float cosine)
{
  const float sign = owner.TwoSided
    ? AgreeingSign(cosine, SingleDot(at, owner.Normal), SingleDot(at, kernel.Normal))
    : 1.0f;
  Float3 mean;
  mean.X = owner.Normal.X + sign * kernel.Normal.X;
  mean.Y = owner.Normal.Y + sign * kernel.Normal.Y;
  mean.Z = owner.Normal.Z + sign * kernel.Normal.Z;
  return SeenAlong(mean, kernel);
}

/// Places of the owner and its neighbours on the same sheet, relative to the owner, in units of its
/// spacing.
struct Sheet
{
  static constexpr int Capacity = Directions::Capacity;

  int Count;
  std::uint16_t Numbers[Capacity]; // in the table
  float X[Capacity];
  float Y[Capacity];
  float Z[Capacity];
  float Squared[Capacity];

  void Add(std::uint16_t number, const Float3& at, float squared)
  {
    const int k = this->Count++;
    this->Numbers[k] = number;
    this->X[k] = at.X;
    this->Y[k] = at.Y;
    this->Z[k] = at.Z;
    this->Squared[k] = squared;
  }
};

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
SURFEL_MULTIVERSION void FindNearer(const Sheet& s, float squaredReach, SamplePositions& positions)
{
  for (int lane = 0; lane < SamplePositions::Capacity; ++lane)
  {
    positions.Nearer[lane] = 0;
  }
  // A surfel twice as far from the owner as a sample cannot be nearer to the sample.
  for (int k = 1; k < s.Count; ++k)
  {
    if (s.Squared[k] >= 4.0f * squaredReach)
    {
      continue;
    }
    const float x = 2.0f * s.X[k], y = 2.0f * s.Y[k], z = 2.0f * s.Z[k], squared = s.Squared[k];
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
    const bool border = this->Gather(own, u, v);
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
  bool Gather(int own, const Float3& u, const Float3& v)
  {
    const auto number = static_cast<std::size_t>(own);
    const WeightedKernel& kernel = this->Table[number].Kernel;
    const Float3& p = this->Table[number].Position;
    const auto spacing = static_cast<float>(this->Spacing);
    const float inverse = 1.0f / spacing;
    this->Near.Count = this->Kernels.Count = this->Others.Count = 0;
    this->Around.Clear();
    this->Near.Add(static_cast<std::uint16_t>(own), Float3(), 0.0f);
    this->Kernels.Add(static_cast<std::uint16_t>(own), Float3(), kernel, spacing,
      kernel.Sigma / spacing, this->OwnSheet());
    for (std::size_t k = this->RowEnds[number]; k < this->RowEnds[number + 1]; ++k)
    {
      const auto& [other, q, reach] = this->Table[this->Row[k]];
      const float cosine = SingleDot(kernel.Normal, other.Normal);
      if (!other.Usable || !AreCompatible(kernel, other, cosine))
      {
        continue;
      }
      Float3 at;
      at.X = inverse * (q.X - p.X);
      at.Y = inverse * (q.Y - p.Y);
      at.Z = inverse * (q.Z - p.Z);
      const float squared = SingleDot(at, at);
      this->Near.Add(this->Row[k], at, squared);
      this->AddKernels(kernel, { this->Row[k], at, squared, inverse * reach, cosine });
      if (this->Around.MayHaveGap())
      {
        const float x = SingleDot(at, u), y = SingleDot(at, v);
        const float climb = SingleDot(at, kernel.Normal);
        if (x * x + y * y > climb * climb)
        {
          this->Around.Add(x, y);
        }
      }
    }
    this->Kernels.Pad();
    this->Others.Pad();
    this->Known = Everything;
    const bool gap = this->Around.HaveGap();
    if (gap && kernel.Area > StepOfAreas * this->MedianArea())
    {
      // Within half of their reach, the nearest surfels tell whose a place is.
      this->Known =
        0.25f * *std::max_element(this->Near.Squared, this->Near.Squared + this->Near.Count);
      return false;
    }
    return gap;
  }

  /// Of the owner's sheet.
  float MedianArea()
  {
    this->Areas.clear();
    for (int k = 0; k < this->Near.Count; ++k)
    {
      this->Areas.push_back(this->Table[this->Near.Numbers[k]].Kernel.Area);
    }
    return Median(this->Areas);
  }

  /// Share of the plane around a position that the areas of the sheet cover.
  double Coverage(const Float3& at) const
  {
    const Sheet& s = this->Near;
    constexpr double variance = EdgeSmoothing * EdgeSmoothing;
    double sum = 0.0;
    for (int k = 0; k < s.Count; ++k)
    {
      const double x = at.X - s.X[k], y = at.Y - s.Y[k], z = at.Z - s.Z[k];
      const float area = this->Table[s.Numbers[k]].Kernel.Area;
      sum += area * std::exp(-0.5 * (x * x + y * y + z * z) / variance);
    }
    return sum / (2.0 * Pi * variance * this->Spacing * this->Spacing);
  }

  ClimbRange OwnSheet() const { return { 0.0f, static_cast<float>(this->Settings.NormalOffset) }; }

  /// In units of the owner's spacing.
  struct Neighbor
  {
    std::uint16_t Number; // in the table
    Float3 At;
    float Squared; // distance
    float Reach;   // of its kernel on its own sheet
    float Cosine;  // of its normal and the owner's
  };

  /// Adds what of a neighbour's kernel may reach the owner's samples, as of the owner's sheet and
  /// as of another one.
  void AddKernels(const WeightedKernel& owner, const Neighbor& neighbor)
  {
    const WeightedKernel& other = this->Table[neighbor.Number].Kernel;
    const auto spacing = static_cast<float>(this->Spacing);
    const auto radius = static_cast<float>(this->Settings.SampleRadius);
    const float reach = radius + neighbor.Reach;
    const float cosine = neighbor.Cosine, sigma = other.Sigma / spacing;
    if (neighbor.Squared < reach * reach)
    {
      const auto add = [&](const WeightedKernel& kernel) {
        this->Kernels.Add(neighbor.Number, neighbor.At, kernel, spacing, sigma, this->OwnSheet());
      };
      if (std::abs(cosine) > FlattestFold)
      {
        add(other);
      }
      else
      {
        add(Unrolled(owner, other, neighbor.At, cosine));
      }
    }
    // On smooth surfaces no sample is so far off the planes of kernels.
    const float offset = this->OwnSheet().Last;
    const float flat = offset * sigma - std::abs(SingleDot(neighbor.At, other.Normal));
    if (flat > 0.0f && radius * radius * (1.0f - cosine * cosine) < flat * flat)
    {
      return;
    }
    const float farthest = static_cast<float>(this->Settings.OtherSheets) * offset;
    this->Others.Add(neighbor.Number, neighbor.At, SeenAlong(owner.Normal, other), spacing, sigma,
      { offset, farthest });
  }

  /// Share of the cover at a sample that is of other sheets. Its own sheet covers it once.
  double OverlapAt(const Float3& at)
  {
    if (this->Others.Count == 0)
    {
      return 0.0;
    }
    FindKernels(this->Others, at, static_cast<float>(this->Settings.Support), this->Values);
    double sum = 0.0;
    for (int k = 0; k < this->Others.Count; ++k)
    {
      const WeightedKernel& kernel = this->Table[this->Others.Numbers[k]].Kernel;
      sum += this->Values[k] * (static_cast<double>(kernel.Area) * kernel.Peak);
    }
    return 1.0 - 1.0 / (1.0 + sum / KernelPeak);
  }

  /// @return the number of kernels that reach the sample
  int AddEntries(const Float3& at, SampleBlock& block)
  {
    const SheetKernels& near = this->Kernels;
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
  Sheet Near;
  SamplePositions At{};
  SheetKernels Kernels;
  SheetKernels Others; // of other sheets
  Mean Overlap;        // of the owner's samples
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
  using Worker = std::pair<Sampler, SampleBlock>;
  vtkSMPThreadLocal<std::shared_ptr<Worker>> workers;
  for (vtkIdType first = 0; first < blockCount; first += stride)
  {
    const vtkIdType last = std::min(first + stride, blockCount);
    vtkSMPTools::For(first, last, 1, [&](vtkIdType b, vtkIdType end) {
      std::shared_ptr<Worker>& worker = workers.Local();
      if (!worker)
      {
        worker = std::make_shared<Worker>(Sampler(problem, tree.get()), SampleBlock());
      }
      auto& [sampler, block] = *worker;
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
