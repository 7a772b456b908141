// SPDX-License-Identifier: BSD-3-Clause
/**
 * Layout of a hierarchy's nodes: an implicit binary tree.
 *
 * The leaves are in the order of the tree (KdTreeOrder.h): node j of level l represents the leaves
 * [j 2^l, (j + 1) 2^l), and the last node those that remain. There are no pointers: the children of
 * (l, j) are (l - 1, 2j) and (l - 1, 2j + 1). One-sided and two-sided surfels have separate trees.
 * Nodes are stored level by level, leaves first; within a level the one-sided tree comes first.
 * There are fewer than two nodes per leaf, plus one per level.
 *
 *   index: | leaves: one-sided, two-sided | level 1: one-sided, two-sided | ... | roots |
 */
#pragma once

#include <array>
#include <cstdint>

namespace SurfelSplatting
{
class HierarchyLayout
{
public:
  static constexpr int MaximumNumberOfLevels = 40;

  enum Tree
  {
    OneSided = 0,
    TwoSided = 1,
    NumberOfTrees = 2
  };

  HierarchyLayout() = default;
  HierarchyLayout(std::uint64_t oneSided, std::uint64_t twoSided)
    : Leaves{ { oneSided, twoSided } }
  {
    std::uint64_t offset = 0;
    for (int level = 0; level < MaximumNumberOfLevels; ++level)
    {
      this->Begins[level] = { offset, offset + this->Count(level, OneSided) };
      offset = this->Begins[level][1] + this->Count(level, TwoSided);
      this->Levels = level + 1;
      if (this->Count(level, OneSided) <= 1 && this->Count(level, TwoSided) <= 1)
      {
        break;
      }
    }
    this->Nodes = offset;
    this->Levels = offset > 0 ? this->Levels : 0;
  }

  std::uint64_t NumberOfLeaves() const { return this->Leaves[0] + this->Leaves[1]; }
  std::uint64_t NumberOfLeaves(int tree) const { return this->Leaves[tree]; }
  std::uint64_t NumberOfNodes() const { return this->Nodes; } ///< leaves included
  /// Number of nodes above the leaves.
  std::uint64_t NumberOfInnerNodes() const { return this->Nodes - this->NumberOfLeaves(); }
  int NumberOfLevels() const { return this->Levels; }

  /// Index of a level's first node in a tree.
  std::uint64_t Begin(int level, int tree) const { return this->Begins[level][tree]; }
  /// Number of a level's nodes in a tree.
  std::uint64_t Count(int level, int tree) const
  {
    const std::uint64_t leaves = this->Leaves[tree];
    return (leaves >> level) + ((leaves & ((std::uint64_t{ 1 } << level) - 1)) != 0 ? 1 : 0);
  }
  struct Range
  {
    std::uint64_t Begin, Count;
  };
  /// The ancestors, `levels` higher, of consecutive nodes of a level and a tree. There are such
  /// levels.
  Range Above(int level, const Range& nodes, int levels) const
  {
    const int tree = nodes.Begin < this->Begin(level, TwoSided) ? OneSided : TwoSided;
    const std::uint64_t first = nodes.Begin - this->Begin(level, tree);
    const std::uint64_t begin = first >> levels;
    const std::uint64_t last = (first + nodes.Count - 1) >> levels;
    return { this->Begin(level + levels, tree) + begin, last - begin + 1 };
  }
  /// Level of a tree's root; -1 for an empty tree.
  int RootLevel(int tree) const
  {
    int level = this->Leaves[tree] > 0 ? 0 : -1;
    while (level >= 0 && this->Count(level, tree) > 1)
    {
      ++level;
    }
    return level;
  }

private:
  std::array<std::uint64_t, NumberOfTrees> Leaves{ { 0, 0 } };
  std::array<std::array<std::uint64_t, NumberOfTrees>, MaximumNumberOfLevels> Begins{};
  std::uint64_t Nodes = 0;
  int Levels = 0;
};
}
