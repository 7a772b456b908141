// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Hierarchy/ClusterBounds.h"

#include "Core/Surfels/NodeMoments.h"

#include <algorithm>
#include <cmath>

namespace SurfelSplatting
{
namespace
{
constexpr std::size_t NodeGrain = 64;

/// NodeExtent::Coherence of a node of Gaussians, whose leaves are taken to have its shape.
float ShareOfPlaces(const SurfelCloud& cloud, const HierarchyNode& node)
{
  if (cloud.Kind == CloudKind::Volume)
  {
    return 1.0f;
  }
  const double scale = node.Normal[0] / PackedOne; // LeafScale
  return static_cast<float>(1.0 - scale * scale);
}

constexpr NodeExtent NoExtent{ 0.0f, 0.0f, 1.0f };

void Include(const NodeExtent& extent, NodeExtent& largest)
{
  largest.Sigma = std::max(largest.Sigma, extent.Sigma);
  largest.Size = std::max(largest.Size, extent.Size);
  largest.Coherence = std::min(largest.Coherence, extent.Coherence);
}

/// Includes a node or a leaf.
void Include(const SurfelCloud& cloud, std::size_t i, NodeExtent& largest)
{
  const Symmetric3 s = cloud.Covariance(i);
  const double variance = static_cast<double>(largest.Sigma) * largest.Sigma;
  // No eigenvalue is above the Frobenius norm: most are known not to be the largest.
  if (s.SquaredNorm() > (1.0 - 1e-6) * variance * variance)
  {
    const double sigma = std::sqrt(std::fmax(0.0, s.LargestEigenvalue()));
    largest.Sigma = std::max(largest.Sigma, static_cast<float>(sigma));
  }
  if (cloud.IsNode(i))
  {
    const HierarchyNode& node = cloud.Node(i);
    const float coherence = cloud.IsInSpace()
      ? ShareOfPlaces(cloud, node)
      : static_cast<float>(Coherence(AreaVectorOf(node), node.Area));
    largest.Size = std::max(largest.Size, node.Bound);
    largest.Coherence = std::min(largest.Coherence, coherence);
  }
}
}

/// Computes the entries of a cloud.
class ClusterBounds::Filler
{
public:
  Filler(const SurfelCloud& cloud, const ClusterBounds& bounds, Node* nodes, NodeExtent* extents)
    : Cloud(cloud)
    , Bounds(bounds)
    , Nodes(nodes)
    , Extents(extents)
  {
  }

  /// Fills an entry of the lowest level or, after the entries below, of another level.
  void Fill(int tree, int level, std::size_t j) const
  {
    this->FillNode(tree, level, j);
    if (level == this->Bounds.LowestLevels[tree])
    {
      this->FillCluster(tree, j);
    }
    else
    {
      this->FillAbove(tree, level, j);
    }
  }

private:
  void FillNode(int tree, int level, std::size_t j) const;
  void FillCluster(int tree, std::size_t j) const;
  void FillAbove(int tree, int level, std::size_t j) const;

