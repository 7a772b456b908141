// SPDX-License-Identifier: BSD-3-Clause
/**
 * Visits the nodes of a hierarchy from the leaves upwards, joins their values in full precision,
 * and stores one for each node.
 */
#pragma once

#include "Core/Base/Executor.h"
#include "Core/Hierarchy/HierarchyLayout.h"

#include <algorithm>
#include <cstddef>
#include <vector>

namespace SurfelSplatting
{
namespace NodeRecursion
{
/// Returns the value of node j of a level, after storing those of all nodes below and its own.
template <typename Filler>
typename Filler::Value Fill(
  const HierarchyLayout& layout, const Filler& filler, int tree, int level, std::size_t j)
{
  if (level == 0)
  {
    return filler.Leaf(layout.Begin(0, tree) + j);
  }
  typename Filler::Value value = Fill(layout, filler, tree, level - 1, 2 * j);
  if (2 * j + 1 < layout.Count(level - 1, tree))
  {
    value = filler.Join(value, Fill(layout, filler, tree, level - 1, 2 * j + 1), tree);
  }
  filler.Store(value, tree, level, j);
  return value;
}
}

/**
 * Calls filler.Store(value, tree, level, j) for all nodes above the leaves, children first. The
 * result is the same at any number of threads.
 * @param filler has a type Value, Leaf(i) of leaf i, and Join(a, b, tree) of two neighbours
 */
template <typename Filler>
void ForNodesUpwards(const HierarchyLayout& layout, const Executor& executor, const Filler& filler)
{
  constexpr int subtreeLevel = 10; // one thread visits a subtree of this level
  for (int tree = 0; tree < HierarchyLayout::NumberOfTrees; ++tree)
  {
    const int top = layout.NumberOfLevels() - 1;
    if (layout.NumberOfLeaves(tree) == 0)
    {
      continue;
    }
    int level = std::min(subtreeLevel, top);
    std::vector<typename Filler::Value> values(layout.Count(level, tree)), above;
    executor.For(values.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t j = begin; j < end; ++j)
      {
        values[j] = NodeRecursion::Fill(layout, filler, tree, level, j);
      }
    });
    for (++level; level <= top; ++level)
    {
      above.resize(layout.Count(level, tree));
      executor.For(above.size(), 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t j = begin; j < end; ++j)
        {
          above[j] = 2 * j + 1 < values.size() ? filler.Join(values[2 * j], values[2 * j + 1], tree)
                                               : values[2 * j];
          filler.Store(above[j], tree, level, j);
        }
      });
      values.swap(above);
    }
  }
}
}
