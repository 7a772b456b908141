// SPDX-License-Identifier: BSD-3-Clause
/**
 * Disjoint sets whose members have signs relative to each other.
 */
#pragma once

#include "Filters/Common/Intrinsics.h"

#include <cstddef>
#include <utility>
#include <vector>

namespace SurfelGeometry
{
/// Union-find with parity: it knows for two members of a set whether their signs differ.
class ParityUnionFind
{
public:
  explicit ParityUnionFind(int count)
    : Parents(count, -1)
    , Flips(count, 0)
  {
  }

  /// Root of i's set, and whether i's sign differs from the root's. Shortens the path.
  std::pair<int, bool> Find(int i)
  {
    int root = i;
    bool flip = false;
    while (this->Parents[root] >= 0)
    {
      flip ^= this->Flips[root] != 0;
      root = this->Parents[root];
    }
    const bool result = flip;
    while (i != root && this->Parents[i] != root)
    {
      const int next = this->Parents[i];
      const bool own = this->Flips[i] != 0;
      this->Parents[i] = root;
      this->Flips[i] = flip;
      flip ^= own;
      i = next;
    }
    return { root, result };
  }

  /// The same without shortening the path, so that threads may call it at the same time.
  std::pair<int, bool> FindReadOnly(int i) const
  {
    bool flip = false;
    for (; this->Parents[i] >= 0; i = this->Parents[i])
    {
      flip ^= this->Flips[i] != 0;
    }
    return { i, flip };
  }

  /// [count] 1: the sign of the root is opposite. Valid until sets are joined, after Flatten(), or
  /// Find() of all.
  const std::vector<char>& FlatFlips() const { return this->Flips; }

  /// Shortens all paths.
  void Flatten()
  {
    for (size_t i = 0; i < this->Parents.size(); ++i)
    {
      this->Find(static_cast<int>(i));
    }
  }

  /// Joins the sets of a and b so that the signs of a and b are equal, or differ. No effect within
  /// a set. Returns whether there were two sets.
  bool Join(int a, int b, bool differ)
  {
    auto [rootA, flipA] = this->Find(a);
    auto [rootB, flipB] = this->Find(b);
    if (rootA == rootB)
    {
      return false;
    }
    // The larger set keeps its root; if the sizes are equal, the smaller index does.
    const int sizeA = this->Size(rootA), sizeB = this->Size(rootB);
    if (sizeA < sizeB || (sizeA == sizeB && rootB < rootA))
    {
      std::swap(rootA, rootB);
    }
    this->Parents[rootB] = rootA;
    this->Flips[rootB] = flipA ^ flipB ^ differ;
    this->Parents[rootA] = -(sizeA + sizeB);
    return true;
  }

  /// Starts loading what Find(i) reads first.
  void Prefetch(int i) const
  {
    SURFEL_PREFETCH(this->Parents.data() + i);
    SURFEL_PREFETCH(this->Flips.data() + i);
  }

  /// Number of members of the set with this root.
  int Size(int root) const { return -this->Parents[root]; }

private:
  std::vector<int> Parents; // of a root: minus the size of its set
  std::vector<char> Flips;  // relative to the parent
};
}
