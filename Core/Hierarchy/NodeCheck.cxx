// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Hierarchy/NodeCheck.h"

#include "Core/Hierarchy/HierarchyBuilder.h"
#include "Core/Hierarchy/SheetOverlap.h"
#include "Core/Surfels/NodeMoments.h"

#include <atomic>
#include <cmath>

namespace SurfelSplatting
{
namespace
{
constexpr std::size_t NodesAtATime = 4096; // of a thread

/// A change by this fraction is not seen, nor is it one of what is packed.
constexpr double UnseenChange = 1.0 / 256.0;

NodeMoments KernelMoments(const SurfelCloud& tree, std::size_t i)
{
  NodeMoments m;
  m.Area = tree.Area(i);
  m.AreaVector =
    tree.Normals && !tree.IsNode(i) ? WeightedNormal(tree, i, m.Area) : tree.AreaVector(i);
  m.Position = tree.Position(i);
  m.Covariance = tree.Covariance(i);
  m.Opacity = tree.OwnOpacity(i);
  return m;
}

double WidthOf(const NodeMoments& m)
{
  return m.Covariance.XX + m.Covariance.YY + m.Covariance.ZZ;
}

/// NaN counts as unchanged.
bool HasChanged(double before, double now)
{
  return std::abs(now - before) > UnseenChange * std::fmax(std::abs(now), std::abs(before));
}

/// The signs of area vectors of two-sided nodes have no meaning.
bool HasTurned(const NodeMoments& before, const NodeMoments& now, bool isTwoSided)
{
  const double unseen = UnseenChange * now.Area;
  return Norm(now.AreaVector - before.AreaVector) > unseen &&
    (!isTwoSided || Norm(now.AreaVector + before.AreaVector) > unseen);
}

bool IsNodeOf(const SurfelCloud& tree, std::size_t node, const NodeMoments& leaves)
{
  const NodeMoments stored = KernelMoments(tree, node);
  return !HasChanged(stored.Area, leaves.Area) && !HasChanged(WidthOf(stored), WidthOf(leaves)) &&
    !(std::abs(stored.Opacity - leaves.Opacity) > UnseenChange) &&
    (tree.Kind == CloudKind::Capture || !HasTurned(stored, leaves, tree.IsTwoSided(node)));
}
}

bool AreNodesOfKernels(
  const SurfelCloud& tree, const HierarchyLayout& layout, const Executor& executor)
{
  std::atomic<bool> same{ true };
  for (const int side : { HierarchyLayout::OneSided, HierarchyLayout::TwoSided })
  {
    const std::uint64_t nodes = layout.RootLevel(side) > 0 ? layout.Count(1, side) : 0;
    executor.For(nodes, NodesAtATime, [&](std::size_t begin, std::size_t end) {
      for (std::size_t j = begin; j < end && same; ++j)
      {
        const std::size_t first = layout.Begin(0, side) + 2 * j;
        NodeMoments leaves = KernelMoments(tree, first);
        if (2 * j + 1 < layout.Count(0, side))
        {
          leaves = Join(leaves, KernelMoments(tree, first + 1), side == HierarchyLayout::TwoSided);
        }
        if (!IsNodeOf(tree, layout.Begin(1, side) + j, leaves))
        {
          same = false;
        }
      }
    });
  }
  return same && AreSheetOverlaps(tree, layout, executor, UnseenChange);
}

bool AreSidesOfTrees(const SurfelCloud& leaves, const HierarchyLayout& layout)
{
  for (std::size_t i = 0; i < layout.NumberOfLeaves(); ++i)
  {
    if (leaves.IsTwoSided(i) != (i >= layout.NumberOfLeaves(HierarchyLayout::OneSided)))
    {
      return false;
    }
  }
  return true;
}
}
