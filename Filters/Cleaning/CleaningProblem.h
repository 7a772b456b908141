// SPDX-License-Identifier: BSD-3-Clause
/**
 * A cloud that is cleaned by one process, or by several together. What is usual in the whole cloud
 * is told by samples of it: the same ones however the cloud is spread.
 */
#pragma once

#include "Filters/Common/VectorMath.h"
#include "Filters/Neighbors/NeighborGraph.h"

#include <functional>
#include <vector>

namespace SurfelGeometry
{
/// For several processes that clean one cloud: each has a region and its halo.
struct CleaningSharing
{
  vtkIdType Total = 0;                  ///< points of all processes
  double Origin[3] = { 0.0, 0.0, 0.0 }; ///< of all processes, world units
  std::vector<char> IsOwn;              ///< [n] whether a point is in the region, not in its halo

  /// Collective: gives all processes the values of all. Returns false if a process was stopped.
  std::function<bool(bool running, std::vector<float>& values)> Gather;
};

struct CleaningProblem
{
  const SearchedCloud& Searched;            // with its tree
  const CleaningSharing* Sharing = nullptr; // null: one process

  const LocalCloud& Cloud() const { return this->Searched.Cloud; }
  bool IsOwn(int i) const { return !this->Sharing || this->Sharing->IsOwn[i]; }

  /// Points of all processes.
  vtkIdType Total() const;

  /// About this share of the points, from 0 to 1; of several processes, each has its own ones.
  std::vector<int> Samples(double share) const;

  /// Appends a position that all processes understand.
  void PutPosition(int i, std::vector<float>& values) const;
  Float3 SharedPosition(int i) const;

  /// Collective: whether a condition holds in all processes.
  bool All(bool condition) const;

  /// Collective: values of all processes. Returns false if one was stopped.
  bool Gather(bool running, std::vector<float>& values) const;
};
}
