// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Orientation/OutsideDecision.h"

#include "Filters/Common/ParallelFor.h"
#include "Filters/Neighbors/LocalCloud.h"
#include "Filters/Orientation/OrientationGraph.h"
#include "Filters/Orientation/WindingNumber.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace SurfelGeometry
{
namespace
{
/// Largest share of a component's votes that may contradict its orientation.
constexpr double MaxConflict = 0.03;

/// A component is closed if the winding number at its surfels is at least Mean on average and above
/// Least at ClosedShare of the samples.
struct ClosedLimits
{
  double Mean, Least;
};

/// If a share f of a sphere is missing, the mean is (1 - f) / 2: up to a fifth may be missing. Half
/// a sphere, 0.32, is open.
constexpr ClosedLimits AnyShape{ 0.4, 0.15 };

/// The ends of a short tube reduce the mean as well: to 0.3 at a length of 1.5 diameters. But they
/// face each other, so the areas of a tube cancel: the sum of the area vectors is at most
/// MaxImbalance of that of the areas. Half a sphere has 0.5, half a tube 0.64, a sheet 1.
constexpr ClosedLimits ThinTube{ 0.2, 0.05 };

/// Largest radius of thin tubes, spacings. The wall of so thin a hole is hardly ever scanned: a
/// scanner does not look into holes that are but a few of its samples wide. Nor does it look far
/// into larger ones: a tube has the mean of AnyShape if it is three diameters long.
constexpr double ThinRadius = 8.0;

constexpr double ClosedShare = 0.85;
constexpr int WindingSamples = 192;
constexpr int MinClosedPoints = 30; // points; fewer are not enough to decide

/// Given normals and those of thin plates decide if they agree this much: |sum of cosines| / sum of
/// absolute values.
constexpr double KnownAgreement = 0.8;

/// Sums over the members of a component, piece by piece: the same at any number of threads.
/// @param add add(i, sums) adds what point i has
template <typename Sums, typename Add>
Sums SumOverMembers(const Component& component, Add&& add)
{
  std::vector<Sums> pieces(static_cast<size_t>(PieceCount(component.Count)));
  ForPieces(component.Count, [&](vtkIdType p, vtkIdType first, vtkIdType last) {
    Sums sums;
    for (vtkIdType m = first; m < last; ++m)
    {
      add(component.Ids[m], sums);
    }
    pieces[p] = sums;
  });
  Sums all;
  for (const Sums& piece : pieces)
  {
    all.Add(piece);
  }
  return all;
}

/// Radius of a patch in spacings if it is a tube, or several of them; else infinite.
double TubeRadius(const OutsideInput& input, const Component& component)
{
  const Vector3 middle = Load(input.Oriented.Cloud.Position(component.Ids[component.Count / 2]));
  struct Sums
  {
    Vector3 Vectors{}, Center{};
    double Area = 0.0;
    double Volume = 0.0; // three times the volume of the cone over the surface

    void Add(const Sums& other)
    {
      this->Vectors = this->Vectors + other.Vectors;
      this->Center = this->Center + other.Center;
      this->Area += other.Area;
      this->Volume += other.Volume;
    }
  };
  const auto [vectors, center, areas, volume] =
    SumOverMembers<Sums>(component, [&](int i, Sums& sums) {
      const double area = AreaOf(input.Oriented.Fits[i]);
      const Vector3 p = Load(input.Oriented.Cloud.Position(i)) - middle;
      const Vector3 normal = input.Oriented.Normal(i);
      sums.Add({ area * normal, area * p, area, area * Dot(p, normal) });
    });
  if (!(areas > 0.0) || Norm(vectors) > MaxImbalance * areas)
  {
    return std::numeric_limits<double>::infinity();
  }
  // About the axis of a ring each p . n is its radius; the normals of a ring cancel, so any other
  // point will do.
  const double radius = std::abs(volume - Dot(center, vectors) / areas) / areas;
  return radius / std::sqrt(areas / component.Count);
}

/// +1: closed, normals point outward. -1: closed, inward. 0: open or undecided.
int ClosedSign(const OutsideInput& input, const Component& component, const ClosedLimits& limits)
{
  const int count = component.Count;
  if (count < MinClosedPoints)
  {
    return 0;
  }
  const int samples = std::min(count, WindingSamples);
  std::vector<double> windings(samples);
  const WindingNumbers numbers(input.Oriented, component.Ids, count);
  ParallelFor(0, samples, [&](vtkIdType begin, vtkIdType end) {
    for (vtkIdType s = begin; s < end; ++s)
    {
      const int at = component.Ids[static_cast<size_t>(s) * count / samples];
      windings[s] = numbers.At(at);
    }
  });
  const double mean = std::accumulate(windings.begin(), windings.end(), 0.0) / samples;
  const double sign = mean < 0.0 ? -1.0 : 1.0;
  const auto agreeing = std::count_if(
    windings.begin(), windings.end(), [&](double w) { return sign * w > limits.Least; });
  const bool closed = std::abs(mean) >= limits.Mean && agreeing >= ClosedShare * samples;
  return closed ? static_cast<int>(sign) : 0;
}

/// +1 if enough of the area faces the viewpoint or the scanners, -1 if enough faces away; else 0.
int FacingSign(
  const OutsideInput& input, const OutsideSettings& settings, const Component& component)
{
  double toward = 0.0;
  double away = 0.0;
  for (int m = 0; m < component.Count; ++m)
  {
    const int i = component.Ids[m];
    const PlaneFit& fit = input.Oriented.Fits[i];
    double cosine = 0.0;
    if (settings.UseScanners)
    {
      cosine = input.Oriented.Flips[i] ? -settings.Facings[i] : settings.Facings[i];
    }
    else
    {
      cosine = Dot(input.Oriented.Normal(i),
        Normalized(settings.Viewpoint - Load(input.Oriented.Cloud.Position(i)), { 0.0, 0.0, 0.0 }));
    }
    const double facing = fit.Spacing * fit.Spacing * cosine;
    (facing > 0.0 ? toward : away) += std::abs(facing);
  }
  const double needed = settings.FacingAgreement * (toward + away);
  return toward > needed ? 1 : (away > needed ? -1 : 0);
}

/// +1 if the signs of a component's points with isKnown(fit) agree with those that the fits have,
/// -1 if they are opposite; else 0. `least`: how many such points decide.
template <typename Test>
int KnownSign(const OutsideInput& input, const Component& component, int least, Test&& isKnown)
{
  struct Sums
  {
    double Signed = 0.0, Absolute = 0.0;
    int Count = 0;

    void Add(const Sums& other)
    {
      this->Signed += other.Signed;
      this->Absolute += other.Absolute;
      this->Count += other.Count;
    }
  };
  const auto [sum, absolute, count] = SumOverMembers<Sums>(component, [&](int i, Sums& sums) {
    if (isKnown(input.Oriented.Fits[i]))
    {
      const double agreement = Dot(input.Oriented.Normal(i), input.Oriented.Fits[i].Normal);
      sums.Add({ agreement, std::abs(agreement), 1 });
    }
  });
  return count >= least && std::abs(sum) > KnownAgreement * absolute ? (sum > 0.0 ? 1 : -1) : 0;
}
}

OutsideSign DecidePatch(
  const OutsideInput& input, const OutsideSettings& settings, const Component& patch)
{
  const int given = KnownSign(input, patch, 1, [](const PlaneFit& fit) { return fit.SideGiven; });
  if (given != 0)
  {
    return { given, false };
  }
  int sign =
    KnownSign(input, patch, (patch.Count + 1) / 2, [](const PlaneFit& fit) { return fit.OnPlate; });
  if (sign == 0 && patch.Count >= MinClosedPoints && settings.UseScanners)
  {
    sign = FacingSign(input, settings, patch);
  }
  else if (sign == 0 && patch.Count >= MinClosedPoints)
  {
    const double radius = TubeRadius(input, patch);
    if (std::isfinite(radius) && input.Conflict(patch) <= MaxConflict)
    {
      sign = ClosedSign(input, patch, radius <= ThinRadius ? ThinTube : AnyShape);
    }
  }
  return { sign, sign != 0 };
}

OutsideSign DecideComponent(
  const OutsideInput& input, const OutsideSettings& settings, const Component& component)
{
  const OutsideSign alone = DecidePatch(input, settings, component);
  if (alone.Sign != 0 || settings.UseScanners || input.Conflict(component) > MaxConflict)
  {
    return alone;
  }
  const int sign = ClosedSign(input, component, AnyShape);
  return sign == 0 && settings.UseViewpoint
    ? OutsideSign{ FacingSign(input, settings, component), false }
    : OutsideSign{ sign, sign != 0 };
}
}
