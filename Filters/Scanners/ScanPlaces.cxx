// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Scanners/ScanPlaces.h"

#include "Filters/Common/Hash.h"
#include "Filters/Common/ParallelFor.h"
#include "Filters/Scanners/ScanPhase.h"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

namespace SurfelGeometry
{
namespace
{
using Eigen::Matrix3d;
using Eigen::Vector3d;

/// A place is sought where the lines of two jumps meet: so many pairs at a time, and more if none
/// of them tells. A pair is no farther apart than a part of all jumps, so that one scanner has seen
/// both, and so are the jumps that judge where it meets: a few, and more if some agree.
constexpr int PairsAtATime = 1500, MostTimes = 2;
constexpr std::size_t NearPart = 8, LeastNear = 256;
constexpr std::size_t FewJumps = 16, MoreJumps = 64, ManyJumps = 256;
constexpr std::size_t PlacesToRefine = 4;

/// Steps are alike if they are off by less than such a part of a step: at first, and while a
/// place is sought.
constexpr double FarSteps = 8.0, LooseSteps = 2.0;

/// The phase of multiples is that of so many jumps, within a part of the size of most points.
constexpr std::size_t JumpsOfPhase = 128;
constexpr double ReachOfPhase = 0.05;

/// A place is one if so many jumps agree with it, a part of those that nearly do: beside edges
/// points are missing. (Shuffled scans, grids of heights and lattices have no such place. Of places
/// that are none, in the plane of the ground, up to a fifth are multiples.) The lines of these must
/// meet in a point: the least eigenvalue of the mean of I - d d^T, of directions d.
struct Enough
{
  int Jumps;
  double Part;
};
constexpr Enough OfAlike{ 16, 0.3 }, OfFewAlike{ 10, 0.8 }, OfMultiples{ 20, 0.5 };
constexpr int LeastJumps = OfFewAlike.Jumps;
constexpr double LeastPlaceSpread = 0.005;

/// It is not farther from the points than so many times their size.
constexpr double FarthestPlace = 2.0;

/// Places are one if they are nearer than this part of the size of most points.
constexpr double SameScannerPlace = 0.01;

constexpr int MostScanners = 256;

/// Where lines meet, by least squares.
class Meeting
{
public:
  void Add(const ScanWindow& window, double weight)
  {
    const Vector3d d = (window.Behind() - window.Before()).normalized();
    const Matrix3d across = weight * (Matrix3d::Identity() - d * d.transpose());
    this->Across += across;
    this->Sum += across * window.Before();
    this->Weight += weight;
  }
  double Spread() const
  {
    return this->Weight > 0.0
      ? Eigen::SelfAdjointEigenSolver<Matrix3d>(this->Across, Eigen::EigenvaluesOnly)
          .eigenvalues()[0] /
        this->Weight
      : 0.0;
  }
  Vector3d Place() const { return this->Across.ldlt().solve(this->Sum); }

private:
  Matrix3d Across = Matrix3d::Zero();
  Vector3d Sum = Vector3d::Zero();
  double Weight = 0.0;
};

using Windows = std::vector<const ScanWindow*>;

/// Every so many of them.
Windows Some(const Windows& windows, std::size_t count)
{
  Windows some;
  const std::size_t most = std::min(count, windows.size());
  for (std::size_t i = 0; i < most; ++i)
  {
    some.push_back(windows[i * windows.size() / most]);
  }
  return some;
}

struct Candidate
{
  int Agreeing = 0;
  Vector3d Place = Vector3d::Zero();
  Steps Are = Steps::Alike;
};

/// The jumps about one of them.
Windows Near(const Windows& jumps, std::size_t middle)
{
  const std::size_t reach = std::max(jumps.size() / NearPart, LeastNear) / 2;
  const std::size_t begin = middle - std::min(middle, reach);
  return { jumps.begin() + static_cast<std::ptrdiff_t>(begin),
    jumps.begin() + static_cast<std::ptrdiff_t>(std::min(middle + reach, jumps.size())) };
}

/// Whether a place is as far from both ends of a jump as the steps beside it say.
bool IsAtRatio(const Vector3d& place, const ScanWindow& jump)
{
  const Vector3d before = jump.Before() - place, behind = jump.Behind() - place;
  constexpr double most = 5.0;
  const double ratio = behind.norm() / (before.norm() * jump.Ratio);
  return before.dot(behind) > 0.0 && ratio < most && ratio * most > 1.0;
}

/// Number of jumps that may be seen from a place.
int CountLikely(const Vector3d& place, const Windows& jumps)
{
  return static_cast<int>(std::count_if(jumps.begin(), jumps.end(), [&](const ScanWindow* w) {
    return IsAtRatio(place, *w) && SeenFrom(place, *w, Steps::Aligned).Agree(LooseSteps);
  }));
}

/// Where the lines of two jumps meet.
Candidate TryPair(const Windows& jumps, double size, std::uint64_t pair)
{
  const auto pick = [](const Windows& from, std::uint64_t id) {
    return static_cast<std::size_t>(Hash(id) * static_cast<double>(from.size()));
  };
  const std::size_t first = pick(jumps, 2 * pair);
  const Windows near = Near(jumps, first);
  const ScanWindow& second = *near[pick(near, 2 * pair + 1)];
  Meeting meeting;
  meeting.Add(*jumps[first], 1.0);
  meeting.Add(second, 1.0);
  constexpr double least = 0.005; // lines that are parallel within 11 degrees
  if (!(meeting.Spread() > least))
  {
    return {};
  }
  Candidate found;
  found.Place = meeting.Place();
  const double distance = (found.Place - jumps[first]->Before()).norm();
  if (!(distance < (FarthestPlace + 1.0) * size) || !IsAtRatio(found.Place, *jumps[first]) ||
    !IsAtRatio(found.Place, second))
  {
    return {};
  }
  // Without the pair itself, which mostly is not among the few.
  if (CountLikely(found.Place, Some(near, FewJumps)) > 0 &&
    CountLikely(found.Place, Some(near, MoreJumps)) > 1)
  {
    found.Agreeing = CountLikely(found.Place, Some(near, ManyJumps));
  }
  return found;
}

/// The sum over jumps of a step of Gauss and Newton's method that makes them steps like others.
struct NormalEquations
{
  Matrix3d Products = Matrix3d::Zero();
  Vector3d Residuals = Vector3d::Zero();

