// SPDX-License-Identifier: BSD-3-Clause
/**
 * Bounds of a hierarchy's nodes, computed once. Each frame selects its cut from them
 * (HierarchyCut.h).
 *
 * A cut is selected in groups of up to 64 nodes: a whole subtree is drawn at one level, which the
 * extent of its nodes (NodeExtent) and the least coherent one determine. There is one entry for
 * each cluster of 64 leaves and for each node above. A frame reads only these entries, and descends
 * only until a group is fine enough. They can also come from a file, in which they look as they do
 * in memory.
 */
#pragma once

#include "Core/Base/Executor.h"
#include "Core/Hierarchy/HierarchyLayout.h"
#include "Core/Surfels/SurfelCloud.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace SurfelSplatting
{
/// Extent of a node, or of several.
struct NodeExtent
{
  /// |S|^(1/2), the Frobenius norm of the covariance, world units; of several nodes the fourth root
  /// of the mean |S|^2. A node is off by the square of its variance, and of the largest node alone
  /// little is seen: where it counted for all, more nodes had the same error. Of Gaussians in space
  /// the largest standard deviation: their layers show the largest.
  float Sigma;
  float Size; ///< radius of the bounding sphere of the leaves' centres, world units; the largest
  /// |A| / sum of areas, the smallest of several. Of Gaussians in space instead: the share of the
  /// variance that the places of the leaves make, and not their own extents; 1 if not known.
  float Coherence;
};

class ClusterBounds
{
public:
  static constexpr int ClusterLevel = 6; ///< of nodes with 64 leaves
  static constexpr int LevelsBelow = 6;  ///< number of levels below each entry whose extents it has

  /// A cluster, or a node above.
  struct Node
  {
    float Position[3];
    float Axis[3];     ///< of the cone, unit length
    float Cone;        ///< cosine of the normals' cone; <= 0: none
    float LeafSigma;   ///< largest standard deviation of all leaves below
    NodeExtent Extent; ///< its own
  };

  ClusterBounds() = default;
  ClusterBounds(ClusterBounds&&) = default;
  ClusterBounds& operator=(ClusterBounds&&) = default;

  /// Computes them.
  /// @param cloud leaves and nodes
  ClusterBounds(const SurfelCloud& cloud, const HierarchyLayout& layout, const Executor& executor);

  /// Uses those of Fill, which must outlive this.
  ClusterBounds(const HierarchyLayout& layout, const Node* nodes, const NodeExtent* extents);

  /// Number of entries of a hierarchy.
  static std::size_t NumberOfEntries(const HierarchyLayout& layout);

  /// Computes the entries into the caller's memory.
  /// @param cloud   leaves and nodes
  /// @param nodes   [entries]
  /// @param extents [entries][LevelsBelow]
  static void Fill(const SurfelCloud& cloud, const HierarchyLayout& layout,
    const Executor& executor, Node* nodes, NodeExtent* extents);

  const HierarchyLayout& Layout() const { return this->Tree; }

  /// ClusterLevel, or the root's level if the tree is smaller; -1 if it is empty.
  int LowestLevel(int tree) const { return this->LowestLevels[tree]; }

  /// Node j of a level from LowestLevel on.
  const Node& Get(int level, int tree, std::size_t j) const
  {
    return this->Nodes[this->Begins[level][tree] + j];
  }

  /// Extents of the nodes below node j of a level, [LevelsBelow], level - 1 first.
  const NodeExtent* Below(int level, int tree, std::size_t j) const
  {
    return this->Extents + LevelsBelow * (this->Begins[level][tree] + j);
  }

private:
  class Filler;

  explicit ClusterBounds(const HierarchyLayout& layout);

  HierarchyLayout Tree;
  int LowestLevels[HierarchyLayout::NumberOfTrees] = { -1, -1 };
  std::size_t Begins[HierarchyLayout::MaximumNumberOfLevels][HierarchyLayout::NumberOfTrees] = {};
  std::size_t Entries = 0;
  const Node* Nodes = nullptr;
  const NodeExtent* Extents = nullptr; ///< [entries][LevelsBelow]
  std::vector<Node> OwnNodes;          ///< empty if they are the caller's
  std::vector<NodeExtent> OwnExtents;
};
}
