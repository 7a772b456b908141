// SPDX-License-Identifier: BSD-3-Clause
#include "DetailTable.h"

#include "NodeMoments.h"

#include <algorithm>
#include <cmath>

namespace SurfelSplatting
{
namespace
{
constexpr std::size_t Grain = 64;
}

struct DetailTable::Source
{
  const SurfelCloud& Cloud;
  const float* Areas;
  const float* Bounds;
  const float* Cones;

  NodeExtent Extent(std::size_t i) const
  {
    const double variance = this->Cloud.Covariance(i).LargestEigenvalue();
    return { static_cast<float>(std::sqrt(std::fmax(0.0, variance))), this->Bounds[i],
      static_cast<float>(Coherence(this->Cloud.AreaVector(i), this->Areas[i])) };
  }
};

DetailTable::DetailTable(const SurfelCloud& cloud, const HierarchyLayout& layout,
  const float* areas, const float* bounds, const float* cones, const Executor& executor)
  : Tree(layout)
{
  const Source source{ cloud, areas, bounds, cones };
  for (int tree = 0; tree < HierarchyLayout::NumberOfTrees; ++tree)
  {
    const int root = layout.RootLevel(tree);
    if (root < 0)
    {
      continue;
    }
    const int lowest = std::min(ClusterLevel, root);
    this->LowestLevels[tree] = lowest;
    this->FirstCluster[tree] = this->ClusterLevels.size() / ClusterLevel;
    this->ClusterLevels.resize(
      this->ClusterLevels.size() + ClusterLevel * layout.Count(lowest, tree));
    for (int level = lowest; level <= root; ++level)
    {
      this->Begins[level][tree] = this->Nodes.size();
      this->Nodes.resize(this->Nodes.size() + layout.Count(level, tree));
      executor.For(layout.Count(level, tree), Grain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t j = begin; j < end; ++j)
        {
          if (level == lowest)
          {
            this->FillCluster(source, tree, j);
          }
          this->FillNode(source, tree, level, j);
        }
      });
    }
  }
}

void DetailTable::FillCluster(const Source& source, int tree, std::size_t j)
{
  NodeExtent* levels = this->ClusterLevels.data() + ClusterLevel * (this->FirstCluster[tree] + j);
  const int lowest = this->LowestLevels[tree];
  for (int level = 0; level < lowest; ++level)
  {
    const std::size_t first = j << (lowest - level);
    const std::size_t last =
      std::min<std::size_t>((j + 1) << (lowest - level), this->Tree.Count(level, tree));
    NodeExtent& largest = levels[level] = { 0.0f, 0.0f, 1.0f };
    for (std::size_t i = first; i < last; ++i)
    {
      const NodeExtent extent = source.Extent(this->Tree.Begin(level, tree) + i);
      largest.Sigma = std::max(largest.Sigma, extent.Sigma);
      largest.Size = std::max(largest.Size, extent.Size);
      largest.Coherence = std::min(largest.Coherence, extent.Coherence);
    }
  }
}

void DetailTable::FillNode(const Source& source, int tree, int level, std::size_t j)
{
  const std::size_t i = this->Tree.Begin(level, tree) + j;
  Node& node = this->Nodes[this->Begins[level][tree] + j];
  const Vector3 p = source.Cloud.Position(i), a = source.Cloud.AreaVector(i);
  const double length = Norm(a);
  for (int c = 0; c < 3; ++c)
  {
    node.Position[c] = static_cast<float>(p[c]);
    node.Axis[c] = static_cast<float>(length > 0.0 ? a[c] / length : 0.0);
  }
  node.Cone = source.Cones[i];
  node.Extent = source.Extent(i);
  const int lowest = this->LowestLevels[tree];
  node.LeafSigma = level == 0 ? node.Extent.Sigma
    : level == lowest         ? this->Levels(tree, j)[0].Sigma
                              : 0.0f;
  if (level > lowest)
  {
    const std::size_t last = std::min<std::size_t>(2 * j + 2, this->Tree.Count(level - 1, tree));
    for (std::size_t child = 2 * j; child < last; ++child)
    {
      node.LeafSigma = std::max(node.LeafSigma, this->Get(level - 1, tree, child).LeafSigma);
    }
  }
}
}
