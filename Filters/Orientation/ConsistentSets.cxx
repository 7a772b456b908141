// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Orientation/ConsistentSets.h"

#include "Filters/Common/ParityUnionFind.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>

namespace SurfelGeometry
{
ConsistentSets CollectSets(int count, ParityUnionFind& signs)
{
  std::vector<int> numbers(count, -1); // of the roots' sets
  ConsistentSets sets;
  sets.Starts.push_back(0);
  for (int i = 0; i < count; ++i)
  {
    const int root = signs.Find(i).first;
    if (numbers[root] < 0)
    {
      numbers[root] = sets.Count();
      sets.Starts.push_back(sets.Starts.back() + signs.Size(root));
    }
  }
  sets.Ids.resize(count);
  for (int i = 0; i < count; ++i)
  {
    sets.Ids[sets.Starts[numbers[signs.FindReadOnly(i).first]]++] = i;
  }
  // Each start is the next one's now.
  std::copy_backward(sets.Starts.begin(), sets.Starts.end() - 1, sets.Starts.end());
  sets.Starts.front() = 0;
  return sets;
}

double ConflictOf(const NeighborGraph& graph, const EdgeVotes& edges, const ParityUnionFind& signs,
  const int* ids, int count)
{
  // Votes as integers, in units of 2^-24: their sums do not depend on the order.
  constexpr double unit = 1.0 / (1 << 24);
  std::atomic<std::int64_t> against{ 0 }, all{ 0 };
  ForPieces(count, [&](vtkIdType, vtkIdType first, vtkIdType end) {
    std::int64_t pieceAgainst = 0, pieceAll = 0;
    for (vtkIdType m = first; m < end; ++m)
    {
      const auto [rootA, flipA] = signs.FindReadOnly(ids[m]);
      const float* votes = edges.Votes.data() + GraphDegree * static_cast<std::size_t>(ids[m]);
      const int* row = graph.Row(static_cast<std::size_t>(ids[m]));
      // Half of the votes are 0. They count for nothing, without a branch.
      for (int k = 0; k < GraphDegree && row[k] >= 0; ++k)
      {
        const auto [rootB, flipB] = signs.FindReadOnly(row[k]);
        const std::int64_t vote =
          rootA == rootB ? static_cast<std::int64_t>(std::abs(votes[k]) / unit) : 0;
        pieceAll += vote;
        pieceAgainst += (flipA != flipB) != (votes[k] < 0.0f) ? vote : 0;
      }
    }
    against.fetch_add(pieceAgainst, std::memory_order_relaxed);
    all.fetch_add(pieceAll, std::memory_order_relaxed);
  });
  return all > 0 ? static_cast<double>(against) / static_cast<double>(all) : 1.0;
}
}
