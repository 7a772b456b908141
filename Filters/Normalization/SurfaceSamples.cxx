// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Normalization/SurfaceSamples.h"

#include "Filters/Common/AngularGap.h"
#include "Filters/Common/Hash.h"
#include "Filters/Common/LocalCloud.h"
#include "Filters/Common/Median.h"
#include "Filters/Common/Multiversion.h"
#include "Filters/Common/NeighborSearch.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace SurfelGeometry
{
namespace
{
/// Near a border, the surface ends where the surrounding areas, smoothed by a Gaussian of this many
/// spacings, cover half of the plane: at the edge of the outermost cells.
constexpr double BorderSmoothing = 1.0;
constexpr double BorderCoverage = 0.5;

/// A surfel with no others on one side is beside a step of density, not on a border, if its area is
/// this many times the median of its neighbours': at a border, cells end. The first sparse surfels
/// beyond are not among its nearest ones.
constexpr float StepOfAreas = 8.0f;

/// Cosine and sine of the golden angle, 2.39996322972865332.
constexpr double GoldenCosine = -0.737368878078319730, GoldenSine = 0.675490294261523930;

/// The exponent of a kernel that does not reach a sample.
constexpr float Far = 1e30f;

/// Whether two surfels can be on the same sheet of surface.
bool AreCompatible(const WeightedKernel& a, const WeightedKernel& b)
{
  return (a.TwoSided == b.TwoSided) && (a.TwoSided || Dot(a.Normal, b.Normal) > 0.0);
}

/// The owner and its neighbours on the same sheet, as a structure of arrays for SIMD
/// loops. Positions relative to the owner, lengths in units of its spacing. Beyond Count the arrays
/// are padded to full vectors with kernels that reach nothing.
struct Sheet
{
  static constexpr int Lanes = 16;
  static constexpr int Capacity = Directions::Capacity + Lanes; // neighbours, the owner and padding

  int Count;
  int Ids[Capacity];
  unsigned char Ranks[Capacity]; // see SampleBlock
  alignas(64) float X[Capacity];
  alignas(64) float Y[Capacity];
  alignas(64) float Z[Capacity];
  alignas(64) float Squared[Capacity];
  alignas(64) float B1X[Capacity];
  alignas(64) float B1Y[Capacity];
  alignas(64) float B1Z[Capacity];
  alignas(64) float B2X[Capacity];
  alignas(64) float B2Y[Capacity];
  alignas(64) float B2Z[Capacity];
  alignas(64) float NX[Capacity];
  alignas(64) float NY[Capacity];
  alignas(64) float NZ[Capacity];
  alignas(64) float Climb[Capacity];

  /// @param at in units of `spacing`, which is in world units
  void Add(
    int id, int rank, const Float3& at, const WeightedKernel& kernel, float spacing, float climb)
  {
    const int k = this->Count++;
    this->Ids[k] = id;
    this->Ranks[k] = static_cast<unsigned char>(rank);
    this->X[k] = at.X;
    this->Y[k] = at.Y;
    this->Z[k] = at.Z;
    this->Squared[k] = at.X * at.X + at.Y * at.Y + at.Z * at.Z;
    this->B1X[k] = spacing * kernel.B1.X;
    this->B1Y[k] = spacing * kernel.B1.Y;
    this->B1Z[k] = spacing * kernel.B1.Z;
    this->B2X[k] = spacing * kernel.B2.X;
    this->B2Y[k] = spacing * kernel.B2.Y;
    this->B2Z[k] = spacing * kernel.B2.Z;
    this->NX[k] = kernel.Normal.X;
    this->NY[k] = kernel.Normal.Y;
    this->NZ[k] = kernel.Normal.Z;
    this->Climb[k] = climb * kernel.Sigma / spacing;
  }

  /// Pads to full vectors; call after the last Add.
  void Pad()
  {
    for (int k = this->Count; k % Lanes != 0; ++k)
    {
      this->X[k] = this->Y[k] = this->Z[k] = this->Squared[k] = 0.0f;
      this->B1X[k] = this->B1Y[k] = this->B1Z[k] = 0.0f;
      this->B2X[k] = this->B2Y[k] = this->B2Z[k] = 0.0f;
      this->NX[k] = this->NY[k] = this->NZ[k] = this->Climb[k] = 0.0f;
    }
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

/// Exponents |B y|^2 / 2 of the sheet's kernels at a sample; Far if it is too far off a kernel's
/// plane.
SURFEL_MULTIVERSION void FindExponents(
  const Sheet& s, const Float3& at, float* __restrict exponents)
{
  for (int first = 0; first < s.Count; first += Sheet::Lanes)
  {
    for (int lane = 0; lane < Sheet::Lanes; ++lane)
    {
      const int k = first + lane;
      const float x = at.X - s.X[k], y = at.Y - s.Y[k], z = at.Z - s.Z[k];
      const float b1 = s.B1X[k] * x + s.B1Y[k] * y + s.B1Z[k] * z;
      const float b2 = s.B2X[k] * x + s.B2Y[k] * y + s.B2Z[k] * z;
      const float climb = s.NX[k] * x + s.NY[k] * y + s.NZ[k] * z;
      const float q = 0.5f * (b1 * b1 + b2 * b2);
      exponents[k] = climb * climb < s.Climb[k] * s.Climb[k] ? q : Far;
    }
  }
}

/// Number of ranks up to the last one of the entries from `first` on.
unsigned char ReachedSince(std::size_t first, const SampleBlock& block)
{
  int reached = 0;
  for (std::size_t e = first; e < block.Ranks.size(); ++e)
  {
    reached = std::max(reached, block.Ranks[e] + 1);
  }
  return static_cast<unsigned char>(reached);
}

/// Makes the samples of one surfel after another.
class Sampler
{
public:
  Sampler(const WeightProblem& problem, const NeighborRows& rows)
    : Cloud(problem.Cloud)
    , Kernels(problem.Kernels)
    , Settings(problem.Settings)
    , Rows(rows)
  {
  }

  void Sample(int owner, SampleBlock& block)
  {
    const WeightedKernel& kernel = this->Kernels[owner];
    if (!kernel.Usable)
    {
      return;
    }
    Vector3 u, v;
    TangentFrame(kernel.Normal, u, v);
    this->Spacing = std::sqrt(kernel.Area);
    const bool border = this->Gather(owner, u, v);
    const double radius = this->Settings.SampleRadius;
    const int count = this->Settings.SamplesPerPoint;
    const float weight = static_cast<float>(Pi * radius * radius * kernel.Area / count);
    // Seeded by the input's id, so that the samples do not depend on where the cloud lies.
    const auto seed = static_cast<std::uint64_t>(this->Cloud.SampleId(owner));
    const double turn = 2.0 * Pi * Hash(2 * seed);
    const double shift = Hash(2 * seed + 1);
    // Vogel's spiral: equal areas, golden angle.
    double cosine = std::cos(turn), sine = std::sin(turn);
    for (int first = 0; first < count; first += SamplePositions::Capacity)
    {
      const int last = std::min(count, first + SamplePositions::Capacity);
      for (int s = first; s < last; ++s)
      {
        const double r = radius * std::sqrt((s + shift) / count);
        const Float3 at = (r * cosine) * u + (r * sine) * v;
        const double turned = cosine * GoldenCosine - sine * GoldenSine;
        sine = sine * GoldenCosine + cosine * GoldenSine;
        cosine = turned;
        this->At.X[s - first] = at.X;
        this->At.Y[s - first] = at.Y;
        this->At.Z[s - first] = at.Z;
      }
      const double reach = radius * radius * (last - 1 + shift) / count;
      FindNearer(this->Near, static_cast<float>(reach), this->At);
      for (int lane = 0; lane < last - first; ++lane)
      {
        const Vector3 at{ this->At.X[lane], this->At.Y[lane], this->At.Z[lane] };
        if (!this->At.Nearer[lane] && Dot(at, at) < this->Known)
        {
          this->Add(at, weight, border, block);
        }
      }
    }
  }

private:
  void Add(const Float3& at, float weight, bool border, SampleBlock& block)
  {
    // Beyond the border the wanted sum is 0. Without samples there, the sum would be 1 up to the
    // very edge, and the surfels of the rim would be too heavy.
    block.Inside.push_back(
      !border || this->Coverage(at) >= BorderCoverage ? CountedSample : char{ 0 });
    this->AddEntries(at, block);
    block.Weights.push_back(weight);
    block.Ends.push_back(static_cast<int>(block.Ranks.size()));
  }

  void AddToSheet(int id, int rank, const Float3& at)
  {
    this->Near.Add(id, rank, at, this->Kernels[id], static_cast<float>(this->Spacing),
      static_cast<float>(this->Settings.NormalOffset));
  }

  /// Finds the owner's sheet. Returns whether the owner may lie on a border: with 24 random
  /// neighbours, one point in 2000 inside a surface has such a gap.
  bool Gather(int owner, const Float3& u, const Float3& v)
  {
    const WeightedKernel& kernel = this->Kernels[owner];
    const Vector3 p = Load(this->Cloud.Position(owner));
    const double inverse = 1.0 / this->Spacing;
    this->Near.Count = 0;
    this->Around.Clear();
    this->AddToSheet(owner, 0, Float3());
    const int* row = this->Rows.Row(owner);
    for (int k = 0; k < this->Rows.Used && row[k] >= 0; ++k)
    {
      const int j = row[k];
      if (!this->Kernels[j].Usable || !AreCompatible(kernel, this->Kernels[j]))
      {
        continue;
      }
      const Float3 at = inverse * (Load(this->Cloud.Position(j)) - p);
      this->AddToSheet(j, k + 1, at);
      const float x = SingleDot(at, u), y = SingleDot(at, v);
      const float climb = SingleDot(at, kernel.Normal);
      if (x * x + y * y > climb * climb)
      {
        this->Around.Add(x, y);
      }
    }
    this->Near.Pad();
    this->Known = Far;
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
      this->Areas.push_back(this->Kernels[this->Near.Ids[k]].Area);
    }
    return Median(this->Areas);
  }

  /// Share of the plane around a position that the areas of the sheet cover.
  double Coverage(const Float3& at) const
  {
    const Sheet& s = this->Near;
    constexpr double variance = BorderSmoothing * BorderSmoothing;
    double sum = 0.0;
    for (int k = 0; k < s.Count; ++k)
    {
      const double x = at.X - s.X[k], y = at.Y - s.Y[k], z = at.Z - s.Z[k];
      sum += this->Kernels[s.Ids[k]].Area * std::exp(-0.5 * (x * x + y * y + z * z) / variance);
    }
    return sum / (2.0 * Pi * variance * this->Spacing * this->Spacing);
  }

  void AddEntries(const Float3& at, SampleBlock& block)
  {
    const Sheet& s = this->Near;
    FindExponents(s, at, this->Exponents);
    const float support = static_cast<float>(this->Settings.Support);
    // Branch-free: whether a kernel reaches a sample is hard to predict.
    int reaching[Sheet::Capacity];
    int count = 0;
    for (int k = 0; k < s.Count; ++k)
    {
      reaching[count] = k;
      count += this->Exponents[k] < support ? 1 : 0;
    }
    const std::size_t first = block.Ranks.size();
    block.Ranks.resize(first + count);
    block.Kernels.resize(first + count);
    for (int e = 0; e < count; ++e)
    {
      const int k = reaching[e];
      block.Ranks[first + e] = s.Ranks[k];
      block.Kernels[first + e] =
        static_cast<std::uint16_t>(SampleBlock::Peak * std::exp(-this->Exponents[k]) + 0.5f);
    }
  }

  const LocalCloud& Cloud;
  const std::vector<WeightedKernel>& Kernels;
  const WeightSettings& Settings;
  const NeighborRows& Rows;
  double Spacing = 1.0; // the owner's
  Sheet Near;
  SamplePositions At{};
  alignas(64) float Exponents[Sheet::Capacity];
  Directions Around;
  float Known = Far; // squared distance up to which all surfels are in the sheet; see Spacing
  std::vector<float> Areas; // scratch
};
}

bool FindRows(const WeightProblem& problem, const StageProgress& progress, std::vector<int>& ids)
{
  const LocalCloud& cloud = problem.Cloud;
  const int width = problem.Settings.NumberOfNeighbors;
  const NeighborSearch tree(cloud.Positions.data(), cloud.Size());
  ids.resize(width * static_cast<std::size_t>(cloud.Size()));
  return ParallelFor(cloud.Size(), progress, [&](vtkIdType begin, vtkIdType end) {
    Neighbors found;
    for (vtkIdType i = begin; i < end; ++i)
    {
      tree.FindNearest(static_cast<int>(i), width, found);
      found.Ids.resize(width, -1);
      std::copy(found.Ids.begin(), found.Ids.end(), ids.begin() + width * i);
    }
  });
}

bool MakeSamples(const WeightProblem& problem, const NeighborRows& rows,
  const StageProgress& progress, std::vector<SampleBlock>& blocks)
{
  const LocalCloud& cloud = problem.Cloud;
  const WeightSharing* sharing = problem.Sharing;
  const vtkIdType count = cloud.Size();
  blocks.resize((count + SampleBlockSize - 1) / SampleBlockSize);
  const vtkIdType blockCount = static_cast<vtkIdType>(blocks.size());
  constexpr vtkIdType stride = 32; // blocks between two checks for an abort
  for (vtkIdType first = 0; first < blockCount; first += stride)
  {
    const vtkIdType last = std::min(first + stride, blockCount);
    vtkSMPTools::For(first, last, 1, [&](vtkIdType begin, vtkIdType end) {
      Sampler sampler(problem, rows);
      SampleBlock block;
      for (vtkIdType b = begin; b < end; ++b)
      {
        block.Clear();
        for (vtkIdType i = b * SampleBlockSize; i < std::min(count, (b + 1) * SampleBlockSize); ++i)
        {
          const std::size_t before = block.Count(), entries = block.Ranks.size();
          sampler.Sample(static_cast<int>(i), block);
          if (sharing && !sharing->IsOwn[static_cast<std::size_t>(i)])
          {
            std::replace(block.Inside.begin() + static_cast<std::ptrdiff_t>(before),
              block.Inside.end(), CountedSample, HaloSample);
          }
          block.Owned.push_back(static_cast<int>(block.Count()));
          block.Reached.push_back(ReachedSince(entries, block));
        }
        blocks[b] = block; // the copy has no spare capacity
      }
    });
    if (!progress.Step(static_cast<double>(last) / blockCount))
    {
      return false;
    }
  }
  return true;
}
}