  const SurfelCloud& Cloud;
  const ClusterBounds& Bounds;
  Node* const Nodes;
  NodeExtent* const Extents;
};

void ClusterBounds::Filler::FillNode(int tree, int level, std::size_t j) const
{
  const SurfelCloud& cloud = this->Cloud;
  const std::size_t i = this->Bounds.Tree.Begin(level, tree) + j;
  Node& node = this->Nodes[this->Bounds.Begins[level][tree] + j];
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
  node.Extent = NoExtent;
  Include(cloud, i, node.Extent);
  node.LeafSigma = 0.0f;
}

void ClusterBounds::Filler::FillCluster(int tree, std::size_t j) const
{
  const HierarchyLayout& layout = this->Bounds.Tree;
  const int lowest = this->Bounds.LowestLevels[tree];
  const std::size_t entry = this->Bounds.Begins[lowest][tree] + j;
  NodeExtent* below = this->Extents + LevelsBelow * entry;
  std::fill_n(below, LevelsBelow, NoExtent);
  for (int level = lowest - 1; level >= 0; --level)
  {
    const std::size_t first = j << (lowest - level);
    const std::size_t last =
      std::min<std::size_t>((j + 1) << (lowest - level), layout.Count(level, tree));
    for (std::size_t i = first; i < last; ++i)
    {
      Include(this->Cloud, layout.Begin(level, tree) + i, below[lowest - 1 - level]);
    }
  }
  Node& node = this->Nodes[entry];
  node.LeafSigma = lowest == 0 ? node.Extent.Sigma : below[lowest - 1].Sigma;
}

/// Fills an entry from those of the node's children.
void ClusterBounds::Filler::FillAbove(int tree, int level, std::size_t j) const
{
  const auto& begins = this->Bounds.Begins;
  const std::size_t entry = begins[level][tree] + j;
  NodeExtent* below = this->Extents + LevelsBelow * entry;
  std::fill_n(below, LevelsBelow, NoExtent);
  const std::size_t last =
    std::min<std::size_t>(2 * j + 2, this->Bounds.Tree.Count(level - 1, tree));
  for (std::size_t i = 2 * j; i < last; ++i)
  {
    const std::size_t child = begins[level - 1][tree] + i;
    const NodeExtent* further = this->Extents + LevelsBelow * child;
    Include(this->Nodes[child].Extent, below[0]);
    for (int k = 1; k < LevelsBelow; ++k)
    {
      Include(further[k - 1], below[k]);
    }
    this->Nodes[entry].LeafSigma =
      std::max(this->Nodes[entry].LeafSigma, this->Nodes[child].LeafSigma);
  }
}

ClusterBounds::ClusterBounds(const HierarchyLayout& layout)
  : Tree(layout)
{
  for (int tree = 0; tree < HierarchyLayout::NumberOfTrees; ++tree)
  {
    const int root = layout.RootLevel(tree);
    this->LowestLevels[tree] = std::min(ClusterLevel, root);
    for (int level = this->LowestLevels[tree]; level >= 0 && level <= root; ++level)
    {
      this->Begins[level][tree] = this->Entries;
      this->Entries += layout.Count(level, tree);
    }
  }
}

ClusterBounds::ClusterBounds(
  const SurfelCloud& cloud, const HierarchyLayout& layout, const Executor& executor)
  : ClusterBounds(layout)
{
  this->OwnNodes.resize(this->Entries);
  this->OwnExtents.resize(LevelsBelow * this->Entries);
  this->Nodes = this->OwnNodes.data();
  this->Extents = this->OwnExtents.data();
  Fill(cloud, layout, executor, this->OwnNodes.data(), this->OwnExtents.data());
}

ClusterBounds::ClusterBounds(
  const HierarchyLayout& layout, const Node* nodes, const NodeExtent* extents)
  : ClusterBounds(layout)
{
  this->Nodes = nodes;
  this->Extents = extents;
}

std::size_t ClusterBounds::NumberOfEntries(const HierarchyLayout& layout)
{
  return ClusterBounds(layout).Entries;
}

void ClusterBounds::Fill(const SurfelCloud& cloud, const HierarchyLayout& layout,
  const Executor& executor, Node* nodes, NodeExtent* extents)
{
  const ClusterBounds bounds(layout);
  const Filler filler(cloud, bounds, nodes, extents);
  for (int tree = 0; tree < HierarchyLayout::NumberOfTrees; ++tree)
  {
    const int root = layout.RootLevel(tree);
    for (int level = bounds.LowestLevels[tree]; level >= 0 && level <= root; ++level)
    {
      executor.For(layout.Count(level, tree), NodeGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t j = begin; j < end; ++j)
        {
          filler.Fill(tree, level, j);
        }
      });
    }
  }
}
}
