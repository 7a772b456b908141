// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Scanners/ScanOrder.h"

#include "Filters/Common/ParallelFor.h"
#include "Filters/Scanners/ScanPlaces.h"

#include "vtkFloatArray.h"
#include "vtkPoints.h"

#include <algorithm>
#include <cstddef>

namespace SurfelGeometry
{
namespace
{
using Eigen::Vector3d;

/// Windows of either kind that are looked at.
constexpr int MostWindows = 4096;

/// What a jump that agrees tells for a place, compared with a window without a jump. Another
/// scanner begins only if this much tells it.
constexpr double OfJump = 1.0, OfOther = 0.1, OfChange = 8.0;

/// For each window the scanner that saw it, an index or -1: the sequence for which most tells, with
/// few changes (Viterbi's algorithm).
class Sequence
{
public:
  Sequence(const std::vector<ScanWindow>& windows, const std::vector<ScanPlace>& places)
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
  static double Tells(const ScanWindow& window, const ScanPlace& place)
  {
    const SeenSteps seen = SeenFrom(place.Place, window, place.Are);
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

/// Diagonal of the box of most windows: beyond are stray points, and far returns.
double SizeOf(const std::vector<ScanWindow>& windows)
{
  constexpr double lowShare = 0.005, highShare = 0.995;
  Vector3d extent = Vector3d::Zero();
  std::vector<double> values(windows.size());
  for (int c = 0; c < 3 && !windows.empty(); ++c)
  {
    std::transform(windows.begin(), windows.end(), values.begin(),
      [c](const ScanWindow& window) { return window.Before()[c]; });
    const auto at = [&values](double share) {
      const auto nth = values.begin() +
        static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
      std::nth_element(values.begin(), nth, values.end());
      return *nth;
    };
    const double low = at(lowShare);
    extent[c] = at(highShare) - low;
  }
  return extent.norm();
}
}

std::vector<ScannedPoints> FindScans(vtkPoints* points)
{
  Vector3d origin;
  std::vector<ScanWindow> windows;
  std::vector<ScanPlace> places;
  for (const PointOrder order : { PointOrder::AsStored, PointOrder::ByBeams })
  {
    windows = FindWindows(points, order, origin, MostWindows);
    places = FindPlaces(windows, SizeOf(windows));
    if (!places.empty())
    {
      break;
    }
  }
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
      const Vector3d place = places[static_cast<std::size_t>(labels[i])].Place + origin;
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
    ParallelFor(scan.Begin, scan.End, [&](vtkIdType i, vtkIdType end) {
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
