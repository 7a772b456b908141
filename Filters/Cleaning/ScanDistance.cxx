// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Cleaning/ScanDistance.h"

#include "Filters/Cleaning/CleaningProblem.h"
#include "Filters/Cleaning/LocalQuadric.h"
#include "Filters/Common/ParallelFor.h"
#include "Filters/Neighbors/NeighborSearch.h"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <utility>

namespace SurfelGeometry
{
namespace
{
/// Neighbours among which points of the first scan are looked for, and how many a fit needs.
constexpr int WidestNeighbors = 160;
constexpr int LeastOfScan = 24;

/// Standard deviation of the Gaussian that weighs the shades, spacings: as wide as two scans are
/// apart.
constexpr double ShadeWidth = 1.5;

constexpr size_t DistanceSize = sizeof(ScanDistance) / sizeof(float);
static_assert(sizeof(ScanDistance) == DistanceSize * sizeof(float));

/// The mean of the three channels.
float ShadeOf(const SampledColors& colors, int i)
{
  const Vector3 color = colors.Get(i);
  return static_cast<float>((color[0] + color[1] + color[2]) / 3.0);
}

/// Keeps the neighbours that are in the first scan.
void KeepFirst(const LocalCloud& cloud, vtkIdType first, Neighbors& neighbors)
{
  size_t kept = 0;
  for (size_t k = 0; k < neighbors.Ids.size(); ++k)
  {
    if (cloud.SampleId(neighbors.Ids[k]) < first)
    {
      neighbors.Ids[kept] = neighbors.Ids[k];
      neighbors.SquaredDistances[kept++] = neighbors.SquaredDistances[k];
    }
  }
  neighbors.Ids.resize(kept);
  neighbors.SquaredDistances.resize(kept);
}
}

Vector3 ScanMotion::ShiftOf(const Vector3& place) const
{
  const Vector3 arm = place - this->Center;
  Vector3 shift = this->Shift;
  for (int r = 0; r < 3; ++r)
  {
    shift[r] += Dot(this->Rotation[r], arm) - arm[r];
  }
  return shift;
}

/// The quadric through the first scan about a sample, and its shades.
struct ScanFits::Fit
{
  Vector3 Place; // of the sample, where all processes have it
  double Spacing;
  LocalQuadric Surface;
  float Shade = 0.0f;        // of the sample
  std::vector<float> Shades; // [neighbours] or empty: unknown

  /// Returns false if there is too little of the first scan.
  bool Make(const CleaningProblem& problem, const SampledColors& colors, int i, vtkIdType first,
    Neighbors& neighbors)
  {
    problem.Searched.Tree->FindNearest(i, WidestNeighbors, neighbors);
    KeepFirst(problem.Cloud(), first, neighbors);
    if (neighbors.Count() < LeastOfScan)
    {
      return false;
    }
    this->Place = problem.SharedPosition(i);
    this->Spacing = SpacingOf(neighbors);
    this->Surface.FitOthers(problem.Cloud(), i, neighbors);
    if (colors.Array)
    {
      this->Shade = ShadeOf(colors, i);
      for (const int id : neighbors.Ids)
      {
        this->Shades.push_back(ShadeOf(colors, id));
      }
    }
    return this->Surface.IsValid();
  }

  ScanDistance From(const ScanMotion& motion) const
  {
    const Vector3 shift = motion.ShiftOf(this->Place);
    const SurfaceFoot foot = this->Surface.FootOf(shift);
    ScanDistance distance{};
    Store(this->Place + shift, distance.Place);
    Store(foot.Normal, distance.Normal);
    distance.Height = static_cast<float>(foot.Height);
    distance.Spacing = static_cast<float>(this->Spacing);
    if (!this->Shades.empty())
    {
      const LocalShade there =
        this->Surface.ShadeAt(shift, this->Shades, ShadeWidth * this->Spacing);
      Store(there.Gradient, distance.Gradient);
      distance.Shade = static_cast<float>(this->Shade - there.Value);
    }
    return distance;
  }
};

ScanFits::ScanFits(const CleaningProblem& problem, const SampledColors& colors,
  const std::vector<int>& samples, vtkIdType first, bool ofSecond)
  : Problem(problem)
{
  std::vector<int> wanted;
  for (const int i : samples)
  {
    if ((problem.Cloud().SampleId(i) >= first) == ofSecond)
    {
      wanted.push_back(i);
    }
  }
  this->Fits.resize(wanted.size());
  std::vector<char> valid(wanted.size(), 0);
  ParallelFor(0, static_cast<vtkIdType>(wanted.size()), [&](vtkIdType k, vtkIdType end) {
    Neighbors neighbors;
    for (; k < end; ++k)
    {
      valid[k] = this->Fits[k].Make(problem, colors, wanted[k], first, neighbors) ? 1 : 0;
    }
  });
  size_t kept = 0;
  for (size_t k = 0; k < this->Fits.size(); ++k)
  {
    if (valid[k])
    {
      std::swap(this->Fits[kept++], this->Fits[k]);
    }
  }
  this->Fits.resize(kept);
}

ScanFits::~ScanFits() = default;

bool ScanFits::Measure(
  bool running, const ScanMotion& motion, std::vector<ScanDistance>& distances) const
{
  distances.resize(this->Fits.size());
  ParallelFor(0, static_cast<vtkIdType>(distances.size()), [&](vtkIdType k, vtkIdType end) {
    for (; k < end; ++k)
    {
      distances[k] = this->Fits[k].From(motion);
    }
  });
  std::vector<float> values(DistanceSize * distances.size());
  std::memcpy(values.data(), distances.data(), values.size() * sizeof(float));
  if (!this->Problem.Gather(running, values))
  {
    return false;
  }
  distances.resize(values.size() / DistanceSize);
  std::memcpy(distances.data(), values.data(), values.size() * sizeof(float));
  std::sort(distances.begin(), distances.end(), [](const ScanDistance& a, const ScanDistance& b) {
    return std::lexicographical_compare(a.Place, a.Place + 3, b.Place, b.Place + 3);
  });
  return true;
}
}
