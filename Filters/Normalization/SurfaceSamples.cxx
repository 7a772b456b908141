// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Normalization/SurfaceSamples.h"

#include "Filters/Common/AngularGap.h"
#include "Filters/Common/LocalCloud.h"
#include "Filters/Common/Multiversion.h"
#include "Filters/Common/NeighborSearch.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace SurfelGeometry
{
namespace
{
/// Near a border, the surface ends where the areas about, smoothed by a Gaussian of this many
/// spacings, cover half of the plane: at the edge of the outermost cells.
constexpr double BorderSmoothing = 1.0;
constexpr double BorderCoverage = 0.5;

/// Of the golden angle, 2.39996322972865332.
constexpr double GoldenCosine = -0.737368878078319730, GoldenSine = 0.675490294261523930;

/// The exponent of a kernel that does not reach a sample.
constexpr float Far = 1e30f;

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

/// The owner's sheet, itself first, then nearest first, field by field: what a loop takes all of.
/// Lengths from the owner and in units of its spacing. Full vectors: beyond Count, surfels that
/// are nowhere near and reach nothing.
struct Sheet
{
  static constexpr int Lanes = 16;
  static constexpr int Most = Directions::Most + Lanes; // neighbours, the owner, and full vectors

  int Count;
  int Ids[Most];
  alignas(64) float X[Most];
  alignas(64) float Y[Most];
  alignas(64) float Z[Most];
  alignas(64) float Squared[Most];
  alignas(64) float B1X[Most];
  alignas(64) float B1Y[Most];
  alignas(64) float B1Z[Most];
  alignas(64) float B2X[Most];
  alignas(64) float B2Y[Most];
  alignas(64) float B2Z[Most];
  alignas(64) float NX[Most];
  alignas(64) float NY[Most];
  alignas(64) float NZ[Most];
  alignas(64) float Climb[Most];
  float Peak[Most];

  /// @param at in units of `spacing`, world units
  void Add(int id, const Float3& at, const WeightSurfel& surfel, float spacing, float climb)
  {
    const int k = this->Count++;
    this->Ids[k] = id;
    this->X[k] = at.X;
    this->Y[k] = at.Y;
    this->Z[k] = at.Z;
    this->Squared[k] = at.X * at.X + at.Y * at.Y + at.Z * at.Z;
    this->B1X[k] = spacing * surfel.B1.X;
    this->B1Y[k] = spacing * surfel.B1.Y;
    this->B1Z[k] = spacing * surfel.B1.Z;
    this->B2X[k] = spacing * surfel.B2.X;
    this->B2Y[k] = spacing * surfel.B2.Y;
    this->B2Z[k] = spacing * surfel.B2.Z;
    this->NX[k] = surfel.Normal.X;
    this->NY[k] = surfel.Normal.Y;
    this->NZ[k] = surfel.Normal.Z;
    this->Climb[k] = climb * surfel.Sigma / spacing;
    this->Peak[k] = surfel.Peak;
  }

  /// After the last Add.
  void FillUp()
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

/// Places of some samples, in units of the owner's spacing.
struct Places
{
  static constexpr int Most = 16;

  alignas(64) float X[Most];
  alignas(64) float Y[Most];
  alignas(64) float Z[Most];
  alignas(64) int Nearer[Most]; // whether another surfel of the sheet is nearer than the owner
};

/// @param squaredReach of the places
SURFEL_MULTIVERSION void FindNearer(const Sheet& s, float squaredReach, Places& places)
{
  for (int lane = 0; lane < Places::Most; ++lane)
  {
    places.Nearer[lane] = 0;
  }
  // What is twice as far from the owner as a sample cannot be nearer to the sample.
  for (int k = 1; k < s.Count && s.Squared[k] < 4.0f * squaredReach; ++k)
  {
    const float x = 2.0f * s.X[k], y = 2.0f * s.Y[k], z = 2.0f * s.Z[k], squared = s.Squared[k];
    for (int lane = 0; lane < Places::Most; ++lane)
    {
      // |at - x|^2 < |at|^2
      const float twice = places.X[lane] * x + places.Y[lane] * y + places.Z[lane] * z;
      places.Nearer[lane] |= squared < twice ? 1 : 0;
    }
  }
}

/// Exponents |B y|^2 / 2 of the sheet's kernels at a sample; Far where it is off a kernel's plane.
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

/// Makes the samples of one surfel after the other.
class Sampler
{
public:
  Sampler(const LocalCloud& cloud, const std::vector<WeightSurfel>& surfels,
    const WeightSettings& settings, const NeighborSearch& tree)
    : Cloud(cloud)
    , Surfels(surfels)
    , Settings(settings)
    , Tree(tree)
    // Unit mass within the support.
    , KernelScale(static_cast<float>(1.0 / (1.0 - std::exp(-settings.Support))))
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
    const auto seed = static_cast<std::uint64_t>(this->Cloud.SampleId(owner));
    const double turn = 2.0 * Pi * Hash(2 * seed);
    const double shift = Hash(2 * seed + 1);
    // Vogel's disc: equal areas, golden angle.
    double cosine = std::cos(turn), sine = std::sin(turn);
    for (int first = 0; first < count; first += Places::Most)
    {
      const int last = std::min(count, first + Places::Most);
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
        if (!this->At.Nearer[lane])
        {
          const Vector3 at{ this->At.X[lane], this->At.Y[lane], this->At.Z[lane] };
          this->Add(at, weight, border, block);
        }
      }
    }
  }

private:
  void Add(const Float3& at, float weight, bool border, SampleBlock& block)
  {
    // Beyond the border the sum should be 0. Without samples there, it would be 1 up to the
    // very edge, at the price of a rim of surfels that are too heavy.
    block.Inside.push_back(
      !border || this->Coverage(at) >= BorderCoverage ? CountedSample : char{ 0 });
    this->AddEntries(at, block);
    block.Weights.push_back(weight);
    block.Ends.push_back(static_cast<int>(block.Ids.size()));
  }

  void AddToSheet(int id, const Float3& at)
  {
    this->Near.Add(id, at, this->Surfels[id], static_cast<float>(this->Spacing),
      static_cast<float>(this->Settings.NormalOffset));
  }

  /// Finds the owner's sheet around it; returns whether it may lie on a border: of 24 random
  /// neighbours inside a surface, one point in 2000 has such a gap.
  bool Gather(int owner, const Float3& u, const Float3& v)
  {
    const WeightSurfel& surfel = this->Surfels[owner];
    const Vector3 p = Load(this->Cloud.Position(owner));
    const double inverse = 1.0 / this->Spacing;
    this->Tree.FindNearest(owner, this->Settings.NumberOfNeighbors, this->Found);
    this->Near.Count = 0;
    this->Around.Clear();
    this->AddToSheet(owner, Float3());
    for (const int j : this->Found.Ids)
    {
      if (!this->Surfels[j].Usable || !AreCompatible(surfel, this->Surfels[j]))
      {
        continue;
      }
      const Float3 at = inverse * (Load(this->Cloud.Position(j)) - p);
      this->AddToSheet(j, at);
      const float x = SingleDot(at, u), y = SingleDot(at, v);
      const float climb = SingleDot(at, surfel.Normal);
      if (x * x + y * y > climb * climb)
      {
        this->Around.Add(x, y);
      }
    }
    this->Near.FillUp();
    return this->Around.HaveGap();
  }

  /// Share of the plane that the areas of the sheet cover about a place.
  double Coverage(const Float3& at) const
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

  void AddEntries(const Float3& at, SampleBlock& block)
  {
    const Sheet& s = this->Near;
    FindExponents(s, at, this->Exponents);
    const float support = static_cast<float>(this->Settings.Support);
    const std::size_t first = block.Ids.size();
    block.Ids.resize(first + s.Count);
    block.Kernels.resize(first + s.Count);
    int* ids = block.Ids.data() + first;
    float* kernels = block.Kernels.data() + first;
    // Not a branch: whether a kernel reaches a sample is hard to foretell.
    int count = 0;
    for (int k = 0; k < s.Count; ++k)
    {
      ids[count] = k;
      count += this->Exponents[k] < support ? 1 : 0;
    }
    for (int e = 0; e < count; ++e)
    {
      const int k = ids[e];
      ids[e] = s.Ids[k];
      kernels[e] = this->KernelScale * s.Peak[k] * std::exp(-this->Exponents[k]);
    }
    block.Ids.resize(first + count);
    block.Kernels.resize(first + count);
  }

  const LocalCloud& Cloud;
  const std::vector<WeightSurfel>& Surfels;
  const WeightSettings& Settings;
  const NeighborSearch& Tree;
  float KernelScale;
  double Spacing = 1.0; // of the owner
  Neighbors Found;
  Sheet Near;
  Places At{};
  alignas(64) float Exponents[Sheet::Most];
  Directions Around;
};
}

bool MakeSamples(const LocalCloud& cloud, const std::vector<WeightSurfel>& surfels,
  const WeightSettings& settings, const WeightSharing* sharing, const StageProgress& monitor,
  std::vector<SampleBlock>& blocks)
{
  const NeighborSearch tree(cloud.Positions.data(), cloud.Size());
  const vtkIdType count = cloud.Size();
  blocks.resize((count + SampleBlockSize - 1) / SampleBlockSize);
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
        for (vtkIdType i = b * SampleBlockSize; i < std::min(count, (b + 1) * SampleBlockSize); ++i)
        {
          const std::size_t before = block.Count();
          sampler.Sample(static_cast<int>(i), block);
          if (sharing && !sharing->Mine[static_cast<std::size_t>(i)])
          {
            std::replace(block.Inside.begin() + static_cast<std::ptrdiff_t>(before),
              block.Inside.end(), CountedSample, GuestSample);
          }
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
}
