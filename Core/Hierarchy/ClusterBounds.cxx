// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Hierarchy/ClusterBounds.h"

#include "Core/Surfels/NodeMoments.h"

#include <algorithm>
#include <array>
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

/// Sums up the extents of nodes.
class ExtentSum
{
public:
  /// @param largest whether Sigma is the largest one
  explicit ExtentSum(bool largest = false)
    : Largest(largest)
  {
  }

  /// Adds some, or one. @param count of them
  void Add(const NodeExtent& extent, double count)
  {
    const double variance = static_cast<double>(extent.Sigma) * extent.Sigma;
    this->Count += count;
    this->Fourth += count * variance * variance;
    this->All.Sigma = std::max(this->All.Sigma, extent.Sigma);
    this->All.Size = std::max(this->All.Size, extent.Size);
    this->All.Coherence = std::min(this->All.Coherence, extent.Coherence);
  }

  NodeExtent Get() const
  {
    if (this->Largest)
    {
      return this->All;
    }
    const double mean = this->Fourth / std::fmax(this->Count, 1.0);
    return { static_cast<float>(std::sqrt(std::sqrt(mean))), this->All.Size, this->All.Coherence };
  }

private:
  bool Largest;
  NodeExtent All = NoExtent;
  double Count = 0.0, Fourth = 0.0;
};

/// Of a node or a leaf.
NodeExtent ExtentOf(const SurfelCloud& cloud, std::size_t i)
{
  NodeExtent extent = NoExtent;
  const Symmetric3 s = cloud.Covariance(i);
  const double variance = cloud.IsInSpace() ? s.LargestEigenvalue() : std::sqrt(s.SquaredNorm());
  extent.Sigma =
    std::isfinite(variance) ? static_cast<float>(std::sqrt(std::fmax(0.0, variance))) : 0.0f;
  if (cloud.IsNode(i))
  {
    const HierarchyNode& node = cloud.Node(i);
    extent.Size = std::max(0.0f, node.Bound);
    const float coherence = cloud.IsInSpace()
      ? ShareOfPlaces(cloud, node)
      : static_cast<float>(Coherence(AreaVectorOf(node), node.Area));
    extent.Coherence = std::min(1.0f, coherence);
  }
  return extent;
}

/// Raises a standard deviation to the largest of a leaf.
void IncludeSigma(const SurfelCloud& cloud, std::size_t i, float& largest)
{
  const Symmetric3 s = cloud.Covariance(i);
  const double variance = static_cast<double>(largest) * largest;
  // No eigenvalue is above the Frobenius norm: most are known not to be the largest.
  if (s.SquaredNorm() > (1.0 - 1e-6) * variance * variance)
  {
    const double sigma = std::sqrt(std::fmax(0.0, s.LargestEigenvalue()));
    largest = std::max(largest, static_cast<float>(sigma));
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
  node.Extent = ExtentOf(cloud, i);
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
    ExtentSum sum(this->Cloud.IsInSpace());
    for (std::size_t i = first; i < last; ++i)
    {
      sum.Add(ExtentOf(this->Cloud, layout.Begin(level, tree) + i), 1.0);
    }
    below[lowest - 1 - level] = sum.Get();
  }
  const std::size_t end = std::min<std::size_t>((j + 1) << lowest, layout.Count(0, tree));
  for (std::size_t i = j << lowest; i < end; ++i)
  {
    IncludeSigma(this->Cloud, layout.Begin(0, tree) + i, this->Nodes[entry].LeafSigma);
  }
}

/// Fills an entry from those of the node's children.
void ClusterBounds::Filler::FillAbove(int tree, int level, std::size_t j) const
{
  const auto& begins = this->Bounds.Begins;
  const std::size_t entry = begins[level][tree] + j;
  NodeExtent* below = this->Extents + LevelsBelow * entry;
  const HierarchyLayout& layout = this->Bounds.Tree;
  const std::size_t last = std::min<std::size_t>(2 * j + 2, layout.Count(level - 1, tree));
  std::array<ExtentSum, LevelsBelow> sums;
  sums.fill(ExtentSum(this->Cloud.IsInSpace()));
  for (std::size_t i = 2 * j; i < last; ++i)
  {
    const std::size_t child = begins[level - 1][tree] + i;
    const NodeExtent* further = this->Extents + LevelsBelow * child;
    sums[0].Add(this->Nodes[child].Extent, 1.0);
    for (int k = 1; k < LevelsBelow; ++k)
    {
      const std::size_t end =
        std::min<std::size_t>((i + 1) << k, layout.Count(level - 1 - k, tree));
      sums[k].Add(further[k - 1], static_cast<double>(end - (i << k)));
    }
    this->Nodes[entry].LeafSigma =
      std::max(this->Nodes[entry].LeafSigma, this->Nodes[child].LeafSigma);
  }
  std::transform(sums.begin(), sums.end(), below, [](const ExtentSum& sum) { return sum.Get(); });
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
