// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Orientation/ConsistentSets.h"

#include "Filters/Orientation/ParityUnionFind.h"

#include <atomic>
#include <cmath>
#include <cstdint>

namespace SurfelGeometry
{
ConsistentSets CollectSets(const std::vector<PlaneFit>& fits, ParityUnionFind& signs)
{
  const int count = static_cast<int>(fits.size());
  std::vector<int> numbers(count, -1); // of the roots
  ConsistentSets sets;
  sets.Numbers.resize(count);
  sets.Normals.resize(count);
  sets.Starts.push_back(0);
  for (int i = 0; i < count; ++i)
  {
    const auto [root, flip] = signs.Find(i);
    if (numbers[root] < 0)
    {
      numbers[root] = sets.Count();
      sets.Starts.push_back(sets.Starts.back() + signs.Size(root));
    }
    sets.Numbers[i] = numbers[root];
    sets.Normals[i] = flip ? Float3(-1.0 * fits[i].Normal) : fits[i].Normal;
  }
  std::vector<int> next(sets.Starts.begin(), sets.Starts.end() - 1);
  sets.Ids.resize(count);
  for (int i = 0; i < count; ++i)
  {
    sets.Ids[next[sets.Numbers[i]]++] = i;
  }
  return sets;
}

std::vector<double> Conflicts(const NeighborGraph& graph, const EdgeVotes& edges,
  const ConsistentSets& sets, const ParityUnionFind& signs)
{
  // Votes as integers, in units of 2^-24: their sums do not depend on the order.
  constexpr double unit = 1.0 / (1 << 24);
  using Sums = std::vector<std::atomic<std::int64_t>>;
  Sums against(sets.Count()), all(sets.Count());
  ForPieces(edges.Count(), [&](vtkIdType, vtkIdType first, vtkIdType end) {
    int last = -1; // set of the sums below
    std::int64_t lastAgainst = 0, lastAll = 0;
    const auto flush = [&](int next) {
      if (last >= 0)
      {
        against[last].fetch_add(lastAgainst, std::memory_order_relaxed);
        all[last].fetch_add(lastAll, std::memory_order_relaxed);
      }
      last = next;
      lastAgainst = lastAll = 0;
    };
    VisitVotes(graph, edges, first, end, [&](const Edge& edge) {
      const int c = sets.Numbers[edge.A];
      if (c == sets.Numbers[edge.B])
      {
        if (c != last)
        {
          flush(c);
        }
        const bool differ = signs.FindReadOnly(edge.A).second != signs.FindReadOnly(edge.B).second;
        const auto vote = static_cast<std::int64_t>(std::abs(edge.Vote) / unit);
        lastAll += vote;
        lastAgainst += differ != (edge.Vote < 0.0f) ? vote : 0;
      }
    });
    flush(-1);
  });
  std::vector<double> shares(all.size());
  for (size_t c = 0; c < all.size(); ++c)
  {
    const double sum = static_cast<double>(all[c]);
    shares[c] = sum > 0.0 ? static_cast<double>(against[c]) / sum : 1.0;
  }
  return shares;
}
}
