// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Scanners/BeamOrder.h"

#include <algorithm>
#include <cstdint>
#include <limits>

namespace SurfelGeometry
{
namespace
{
using Positions = std::vector<Eigen::Vector3d>;

/// The most beams of a scanner, and the most points until the next one of a beam. PointsToAsk
/// points tell the number of beams, if a part of LeastEqual has its next one equally late.
constexpr std::size_t MostBeams = 40, MostLate = 72;
constexpr std::size_t PointsToAsk = 128;
constexpr double EquallyLate = 0.25, LeastEqual = 0.45;

/// The most rounds until the next point of a beam.
constexpr double LatestRound = 2.6;

/// The most points that are looked at on either side of one.
constexpr std::size_t MostReach = 128;
static_assert(LatestRound * MostBeams <= MostReach && MostLate <= MostReach, "FirstNear has room");

/// Points up to this many times as far as the nearest are as near: noise, or the round after the
/// next.
constexpr double AboutAsNear = 2.0;

constexpr std::size_t None = std::numeric_limits<std::size_t>::max();

/// Of the points beside one, the first that is about as near as the nearest, or none.
/// @param way  1: behind it, -1: before it
std::size_t FirstNear(const Positions& points, std::size_t i, std::size_t reach, int way)
{
  const std::size_t most = std::min(reach, way > 0 ? points.size() - 1 - i : i);
  double squares[MostReach];
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < most; ++k)
  {
    const std::size_t j = way > 0 ? i + 1 + k : i - 1 - k;
    squares[k] = (points[j] - points[i]).squaredNorm();
    least = std::min(least, squares[k]);
  }
  for (std::size_t k = 0; k < most; ++k)
  {
    if (squares[k] <= AboutAsNear * AboutAsNear * least)
    {
      return way > 0 ? i + 1 + k : i - 1 - k;
    }
  }
  return None;
}

/// After how many points that of the same beam comes; 0 if that is not so.
std::size_t FindRound(const Positions& points)
{
  std::vector<std::size_t> lags;
  const std::size_t last = points.size() - MostLate - 1;
  for (std::size_t k = 0; k < PointsToAsk; ++k)
  {
    const std::size_t i = k * last / PointsToAsk;
    lags.push_back(FirstNear(points, i, MostLate, 1) - i);
  }
  std::sort(lags.begin(), lags.end());
  const auto median = static_cast<double>(lags[PointsToAsk / 2]);
  const auto equal = std::count_if(lags.begin(), lags.end(), [median](std::size_t lag) {
    return std::abs(static_cast<double>(lag) - median) <= EquallyLate * median;
  });
  return static_cast<double>(equal) >= LeastEqual * PointsToAsk ? static_cast<std::size_t>(median)
                                                                : 0;
}

/// For each point that which follows it, where each is the nearest of the other.
std::vector<std::size_t> LinkNearest(const Positions& points, std::size_t reach)
{
  const std::size_t count = points.size();
  std::vector<std::size_t> next(count, None);
  for (std::size_t i = 0; i < count; ++i)
  {
    const std::size_t j = FirstNear(points, i, reach, 1);
    if (j != None && FirstNear(points, j, reach, -1) == i)
    {
      next[i] = j;
    }
  }
  return next;
}

/// Links what is left where beams jump: as many points as ends of links between two that are
/// linked.
void LinkJumps(std::vector<std::size_t>& next, std::vector<char>& isNext)
{
  std::size_t before = None; // the last point with a link
  for (std::size_t i = 0; i < next.size(); ++i)
  {
    if (next[i] == None)
    {
      continue;
    }
    const std::size_t begin = before == None ? 0 : before;
    if (before != None && i > begin + 1 && next[begin] < next[i])
    {
      std::vector<std::size_t> free;
      for (std::size_t j = next[begin] + 1; j < next[i]; ++j)
      {
        if (!isNext[j])
        {
          free.push_back(j);
        }
      }
      if (free.size() == i - begin - 1)
      {
        for (std::size_t k = 0; k < free.size(); ++k)
        {
          next[begin + 1 + k] = free[k];
          isNext[free[k]] = 1;
        }
      }
    }
    before = i;
  }
}
}

std::vector<std::size_t> OrderByBeams(const Positions& points)
{
  if (points.size() < 4 * MostLate)
  {
    return {};
  }
  const std::size_t round = FindRound(points);
  if (round < 2 || round > MostBeams)
  {
    return {};
  }
  const auto reach = static_cast<std::size_t>(LatestRound * static_cast<double>(round));
  std::vector<std::size_t> next = LinkNearest(points, reach);
  std::vector<char> isNext(points.size(), 0);
  for (const std::size_t j : next)
  {
    if (j != None)
    {
      isNext[j] = 1;
    }
  }
  LinkJumps(next, isNext);
  std::vector<std::size_t> order;
  order.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i)
  {
    for (std::size_t j = isNext[i] ? None : i; j != None; j = next[j])
    {
      order.push_back(j);
    }
  }
  return order;
}
}
