// SPDX-License-Identifier: BSD-3-Clause
/**
 * The stored neighbours of a cloud, which several steps use: one query serves them all.
 */
#pragma once

#include "Filters/Common/RawVector.h"
#include "Filters/Common/StageProgress.h"
#include "Filters/Common/VectorMath.h"
#include "Filters/Neighbors/LocalCloud.h"
#include "Filters/Neighbors/Neighbors.h"

#include <algorithm>
#include <cstddef>
#include <functional>
#include <memory>
#include <vector>

namespace SurfelGeometry
{
class NeighborSearch;

/// Number of neighbours stored for each point, and number of these that are edges of the graph for
/// sign propagation.
constexpr int KeptNeighbors = 20;
constexpr int GraphDegree = 12;

/// The number of ids in a row before the first -1. Most rows are full.
/// @param most at least 1
inline int CountIds(const int* row, int most)
{
  const int last = row[most - 1];
  return last >= 0 ? most : static_cast<int>(std::find(row, row + most, -1) - row);
}

/// The stored neighbours of all points, nearest first.
struct NeighborGraph
{
  RawVector<int> Ids;      // [KeptNeighbors * n], -1 where a point has fewer
  bool AreNearest = false; // rows have the nearest points; else those within a radius

  const int* Row(size_t i) const { return this->Ids.data() + KeptNeighbors * i; }
  int* Row(size_t i) { return this->Ids.data() + KeptNeighbors * i; }

  /// Stores what a query for point i has found.
  void Keep(size_t i, const Neighbors& neighbors);

  /// Gives the memory of the rows from `begin` to `end` back to the system, where it can take it.
  /// The rows before are released as well, and none of these is read again.
  void Release(size_t begin, size_t end);

  /// The first `count` stored neighbours of point i, as a query gives them.
  void Get(const LocalCloud& cloud, int i, int count, Neighbors& neighbors) const;
};

/// A cloud and the search in it, which one step makes and the next one takes over.
struct SearchedCloud
{
  LocalCloud Cloud;
  std::unique_ptr<NeighborSearch> Tree; // of the cloud; null: unknown
  NeighborGraph Graph;                  // of the nearest points; empty: unknown

  SearchedCloud();
  ~SearchedCloud();
  SearchedCloud(SearchedCloud&& other) noexcept;
  SearchedCloud& operator=(SearchedCloud&& other) noexcept;

  /// Makes the tree.
  void Index();

  /// Gives its memory back.
  void ReleaseTree();

  /// The nearest points, from the graph if it has so many, else from the tree.
  void Find(int i, int count, Neighbors& neighbors) const;

  /// The same without distances, and without a copy if the graph has so many.
  /// @param found their number
  const int* FindIds(int i, int count, Neighbors& neighbors, int& found) const;

  /// Stores the nearest points of all. Returns false if stopped.
  bool FindNeighbors(const StageProgress& progress);

  /// Stores the points nearest to a place instead of those nearest to point i, if the place is
  /// farther from it than a limit, world units.
  void FindAround(
    const std::function<Vector3(int i)>& placeOf, const std::function<double(int i)>& limitOf);

  /// Removes the points i with dropped[i] == 1. Rows of the graph that have one of them are found
  /// again.
  void Drop(const std::vector<unsigned char>& dropped);
};

/// What the estimation knows about its surfels. Their arrays (SurfelOutput) are then in the order
/// of the cloud, in which the filters behind it read them, and are put into that of the input at
/// the end.
struct SurfelNeighbors
{
  NeighborGraph Graph;    // empty: unknown
  std::vector<int> Order; // [n] index in the cloud of each surfel in the order of the input

  /// [n] the places that the surfels have in the order of the input.
  RawVector<int> InputRanks() const;
};
}
