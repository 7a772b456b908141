// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Hierarchy/ClusterBounds.h"

#include "Core/Surfels/NodeMoments.h"

#include <algorithm>
#include <cmath>

namespace SurfelSplatting
{
namespace
{
constexpr std::size_t Grain = 64;

NodeExtent ExtentOf(const SurfelCloud& cloud, std::size_t i)
{
  const double variance = cloud.Covariance(i).LargestEigenvalue();
  NodeExtent extent{ static_cast<float>(std::sqrt(std::fmax(0.0, variance))), 0.0f, 1.0f };
  if (cloud.IsNode(i))
  {
    const HierarchyNode& node = cloud.Node(i);
    extent.Size = node.Bound;
    extent.Coherence = static_cast<float>(Coherence(AreaVectorOf(node), node.Area));
  }
  return extent;
}

void Include(const NodeExtent& extent, NodeExtent& largest)
{
  largest.Sigma = std::max(largest.Sigma, extent.Sigma);
  largest.Size = std::max(largest.Size, extent.Size);
  largest.Coherence = std::min(largest.Coherence, extent.Coherence);
}
}

ClusterBounds::ClusterBounds(
  const SurfelCloud& cloud, const HierarchyLayout& layout, const Executor& executor)
  : Tree(layout)
{
  for (int tree = 0; tree < HierarchyLayout::NumberOfTrees; ++tree)
  {
    const int root = layout.RootLevel(tree);
    if (root < 0)
    {
      continue;
    }
    const int lowest = std::min(ClusterLevel, root);
    this->LowestLevels[tree] = lowest;
    for (int level = lowest; level <= root; ++level)
    {
      this->Begins[level][tree] = this->Nodes.size();
      this->Nodes.resize(this->Nodes.size() + layout.Count(level, tree));
      this->Extents.resize(LevelsBelow * this->Nodes.size(), NodeExtent{ 0.0f, 0.0f, 1.0f });
      executor.For(layout.Count(level, tree), Grain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t j = begin; j < end; ++j)
        {
          this->FillNode(cloud, tree, level, j);
          level == lowest ? this->FillCluster(cloud, tree, j) : this->FillAbove(tree, level, j);
        }
      });
    }
  }
}

void ClusterBounds::FillCluster(const SurfelCloud& cloud, int tree, std::size_t j)
{
  const int lowest = this->LowestLevels[tree];
  const std::size_t entry = this->Begins[lowest][tree] + j;
  NodeExtent* below = this->Extents.data() + LevelsBelow * entry;
  for (int level = lowest - 1; level >= 0; --level)
  {
    const std::size_t first = j << (lowest - level);
    const std::size_t last =
      std::min<std::size_t>((j + 1) << (lowest - level), this->Tree.Count(level, tree));
    for (std::size_t i = first; i < last; ++i)
    {
      Include(ExtentOf(cloud, this->Tree.Begin(level, tree) + i), below[lowest - 1 - level]);
    }
  }
  Node& node = this->Nodes[entry];
  node.LeafSigma = lowest == 0 ? node.Extent.Sigma : below[lowest - 1].Sigma;
}

/// Fills an entry from those of the node's children.
void ClusterBounds::FillAbove(int tree, int level, std::size_t j)
{
  const std::size_t entry = this->Begins[level][tree] + j;
  NodeExtent* below = this->Extents.data() + LevelsBelow * entry;
  const std::size_t last = std::min<std::size_t>(2 * j + 2, this->Tree.Count(level - 1, tree));
  for (std::size_t child = 2 * j; child < last; ++child)
  {
    const Node& node = this->Get(level - 1, tree, child);
    const NodeExtent* further = this->Below(level - 1, tree, child);
    Include(node.Extent, below[0]);
    for (int i = 1; i < LevelsBelow; ++i)
    {
      Include(further[i - 1], below[i]);
    }
    this->Nodes[entry].LeafSigma = std::max(this->Nodes[entry].LeafSigma, node.LeafSigma);
  }
}

void ClusterBounds::FillNode(const SurfelCloud& cloud, int tree, int level, std::size_t j)
{
  const std::size_t i = this->Tree.Begin(level, tree) + j;
  Node& node = this->Nodes[this->Begins[level][tree] + j];
  const Vector3 p = cloud.Position(i), a = cloud.AreaVector(i);
  const double length = Norm(a);
  for (int c = 0; c < 3; ++c)
  {
    node.Position[c] = static_cast<float>(p[c]);
    node.Axis[c] = static_cast<float>(length > 0.0 ? a[c] / length : 0.0);
  }
  node.Cone = cloud.IsNode(i)                ? static_cast<float>(ConeOf(cloud.Node(i)))
    : cloud.IsTwoSided(i) || !(length > 0.0) ? -1.0f
                                             : 1.0f;
  node.Extent = ExtentOf(cloud, i);
  node.LeafSigma = 0.0f;
}
}
