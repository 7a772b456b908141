// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Orientation/Rooms.h"

#include "Filters/Common/ParallelFor.h"
#include "Filters/Neighbors/LocalCloud.h"
#include "Filters/Neighbors/NeighborGraph.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace SurfelGeometry
{
namespace
{
constexpr int MinPoints = 1000; // of a room
constexpr int ShellSamples = 50'000;
constexpr int ContentSamples = 2000;
constexpr int SetSamples = 64;

/// These limits are those of rooms.py in Wrapping/Python/surfelsplatting/shapes, too: largest
/// cosine between a wall's normal and the axis, and the smallest of a floor's.
constexpr double WallCosine = 0.3;
constexpr double LevelCosine = 0.95;

/// Part of the height, at both ends, in which a floor and a ceiling are. Beyond the percentiles are
/// stray points.
constexpr double EndPart = 0.05;
constexpr double LowPercentile = 0.005, HighPercentile = 0.995;

/// Least parts of the area: of the floor, and of the ceiling; of all that is level or upright.
constexpr double MinLevel = 0.06;
constexpr double MinUpright = 0.8;

/// Least part of the ceiling's area that the floor has. Furniture hides some.
constexpr double MinFloor = 0.5;

/// Least part of the area between floor and ceiling that lies inside, of other sets: noise takes
/// points of the shell itself inside, too. (Boxes have at most 0.001, rooms from 0.02.) The winding
/// number is 1 inside of closed surfaces, and at least MinWinding of what is not part of them. At
/// most a part of a set is outside then.
constexpr double MinInside = 0.01;
constexpr double MinWinding = 0.75;
constexpr double MaxOutside = 0.1;

/// Least part of the area by which more faces down than up between floor and ceiling, and the least
/// ratio of the two.
constexpr double MinTops = 0.02;
constexpr double TopsOverBottoms = 2.0;

constexpr double LowestRoom = 1.8, HighestRoom = 12.0; // from metres to feet

/// Evenly chosen points of a component that have an outside.
std::vector<int> SampleShell(const std::vector<unsigned char>& twoSided, const Component& component)
{
  std::vector<int> ids;
  const int step = 1 + component.Count / ShellSamples;
  for (int m = 0; m < component.Count; m += step)
  {
    if (!twoSided[component.Ids[m]])
    {
      ids.push_back(component.Ids[m]);
    }
  }
  return ids;
}

/// Whether the surface is closed up to holes, and its normals point outward.
bool IsClosedOutward(const LocalCloud& cloud, const PlaneFits& fits, const std::vector<int>& shell)
{
  Vector3 center{};
  for (const int i : shell)
  {
    center = center + (1.0 / shell.size()) * Load(cloud.Position(i));
  }
  Vector3 vectors{};
  double areas = 0.0, volume = 0.0;
  for (const int i : shell)
  {
    const Vector3 vector = AreaOf(fits[i]) * Vector3(fits[i].Normal);
    vectors = vectors + vector;
    areas += AreaOf(fits[i]);
    volume += Dot(vector, Load(cloud.Position(i)) - center);
  }
  return volume > 0.0 && Norm(vectors) <= MaxImbalance * areas;
}

struct Range
{
  double Low, High;

  double Length() const { return this->High - this->Low; }

  enum Part
  {
    Lower,
    Between,
    Upper
  };
  Part PartOf(double x) const
  {
    const double margin = EndPart * this->Length();
    return x <= this->Low + margin ? Lower : (x < this->High - margin ? Between : Upper);
  }
};

Range FindRange(const LocalCloud& cloud, const std::vector<int>& shell, int axis)
{
  std::vector<float> values(shell.size());
  std::transform(
    shell.begin(), shell.end(), values.begin(), [&](int i) { return cloud.Position(i)[axis]; });
  const auto percentile = [&values](double share) {
    const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * (values.size() - 1));
    std::nth_element(values.begin(), at, values.end());
    return static_cast<double>(*at);
  };
  return { percentile(LowPercentile), percentile(HighPercentile) };
}

/// Areas of a shell by their slopes against an axis; level ones in the three parts of its range.
struct Profile
{
  double Up[3]{}, Down[3]{}, Walls = 0.0, All = 0.0;

  bool HasFloorAndCeiling() const
  {
    const double floor = this->Down[Range::Lower], ceiling = this->Up[Range::Upper];
    double upright = this->Walls;
    for (const int part : { Range::Lower, Range::Between, Range::Upper })
    {
      upright += this->Up[part] + this->Down[part];
    }
    return std::min(floor, ceiling) >= MinLevel * this->All && floor >= MinFloor * ceiling &&
      upright >= MinUpright * this->All;
  }

  bool HasTops() const
  {
    const double tops = this->Down[Range::Between], bottoms = this->Up[Range::Between];
    return tops - bottoms >= MinTops * this->All && tops >= TopsOverBottoms * bottoms;
  }
};

Profile MakeProfile(const LocalCloud& cloud, const PlaneFits& fits, const std::vector<int>& shell,
  int axis, const Range& range)
{
  Profile profile;
  for (const int i : shell)
  {
    const double area = AreaOf(fits[i]);
    const double along = Vector3(fits[i].Normal)[axis];
    profile.All += area;
    if (std::abs(along) <= WallCosine)
    {
      profile.Walls += area;
    }
    else if (std::abs(along) >= LevelCosine)
    {
      (along > 0.0 ? profile.Up : profile.Down)[range.PartOf(cloud.Position(i)[axis])] += area;
    }
  }
  return profile;
}

/// Number of the set that each point is in.
std::vector<int> NumberSets(const ConsistentSets& sets)
{
  std::vector<int> numbers(sets.Ids.size());
  for (int set = 0; set < sets.Count(); ++set)
  {
    for (int k = sets.Starts[set]; k < sets.Starts[set + 1]; ++k)
    {
      numbers[sets.Ids[k]] = set;
    }
  }
  return numbers;
}

/// Whether a set goes on outside of a shell, as what pokes into it does.
bool GoesOutside(const WindingNumbers& shell, const Component& set)
{
  const int samples = std::min(set.Count, SetSamples);
  int outside = 0;
  for (int s = 0; s < samples; ++s)
  {
    const int i = set.Ids[static_cast<size_t>(s) * set.Count / samples];
    outside += shell.At(i) < 1.0 - MinWinding ? 1 : 0;
  }
  return outside > MaxOutside * samples;
}

/// The sets beside one, but for another one.
std::vector<int> SetsBeside(
  const NeighborGraph& graph, const std::vector<int>& setOf, const Component& set, int other)
{
  std::vector<int> beside;
  for (int m = 0; m < set.Count; ++m)
  {
    const int* row = graph.Row(static_cast<size_t>(set.Ids[m]));
    for (int k = 0; k < KeptNeighbors && row[k] >= 0; ++k)
    {
      const int number = setOf[row[k]];
      if (number != setOf[set.Ids[m]] && number != other)
      {
        beside.push_back(number);
      }
    }
  }
  std::sort(beside.begin(), beside.end());
  beside.erase(std::unique(beside.begin(), beside.end()), beside.end());
  return beside;
}

/// Those of some sets that do not go on outside, nor the sets beside them, ascending.
/// @param numbers -1: none
std::vector<int> WhollyInside(const WindingNumbers& shell, const NeighborGraph& graph,
  const ConsistentSets& sets, const std::vector<int>& setOf, int number, std::vector<int> numbers)
{
  const auto goesOutside = [&](int set) {
    return GoesOutside(shell, { sets.Begin(set), sets.Size(set) });
  };
  std::sort(numbers.begin(), numbers.end());
  numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
  numbers.erase(std::remove_if(numbers.begin(), numbers.end(),
                  [&](int set) {
                    if (set < 0 || goesOutside(set))
                    {
                      return true;
                    }
                    const std::vector<int> beside =
                      SetsBeside(graph, setOf, { sets.Begin(set), sets.Size(set) }, number);
                    return std::any_of(beside.begin(), beside.end(), goesOutside);
                  }),
    numbers.end());
  return numbers;
}

std::vector<int> PointsBetween(const LocalCloud& cloud, int axis, const Range& range)
{
  std::vector<int> between;
  for (int i = 0; i < cloud.Size(); ++i)
  {
    if (range.PartOf(cloud.Position(i)[axis]) == Range::Between)
    {
      between.push_back(i);
    }
  }
  return between;
}

/// Part of the area between floor and ceiling, of all points of the cloud, that other sets have
/// which are wholly inside.
double InsidePart(const LocalCloud& cloud, const NeighborGraph& graph, const PlaneFits& fits,
  const ConsistentSets& sets, int number, const std::vector<int>& between)
{
  const std::vector<int> setOf = NumberSets(sets);
  const std::vector<char> unturned(static_cast<size_t>(cloud.Size()), 0);
  const WindingNumbers shell({ cloud, fits, unturned }, sets.Begin(number), sets.Size(number));
  const size_t count = std::min<size_t>(between.size(), ContentSamples);
  std::vector<int> setsInside(count, -1);
  ParallelFor(0, static_cast<vtkIdType>(count), [&](vtkIdType s, vtkIdType end) {
    for (; s < end; ++s)
    {
      const int i = between[static_cast<size_t>(s) * between.size() / count];
      setsInside[s] = setOf[i] != number && shell.At(i) >= MinWinding ? setOf[i] : -1;
    }
  });
  const std::vector<int> whole = WhollyInside(shell, graph, sets, setOf, number, setsInside);
  double inside = 0.0, all = 0.0;
  for (size_t s = 0; s < count; ++s)
  {
    const double area = AreaOf(fits[between[s * between.size() / count]]);
    all += area;
    inside += std::binary_search(whole.begin(), whole.end(), setsInside[s]) ? area : 0.0;
  }
  return inside / std::max(all, 1e-300);
}
}