  /// @param size of the differences from which derivatives are taken
  void Add(const Vector3d& place, const ScanWindow& window, Steps are, double size)
  {
    const Vector3d off = SeenFrom(place, window, are).MiddleOff;
    Matrix3d slopes;
    for (int c = 0; c < 3; ++c)
    {
      const Vector3d moved = place + size * Vector3d::Unit(c);
      slopes.col(c) = (SeenFrom(moved, window, are).MiddleOff - off) / size;
    }
    const double weight = 1.0 / (1.0 + off.squaredNorm() / (TightSteps * TightSteps));
    this->Products += weight * slopes.transpose() * slopes;
    this->Residuals += weight * slopes.transpose() * off;
  }
};

/// The jumps that are off a place by less than a part of a step.
Windows Agreeing(const Vector3d& place, const Windows& jumps, Steps are, double part)
{
  Windows agreeing;
  std::copy_if(jumps.begin(), jumps.end(), std::back_inserter(agreeing),
    [&](const ScanWindow* w) { return SeenFrom(place, *w, are).Agree(part); });
  return agreeing;
}

/// Moves a place to where the jumps that agree with it are most alike the steps beside them.
Vector3d Refine(Vector3d place, const Windows& jumps, Steps are)
{
  constexpr double parts[] = { FarSteps, FarSteps, 4.0, 4.0, 2.0, 2.0, 1.0, 1.0, TightSteps,
    TightSteps };
  for (const double part : parts)
  {
    if (are == Steps::Multiples && part > 1.0)
    {
      continue; // most of the steps are that near a multiple
    }
    const Windows agreeing =
      Agreeing(place, Some(jumps, part > 1.0 ? ManyJumps : 4 * ManyJumps), are, part);
    if (agreeing.size() < LeastJumps / 2)
    {
      break;
    }
    double nearest = std::numeric_limits<double>::infinity();
    for (const ScanWindow* window : agreeing)
    {
      nearest = std::min(nearest, (window->Before() - place).norm());
    }
    NormalEquations equations;
    for (const ScanWindow* window : Some(agreeing, part > 1.0 ? MoreJumps : 2 * ManyJumps))
    {
      equations.Add(place, *window, are, 1e-6 * nearest);
    }
    const Vector3d step = equations.Products.ldlt().solve(equations.Residuals);
    if (!step.allFinite())
    {
      break;
    }
    place -= step * std::min(1.0, 0.3 * nearest / std::max(step.norm(), 1e-300));
  }
  return place;
}

/// The jumps that agree with a place.
class PlaceAgreement
{
public:
  void Add(const Vector3d& place, const ScanWindow& window, Steps are)
  {
    const SeenSteps seen = SeenFrom(place, window, are);
    const bool isLoose = are == Steps::Multiples
      ? SeenFrom(place, window, Steps::Aligned).Agree(LooseSteps)
      : seen.Agree(LooseSteps);
    if (isLoose)
    {
      ++this->Loose;
      if (seen.Agree(TightSteps))
      {
        ++this->Tight;
        this->Lines.Add(window, 1.0);
        this->Nearest = std::min(this->Nearest, (window.Before() - place).norm());
      }
    }
  }
  bool IsOfScanner(Steps are, double size) const
  {
    const Enough enough = are == Steps::Multiples ? OfMultiples
      : this->Tight < OfAlike.Jumps               ? OfFewAlike
                                                  : OfAlike;
    return this->Tight >= enough.Jumps && this->Tight > enough.Part * this->Loose &&
      this->Lines.Spread() > LeastPlaceSpread && this->Nearest < FarthestPlace * size;
  }
  int Tight = 0;

private:
  Meeting Lines;
  int Loose = 0;
  double Nearest = std::numeric_limits<double>::infinity();
};

/// Number of jumps that agree with a place; 0 if they are too few for a scanner.
int CountIfScanner(const Vector3d& place, const Windows& jumps, Steps are, double size)
{
  PlaceAgreement agreement;
  for (const ScanWindow* window : jumps)
  {
    agreement.Add(place, *window, are);
  }
  return agreement.IsOfScanner(are, size) ? agreement.Tight : 0;
}

/// A place moved along an axis to where jumps are multiples, and refined.
Candidate MoveAlong(
  Vector3d place, const Windows& jumps, const Windows& about, double size, int axis)
{
  Candidate moved;
  if (FindPhase(Some(about, JumpsOfPhase), axis, ReachOfPhase * size, place))
  {
    moved.Are = Steps::Multiples;
    moved.Place = Refine(place, about, Steps::Multiples);
    moved.Agreeing = CountIfScanner(moved.Place, jumps, Steps::Multiples, size);
  }
  return moved;
}

/// A place refined, with the steps of its scanner.
Candidate Judge(const Vector3d& place, const Windows& jumps, double size)
{
  const Windows about = Agreeing(place, jumps, Steps::Aligned, FarSteps);
  Candidate refined;
  refined.Place = Refine(place, about, Steps::Alike);
  refined.Agreeing = CountIfScanner(refined.Place, jumps, Steps::Alike, size);
  return refined.Agreeing > 0
    ? refined
    : MoveAlong(Refine(place, about, Steps::Aligned), jumps, about, size, 0);
}

/// A place of multiples from which more of the jumps are: phases have several maxima.
Candidate Improve(const Candidate& place, const Windows& jumps, double size)
{
  const Windows about = Agreeing(place.Place, jumps, Steps::Aligned, FarSteps);
  const auto loose =
    static_cast<double>(Agreeing(place.Place, jumps, Steps::Aligned, LooseSteps).size());
  Candidate best = place, moved = place;
  for (const int axis : { 1, 2, 0, 1, 2, 0 })
  {
    constexpr double nearlyAll = 0.9;
    if (best.Agreeing > nearlyAll * loose)
    {
      break;
    }
    moved = MoveAlong(moved.Place, jumps, about, size, axis);
    if (moved.Agreeing == 0)
    {
      moved = best;
    }
    else if (moved.Agreeing > best.Agreeing)
    {
      best = moved;
    }
  }
  return best;
}

/// The best candidates, none beside another, nor beside one that was tried before.
std::vector<Candidate> BestOf(
  std::vector<Candidate>& candidates, double size, std::vector<Vector3d>& tried)
{
  std::stable_sort(candidates.begin(), candidates.end(),
    [](const Candidate& a, const Candidate& b) { return a.Agreeing > b.Agreeing; });
  std::vector<Candidate> best;
  for (const Candidate& candidate : candidates)
  {
    const bool isNew = std::none_of(tried.begin(), tried.end(), [&](const Vector3d& other) {
      return (candidate.Place - other).norm() <
        SameScannerPlace * size; // they are refined to the same
    });
    if (candidate.Agreeing > 0 && isNew && best.size() < PlacesToRefine)
    {
      best.push_back(candidate);
      tried.push_back(candidate.Place);
    }
  }
  return best;
}

/// The place with which most of the jumps agree, of some pairs; false if there is none.
bool TryPairs(
  const Windows& jumps, double size, int time, std::vector<Vector3d>& tried, Candidate& place)
{
  std::vector<Candidate> candidates(PairsAtATime);
  ParallelFor(0, PairsAtATime, 16, [&](vtkIdType begin, vtkIdType end) {
    for (vtkIdType i = begin; i < end; ++i)
    {
      candidates[i] = TryPair(jumps, size, static_cast<std::uint64_t>(time * PairsAtATime + i));
    }
  });
  std::vector<Candidate> best = BestOf(candidates, size, tried);
  ParallelFor(0, static_cast<vtkIdType>(best.size()), 1, [&](vtkIdType begin, vtkIdType end) {
    for (vtkIdType i = begin; i < end; ++i)
    {
      best[i] = Judge(best[i].Place, jumps, size);
    }
  });
  const auto most = std::max_element(best.begin(), best.end(),
    [](const Candidate& a, const Candidate& b) { return a.Agreeing < b.Agreeing; });
  if (most == best.end() || most->Agreeing == 0)
  {
    return false;
  }
  place = most->Are == Steps::Multiples ? Improve(*most, jumps, size) : *most;
  return true;
}

bool FindPlace(const Windows& jumps, double size, Candidate& place)
{
  bool found = false;
  std::vector<Vector3d> tried;
  for (int time = 0; time < MostTimes && jumps.size() >= LeastJumps && !found; ++time)
  {
    found = TryPairs(jumps, size, time, tried, place);
  }
  return found;
}
}

std::vector<ScanPlace> FindPlaces(const std::vector<ScanWindow>& windows, double size)
{
  std::vector<ScanPlace> places;
  Windows jumps;
  for (const ScanWindow& window : windows)
  {
    if (window.Jumps)
    {
      jumps.push_back(&window);
    }
  }
  Candidate place;
  for (int i = 0; i < MostScanners && FindPlace(jumps, size, place); ++i)
  {
    // What is left of a scan may tell its place once more, less exactly.
    const bool isNew = std::none_of(places.begin(), places.end(), [&](const ScanPlace& other) {
      return (place.Place - other.Place).norm() < SameScannerPlace * size;
    });
    if (isNew)
    {
      places.push_back({ place.Place, place.Are });
    }
    jumps.erase(std::remove_if(jumps.begin(), jumps.end(),
                  [&](const ScanWindow* w) {
                    return SeenFrom(place.Place, *w, place.Are).Agree(LooseSteps);
                  }),
      jumps.end());
  }
  return places;
}
}
