// SPDX-License-Identifier: BSD-3-Clause
/**
 * Which points of a cloud are on surfaces, and how dense these are, place by place.
 */
#pragma once

#include "Filters/Cleaning/PointSpread.h"
#include "Filters/Common/VectorMath.h"

#include <atomic>
#include <functional>
#include <memory>
#include <vector>

namespace SurfelGeometry
{
struct CleaningProblem;
struct SearchedCloud;
class NeighborSearch;

/// Whether the neighbours of a point are in a plane. Changes `neighbors` and `near`.
bool IsFlat(const SearchedCloud& searched, int i, Neighbors& neighbors, NearCloud& near);

/// Which points are in flat sets. Of a small cloud, many are asked for again and again. Threads may
/// ask at the same time.
class FlatPoints
{
public:
  explicit FlatPoints(const SearchedCloud& searched);

  /// Chance makes single sets of stray points flat, but not those of most neighbours too. The set
  /// of one that is beside a surface is flat as well.
  bool IsOnSurface(int i);

private:
  enum Answer : unsigned char
  {
    Unknown,
    Flat,
    Thick
  };

  bool IsFlat(int i);

  const SearchedCloud& Searched;
  std::vector<std::atomic<unsigned char>> Known; // [n] Answer
};

class SurfaceDensity
{
public:
  SurfaceDensity();
  ~SurfaceDensity();

  /// Collective. Returns false if stopped.
  /// @param distances [n] mean distance to the neighbours, world units
  /// @param counts whether a point on a surface counts
  bool Find(const CleaningProblem& problem, const std::vector<float>& distances, bool running,
    FlatPoints& flat, const std::function<bool(int i)>& counts);

  /// The mean distance that is usual on the surfaces about a place; 0 where there are none.
  double UsualDistance(const Float3& place) const;

  /// Points of the cloud that tell what is usual.
  static std::vector<int> Samples(const CleaningProblem& problem);

private:
  std::vector<float> Positions; // [3m]
  std::vector<float> Distances; // [m] mean distance to the neighbours, world units
  std::unique_ptr<NeighborSearch> Tree;
};
}
