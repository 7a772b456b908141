// SPDX-License-Identifier: BSD-3-Clause
/**
 * Points that are much sparser than most of the cloud, and in no plane, are dust, or far returns;
 * or they are on a far surface, at a fold. There the surface goes on, as sparse.
 */
#pragma once

#include "Filters/Neighbors/NeighborSearch.h"

namespace SurfelGeometry
{
/// A surface goes on about a point if among so many neighbours so many are on surfaces, and not
/// nearer to their own neighbours by more than this factor. (Of stray points 5 % have more than two
/// such neighbours, and beside plants some have eight up to a factor of 2; of points at folds of
/// sparse surfaces 10 % have fewer than eight, with others as sparse as they are, up to a factor of
/// 1.3.)
constexpr int SparseNeighbors = 64;
constexpr int LeastOnSparse = 8;
constexpr float DenserFactor = 1.6f;

/// @param distances [n] of each point to its neighbours
/// @param isOnSurface tells whether a point is in a plane with its neighbours
template <typename Distances, typename Test>
bool IsOnSparseSurface(int i, const NeighborSearch& tree, const Distances& distances,
  Neighbors& neighbors, Test&& isOnSurface)
{
  tree.FindNearest(i, SparseNeighbors, neighbors);
  int found = 0;
  for (const int j : neighbors.Ids)
  {
    found += DenserFactor * distances[j] > distances[i] && isOnSurface(j) ? 1 : 0;
    if (found == LeastOnSparse)
    {
      return true;
    }
  }
  return false;
}
}