bool IsRoom(const LocalCloud& cloud, const NeighborGraph& graph, const PlaneFits& fits,
  const std::vector<unsigned char>& twoSided, const ConsistentSets& sets, int number)
{
  const Component component{ sets.Begin(number), sets.Size(number) };
  if (component.Count < MinPoints)
  {
    return false;
  }
  const std::vector<int> shell = SampleShell(twoSided, component);
  const bool isGiven =
    std::any_of(shell.begin(), shell.end(), [&](int i) { return fits[i].SideGiven; });
  if (shell.empty() || isGiven || !IsClosedOutward(cloud, fits, shell))
  {
    return false;
  }
  const Range ranges[] = { FindRange(cloud, shell, 0), FindRange(cloud, shell, 1),
    FindRange(cloud, shell, 2) };
  const double least = std::min({ ranges[0].Length(), ranges[1].Length(), ranges[2].Length() });
  for (const int axis : { 2, 1 }) // what may be up
  {
    const Range& range = ranges[axis];
    const Profile profile = MakeProfile(cloud, fits, shell, axis, range);
    const double height = range.Length();
    const bool isAsHighAsRooms = height >= LowestRoom && height <= HighestRoom && height <= least;
    if (profile.HasFloorAndCeiling() &&
      ((isAsHighAsRooms && profile.HasTops()) ||
        InsidePart(cloud, graph, fits, sets, number, PointsBetween(cloud, axis, range)) >=
          MinInside))
    {
      return true;
    }
  }
  return false;
}
}
