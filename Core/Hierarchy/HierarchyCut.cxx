// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Hierarchy/HierarchyCut.h"

#include "Core/Base/MemoryGuard.h"
#include "Core/Hierarchy/ClusterBounds.h"
#include "Core/Hierarchy/CutDetail.h"
#include "Core/Hierarchy/CutView.h"

#include <algorithm>
#include <cmath>

namespace SurfelSplatting
{
namespace
{
using Subtree = CutWork::Subtree;

/// Selects the cut of one cloud.
class CutSelector
{
public:
  CutSelector(const SurfelCloud& cloud, const CutCamera& camera, const CutSettings& settings)
    : Table(*cloud.Clusters)
    , Layout(Table.Layout())
    , Guard(cloud.Guard)
    , Settings(settings)
    , Seen(cloud, camera, settings)
    , Detail(cloud, camera, settings, Seen)
  {
  }

  void Walk(const Subtree& start, CutWork::Part& part) const
  {
    part.Runs.clear();
    part.Statistics = CutStatistics();
    part.Stack.assign(1, start);
    while (!part.Stack.empty())
    {
      const Subtree top = part.Stack.back();
      part.Stack.pop_back();
      this->Visit(top, part);
    }
  }

private:
  void Visit(const Subtree& at, CutWork::Part& part) const
  {
    CutStatistics& statistics = part.Statistics;
    ++statistics.VisitedNodes;
    const ClusterBounds::Node& node = this->Table.Get(at.Level, at.Tree, at.Index);
    if (this->Guard)
    {
      this->Guard->Need(&node, sizeof(node));
      this->Guard->Need(this->Table.Below(at.Level, at.Tree, at.Index),
        ClusterBounds::LevelsBelow * sizeof(NodeExtent));
    }
    const NodeBall ball = this->Seen.BallOf(node);
    if (this->Settings.SkipOutside && this->Seen.IsOutside(node, ball))
    {
      statistics.OutsideLeaves += this->LeavesOf(at);
      return;
    }
    if (this->Settings.SkipBackFaces && at.Tree == HierarchyLayout::OneSided &&
      this->Seen.FacesAway(node, ball))
    {
      statistics.BackLeaves += this->LeavesOf(at);
      return;
    }
    const double level = this->Detail.LevelOf(at, ball);
    if (this->Detail.IsNear(at, level))
    {
      this->Choose(at, std::fmax(level, 0.0), ball, part);
      return;
    }
    const Subtree left = this->Detail.Below(at, level);
    if (left.Index + 1 < this->Layout.Count(left.Level, at.Tree))
    {
      part.Stack.push_back(left);
      ++part.Stack.back().Index;
    }
    part.Stack.push_back(left);
  }

  std::uint64_t LeavesOf(const Subtree& at) const
  {
    return std::min<std::uint64_t>(
             (at.Index + 1) << at.Level, this->Layout.NumberOfLeaves(at.Tree)) -
      (at.Index << at.Level);
  }

  /// Chooses the nodes of a subtree at a level; its fraction is the share to which they merge.
  void Choose(const Subtree& at, double detail, const NodeBall& ball, CutWork::Part& part) const
  {
    const int level = static_cast<int>(detail);
    const int below = at.Level - level;
    const std::size_t first = at.Index << below;
    const std::size_t last =
      std::min<std::size_t>((at.Index + 1) << below, this->Layout.Count(level, at.Tree));
    CutRange run{ this->Layout.Begin(level, at.Tree) + first,
      static_cast<std::uint32_t>(last - first), static_cast<std::uint32_t>(level) };
    run.FirstLeaf = static_cast<std::uint64_t>(first) << level;
    run.Merging = static_cast<float>(detail - level);
    if (run.Merging > 0.0f)
    {
      run.Parents = this->Layout.Begin(level + 1, at.Tree) + first / 2;
    }
    this->Seen.Bound(this->Detail.DeviationsOf(at, run), ball, run);
    if (this->Settings.SkipOutside && IsEmpty(run.Box))
    {
      part.Statistics.OutsideLeaves += this->LeavesOf(at);
      return;
    }
    part.Statistics.Nodes += run.Count;
    part.Runs.push_back(run);
  }

  const ClusterBounds& Table;
  const HierarchyLayout& Layout;
  const MemoryGuard* Guard;
  CutSettings Settings;
  CutView Seen;
  CutDetail Detail;
};

/// Enough subtrees to keep all threads busy, in the order of the leaves.
void MakeSubtrees(const ClusterBounds& table, std::vector<Subtree>& subtrees)
{
  constexpr int levelsBelowRoot = 7;
  subtrees.clear();
  for (int tree = 0; tree < HierarchyLayout::NumberOfTrees; ++tree)
  {
    const int root = table.Layout().RootLevel(tree);
    if (root < 0)
    {
      continue;
    }
    const int level = std::max(table.LowestLevel(tree), root - levelsBelowRoot);
    for (std::size_t j = 0; j < table.Layout().Count(level, tree); ++j)
    {
      subtrees.push_back({ tree, level, j, 0.0, HierarchyLayout::MaximumNumberOfLevels });
    }
  }
}
}

CutStatistics SelectCut(const SurfelCloud& cloud, const CutCamera& camera,
  const CutSettings& settings, const Executor& executor, CutWork& work, std::vector<CutRange>& runs)
{
  const CutSelector selector(cloud, camera, settings);
  MakeSubtrees(*cloud.Clusters, work.Subtrees);
  work.Parts.resize(std::max(work.Parts.size(), work.Subtrees.size()));
  executor.For(work.Subtrees.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
    {
      selector.Walk(work.Subtrees[i], work.Parts[i]);
    }
  });
  CutStatistics statistics;
  runs.clear();
  for (std::size_t i = 0; i < work.Subtrees.size(); ++i)
  {
    const CutWork::Part& part = work.Parts[i];
    runs.insert(runs.end(), part.Runs.begin(), part.Runs.end());
    statistics.Add(part.Statistics);
  }
  return statistics;
}
}
