// SPDX-License-Identifier: BSD-3-Clause
/**
 * The votes of neighbouring points on the relative signs of their normals, and the patches that
 * reliable votes join.
 */
#pragma once

#include "Filters/Common/ParallelFor.h"
#include "Filters/Common/RawVector.h"
#include "Filters/Estimation/PlaneFit.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

namespace SurfelGeometry
{
struct LocalCloud;
class ParityUnionFind;

struct Edge
{
  int A, B;
  float Vote;
};

/// An edge from a point of a piece of the cloud. All that joining it reads is here, so that edges
/// anywhere in the piece are not looked up.
struct SureEdge
{
  std::uint32_t
    Packed; ///< twice the point, from the piece's first one on; 1 more: the signs differ
  int To;   ///< in the cloud

  int From() const { return static_cast<int>(this->Packed >> 1); }
  bool Differ() const { return (this->Packed & 1) != 0; }
};

/// The sure edges of a piece of the cloud, which join points to patches, in classes by their votes.
struct SureEdges
{
  static constexpr int NumberOfClasses = 255;

  using ClassEnds = std::array<std::uint32_t, NumberOfClasses>;

  std::vector<SureEdge> Edges; ///< the surest first
  ClassEnds Ends;              ///< of each class
};

/// The edges of the graph: slot GraphDegree i + k leads from i to its neighbour of rank k.
struct EdgeVotes
{
  RawVector<float> Votes;      ///< 0: no edge, or stored at its other end
  std::vector<SureEdges> Sure; ///< of each piece, without those that close a loop in it

  vtkIdType Count() const { return static_cast<vtkIdType>(this->Votes.size() / GraphDegree); }
};

/// Computes the votes of all edges. Those between points whose normals surely face their scanners
/// do not count if they contradict that, and come first otherwise.
/// @param seen [n] 1: such a point; empty: scanners are not known
EdgeVotes CollectVotes(const LocalCloud& cloud, const PlaneFits& fits, const NeighborGraph& graph,
  const std::vector<unsigned char>& seen);

/// Joins the sure edges, the surest first, and drops them: Kruskal's algorithm with the votes in
/// classes.
/// @param evidence as in ScannerSides.h; empty: scanners are not known
void JoinSureEdges(EdgeVotes& edges, ParityUnionFind& signs, std::vector<int>& evidence);

/// Points per piece of a parallel loop.
constexpr vtkIdType PieceSize = 1 << 14;

inline vtkIdType PieceCount(vtkIdType count)
{
  return (count + PieceSize - 1) / PieceSize;
}

/// Calls visit(p, first, last) for pieces of the cloud, in parallel: points from `first` to
/// `last`, few enough for a core's cache.
template <typename Visit>
void ForPieces(vtkIdType count, Visit&& visit)
{
  ParallelFor(0, PieceCount(count), 1, [&](vtkIdType begin, vtkIdType end) {
    for (vtkIdType p = begin; p < end; ++p)
    {
      visit(p, p * PieceSize, std::min(count, (p + 1) * PieceSize));
    }
  });
}

template <typename T>
std::vector<T> Concatenated(const std::vector<std::vector<T>>& parts)
{
  std::vector<T> all;
  for (const std::vector<T>& part : parts)
  {
    all.insert(all.end(), part.begin(), part.end());
  }
  return all;
}
}
