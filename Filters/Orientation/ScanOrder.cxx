// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Orientation/ScanOrder.h"

#include "Filters/Common/Hash.h"
#include "Filters/Orientation/ScanWindows.h"

#include <Eigen/Dense>

#include "vtkFloatArray.h"
#include "vtkPoints.h"
#include "vtkSMPTools.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace SurfelGeometry
{
namespace
{
using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Windows of either kind that are looked at.
constexpr int MostWindows = 4096;

/// A place is sought where the lines of two jumps meet: so many pairs at a time, and more if none
/// of them tells. A pair is no farther apart than a part of all jumps, so that one scanner has seen
/// both, and so are the jumps that judge where it meets: a few, and more if some agree.
constexpr int PairsAtATime = 2000, MostTimes = 3;
constexpr std::size_t NearPart = 8, LeastNear = 256;
constexpr std::size_t FewJumps = 64, ManyJumps = 512;
constexpr std::size_t PlacesToRefine = 6;

/// Steps are alike if they are off by less than such a part of a step: while a place is sought, and
/// when it is found.
constexpr double LooseSteps = 2.0, TightSteps = 0.3;

/// A place is one if so many jumps agree with it, a part of those that nearly do: beside edges
/// points are missing. (Shuffled and halved scans, grids of heights and lattices have no such
/// place.) The lines of these must meet in a point: the least eigenvalue of the mean of I - d d^T,
/// of directions d.
constexpr int LeastJumps = 16;
constexpr double LeastAgreeing = 0.3;
constexpr double LeastSpread = 0.005;

/// It is not farther from the points than so many times their size.
constexpr double FarthestPlace = 2.0;

/// What a jump that agrees tells for a place, compared with a window without a jump. Another
/// scanner begins only if this much tells it.
constexpr double OfJump = 1.0, OfOther = 0.1, OfChange = 8.0;

/// Places are one if they are nearer than this part of the size of all points.
constexpr double SamePlace = 0.01;

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

int CountAgreeing(const Vector3d& place, const Windows& windows, double part)
{
  return static_cast<int>(std::count_if(windows.begin(), windows.end(),
    [&](const ScanWindow* w) { return SeenFrom(place, *w).Agree(part); }));
}

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
};

/// The jumps about one of them.
Windows Near(const Windows& jumps, std::size_t middle)
{
  const std::size_t reach = std::max(jumps.size() / NearPart, LeastNear) / 2;
  const std::size_t begin = middle - std::min(middle, reach);
  return { jumps.begin() + static_cast<std::ptrdiff_t>(begin),
    jumps.begin() + static_cast<std::ptrdiff_t>(std::min(middle + reach, jumps.size())) };
}

/// Where the lines of two jumps meet.
Candidate TryPair(const Windows& jumps, std::uint64_t pair)
{
  const auto pick = [](const Windows& from, std::uint64_t id) {
    return static_cast<std::size_t>(Hash(id) * static_cast<double>(from.size()));
  };
  const std::size_t first = pick(jumps, 2 * pair);
  const Windows near = Near(jumps, first);
  Meeting meeting;
  meeting.Add(*jumps[first], 1.0);
  meeting.Add(*near[pick(near, 2 * pair + 1)], 1.0);
  constexpr double least = 0.005; // lines that are parallel within 11 degrees
  if (!(meeting.Spread() > least))
  {
    return {};
  }
  Candidate found;
  found.Place = meeting.Place();
  constexpr int some = 2; // without the pair itself, which mostly is not among the few
  if (CountAgreeing(found.Place, Some(near, FewJumps), LooseSteps) >= some)
  {
    found.Agreeing = CountAgreeing(found.Place, Some(near, ManyJumps), LooseSteps);
  }
  return found;
}

/// The sum over jumps of a step of Gauss and Newton's method that makes them steps like others.
struct NormalEquations
{
  Matrix3d Products = Matrix3d::Zero();
  Vector3d Residuals = Vector3d::Zero();

  /// @param size of the differences from which derivatives are taken
  void Add(const Vector3d& place, const ScanWindow& window, double size)
  {
    const Vector3d off = SeenFrom(place, window).MiddleOff;
    Matrix3d slopes;
    for (int c = 0; c < 3; ++c)
    {
      const Vector3d moved = place + size * Vector3d::Unit(c);
      slopes.col(c) = (SeenFrom(moved, window).MiddleOff - off) / size;
    }
    const double weight = 1.0 / (1.0 + off.squaredNorm() / (TightSteps * TightSteps));
    this->Products += weight * slopes.transpose() * slopes;
    this->Residuals += weight * slopes.transpose() * off;
  }
};

/// Moves a place to where the jumps that agree with it are most alike the steps beside them.
Vector3d Refine(Vector3d place, const Windows& jumps)
{
  constexpr double parts[] = { 8.0, 8.0, 4.0, 4.0, 2.0, 2.0, 1.0, 1.0, TightSteps, TightSteps };
  for (const double part : parts)
  {
    Windows agreeing;
    double nearest = std::numeric_limits<double>::infinity();
    for (const ScanWindow* window : jumps)
    {
      if (SeenFrom(place, *window).Agree(part))
      {
        agreeing.push_back(window);
        nearest = std::min(nearest, (window->Before() - place).norm());
      }
    }
    if (agreeing.size() < LeastJumps / 2)
    {
      break;
    }
    NormalEquations equations;
    for (const ScanWindow* window : Some(agreeing, ManyJumps))
    {
      equations.Add(place, *window, 1e-6 * nearest);
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

/// Number of jumps that agree with a place; 0 if they are too few for a scanner.
int CountIfScanner(const Vector3d& place, const Windows& jumps, double size)
{
  Meeting meeting;
  int tight = 0, loose = 0;
  double nearest = std::numeric_limits<double>::infinity();
  for (const ScanWindow* window : jumps)
  {
    const SeenSteps seen = SeenFrom(place, *window);
    loose += seen.Agree(LooseSteps) ? 1 : 0;
    if (seen.Agree(TightSteps))
    {
      ++tight;
      meeting.Add(*window, 1.0);
      nearest = std::min(nearest, (window->Before() - place).norm());
    }
  }
  const bool isScanner = tight >= LeastJumps && tight > LeastAgreeing * loose &&
    meeting.Spread() > LeastSpread && nearest < FarthestPlace * size;
  return isScanner ? tight : 0;
}

/// The best candidates, none beside another.
std::vector<Candidate> BestOf(std::vector<Candidate>& candidates, double size)
{
  std::stable_sort(candidates.begin(), candidates.end(),
    [](const Candidate& a, const Candidate& b) { return a.Agreeing > b.Agreeing; });
  std::vector<Candidate> best;
  for (const Candidate& candidate : candidates)
  {
    const bool isNew = std::none_of(best.begin(), best.end(), [&](const Candidate& other) {
      constexpr double beside = 0.002; // of the size; Refine() moves them together
      return (candidate.Place - other.Place).norm() < beside * size;
    });
    if (candidate.Agreeing > 0 && isNew && best.size() < PlacesToRefine)
    {
      best.push_back(candidate);
    }
  }
  return best;
}

/// The place with which most of the jumps agree, of some pairs; false if there is none.
bool TryPairs(const Windows& jumps, double size, int time, Vector3d& place)
{
  std::vector<Candidate> candidates(PairsAtATime);
  vtkSMPTools::For(0, PairsAtATime, 16, [&](vtkIdType begin, vtkIdType end) {
    for (vtkIdType i = begin; i < end; ++i)
    {
      candidates[i] = TryPair(jumps, static_cast<std::uint64_t>(time * PairsAtATime + i));
    }
  });
  std::vector<Candidate> best = BestOf(candidates, size);
  vtkSMPTools::For(0, static_cast<vtkIdType>(best.size()), 1, [&](vtkIdType begin, vtkIdType end) {
    for (vtkIdType i = begin; i < end; ++i)
    {
      best[i].Place = Refine(best[i].Place, jumps);
      best[i].Agreeing = CountIfScanner(best[i].Place, jumps, size);
    }
  });
  const auto most = std::max_element(best.begin(), best.end(),
    [](const Candidate& a, const Candidate& b) { return a.Agreeing < b.Agreeing; });
  if (most == best.end() || most->Agreeing == 0)
  {
    return false;
  }
  place = most->Place;
  return true;
}

bool FindPlace(const Windows& jumps, double size, Vector3d& place)
{
  bool found = false;
  for (int time = 0; time < MostTimes && jumps.size() >= LeastJumps && !found; ++time)
  {
    found = TryPairs(jumps, size, time, place);
  }
  return found;
}

/// The places of all scanners.
std::vector<Vector3d> FindPlaces(const std::vector<ScanWindow>& windows, double size)
{
  std::vector<Vector3d> places;
  Windows jumps;
  for (const ScanWindow& window : windows)
  {
    if (window.Jumps)
    {
      jumps.push_back(&window);
    }
  }
  Vector3d place;
  for (int i = 0; i < MostScanners && FindPlace(jumps, size, place); ++i)
  {
    // What is left of a scan may tell its place once more, less exactly.
    const bool isNew = std::none_of(places.begin(), places.end(),
      [&](const Vector3d& other) { return (place - other).norm() < SamePlace * size; });
    if (isNew)
    {
      places.push_back(place);
    }
    jumps.erase(std::remove_if(jumps.begin(), jumps.end(),
                  [&](const ScanWindow* w) { return SeenFrom(place, *w).Agree(LooseSteps); }),
      jumps.end());
  }
  return places;
}

/// For each window the scanner that saw it, an index or -1: the sequence for which most tells, with
/// few changes (Viterbi's algorithm).
class Sequence
{
public:
  Sequence(const std::vector<ScanWindow>& windows, const std::vector<Vector3d>& places)
    : Labels(places.size() + 1)
    , From(windows.size() * this->Labels)
    , Score(this->Labels, 0.0)
  {
    for (std::size_t i = 0; i < windows.size(); ++i)
    {
      const auto best = std::max_element(this->Score.begin(), this->Score.end());
      const auto other = static_cast<std::size_t>(best - this->Score.begin());
      const double changed = *best - OfChange;
      for (std::size_t label = 0; label < this->Labels; ++label)
      {
        const bool changes = i > 0 && this->Score[label] < changed;
        this->From[i * this->Labels + label] = static_cast<int>(changes ? other : label);
        this->Next.push_back((changes ? changed : this->Score[label]) +
          (label > 0 ? Tells(windows[i], places[label - 1]) : 0.0));
      }
      this->Score.swap(this->Next);
      this->Next.clear();
    }
  }

  std::vector<int> Best() const
  {
    const std::size_t count = this->From.size() / this->Labels;
    std::vector<int> labels(count);
    auto label = static_cast<int>(
      std::max_element(this->Score.begin(), this->Score.end()) - this->Score.begin());
    for (std::size_t i = count; i-- > 0;)
    {
      labels[i] = label - 1;
      label = this->From[i * this->Labels + static_cast<std::size_t>(label)];
    }
    return labels;
  }

private:
  static double Tells(const ScanWindow& window, const Vector3d& place)
  {
    const SeenSteps seen = SeenFrom(place, window);
    if (window.Jumps)
    {
      return seen.Agree(TightSteps) ? OfJump : 0.0;
    }
    return seen.AreRegular(TightSteps) ? OfOther : -OfOther;
  }

  std::size_t Labels; // 0: none
  std::vector<int> From;
  std::vector<double> Score, Next;
};

/// Where one scan ends and the next one begins, between two points: at the longest step.
vtkIdType FindChange(vtkPoints* points, vtkIdType begin, vtkIdType end)
{
  vtkIdType change = begin;
  double longest = -1.0;
  Vector3d last(0.0, 0.0, 0.0), p(0.0, 0.0, 0.0);
  points->GetPoint(begin, last.data());
  for (vtkIdType i = begin + 1; i <= end; ++i)
  {
    points->GetPoint(i, p.data());
    if (p.allFinite())
    {
      const double step = (p - last).norm();
      if (step > longest)
      {
        longest = step;
        change = i;
      }
      last = p;
    }
  }
  return change;
}

double SizeOf(vtkPoints* points)
{
  double bounds[6];
  points->GetBounds(bounds);
  return Vector3d(bounds[1] - bounds[0], bounds[3] - bounds[2], bounds[5] - bounds[4]).norm();
}
}

std::vector<ScannedPoints> FindScans(vtkPoints* points)
{
  Vector3d origin;
  const std::vector<ScanWindow> windows = FindWindows(points, origin, MostWindows);
  const std::vector<Vector3d> places = FindPlaces(windows, SizeOf(points));
  if (places.empty())
  {
    return {};
  }
  const std::vector<int> labels = Sequence(windows, places).Best();
  std::vector<ScannedPoints> scans;
  vtkIdType begin = 0;
  for (std::size_t i = 0; i < labels.size(); ++i)
  {
    const bool isLast = i + 1 == labels.size();
    if (!isLast && labels[i + 1] == labels[i])
    {
      continue;
    }
    const vtkIdType end = isLast ? points->GetNumberOfPoints()
                                 : FindChange(points, windows[i].Middle, windows[i + 1].Middle);
    if (labels[i] >= 0)
    {
      const Vector3d place = places[static_cast<std::size_t>(labels[i])] + origin;
      scans.push_back({ begin, end, { place[0], place[1], place[2] } });
    }
    begin = end;
  }
  return scans;
}

void WriteWays(vtkPoints* points, const std::vector<ScannedPoints>& scans, vtkFloatArray* ways)
{
  ways->SetNumberOfComponents(3);
  ways->SetNumberOfTuples(points->GetNumberOfPoints());
  ways->Fill(0.0);
  for (const ScannedPoints& scan : scans)
  {
    vtkSMPTools::For(scan.Begin, scan.End, [&](vtkIdType i, vtkIdType end) {
      for (; i < end; ++i)
      {
        double p[3];
        points->GetPoint(i, p);
        ways->SetTuple3(i, scan.Place[0] - p[0], scan.Place[1] - p[1], scan.Place[2] - p[2]);
      }
    });
  }
}
}
