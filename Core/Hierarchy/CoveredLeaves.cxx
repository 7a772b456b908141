// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Hierarchy/CoveredLeaves.h"

#include "Core/Simd/Multiversion.h"

#include <algorithm>
#include <atomic>
#include <cmath>

namespace SurfelSplatting
{
namespace
{
/// Elements that are compared with one another: sheets less than about ten elements apart lie in
/// the same run.
constexpr std::size_t RunSize = 256;

/// Runs are of leaves, of nodes this many levels higher, and so on. Whatever the gap, at one of
/// these levels both sheets lie in a run, and each node holds only one of them.
constexpr int LevelsPerStep = 4;

/// An element covers another from this height on, in spacings of elements: a surface that only
/// bends stays below. Their normals have at least this cosine: those of a fold have less.
constexpr float GapOfSheets = 1.5f, CosineOfSheet = 0.8f;

/// Within a square, heights of one sheet differ by less than this share of GapOfSheets.
constexpr float ShareOfGap = 0.8f;

/// The elements of a run, in arrays for SIMD loops.
class Run
{
public:
  /// @param first index of a leaf or node of the tree
  void Load(const SurfelCloud& tree, std::size_t first, std::size_t count)
  {
    this->Count = count;
    const Vector3 origin = tree.Position(first); // floats resolve what is near
    for (std::size_t i = 0; i < count; ++i)
    {
      const Vector3 p = tree.Position(first + i) - origin, a = tree.AreaVector(first + i);
      const double length = Norm(a);
      const Vector3 n = (length > 0.0 ? 1.0 / length : 0.0) * a;
      const auto area = static_cast<float>(tree.Area(first + i));
      for (int c = 0; c < 3; ++c)
      {
        this->At[c][i] = static_cast<float>(p[c]);
        this->Normal[c][i] = static_cast<float>(n[c]);
      }
      this->Gap[i] = GapOfSheets * std::sqrt(area);
      this->PerReach[i] = area > 0.0f ? 1.0f / (3.0f * area) : Infinite;
    }
    for (std::size_t i = count; i < RunSize; ++i)
    {
      this->Normal[0][i] = this->Normal[1][i] = this->Normal[2][i] = 0.0f; // covers nothing
    }
  }

  /// Whether nowhere one element is far in front of another: most runs are parts of one sheet.
  bool IsOneSheet() const
  {
    float mean[3] = {}, gap = this->Gap[0];
    for (std::size_t i = 0; i < this->Count; ++i)
    {
      for (int c = 0; c < 3; ++c)
      {
        mean[c] += this->Normal[c][i];
      }
      gap = std::min(gap, this->Gap[i]);
    }
    // Heights along the mean normal, over squares of the two coordinates across which it is least.
    const int up = std::abs(mean[0]) > std::max(std::abs(mean[1]), std::abs(mean[2])) ? 0
      : std::abs(mean[1]) > std::abs(mean[2])                                         ? 1
                                                                                      : 2;
    const float(&x)[RunSize] = this->At[(up + 1) % 3], (&y)[RunSize] = this->At[(up + 2) % 3];
    const auto [leastX, mostX] = std::minmax_element(x, x + this->Count);
    const auto [leastY, mostY] = std::minmax_element(y, y + this->Count);
    const float square = std::max({ gap, (*mostX - *leastX) / Side, (*mostY - *leastY) / Side });
    const float length = std::sqrt(mean[0] * mean[0] + mean[1] * mean[1] + mean[2] * mean[2]);
    if (!(square > 0.0f) || !(length > 0.5f * static_cast<float>(this->Count)))
    {
      return false;
    }
    float lowest[Side][Side], highest[Side][Side];
    std::fill_n(&lowest[0][0], Side * Side, Infinite);
    std::fill_n(&highest[0][0], Side * Side, -Infinite);
    bool isOne = true;
    for (std::size_t i = 0; i < this->Count; ++i)
    {
      const int u = SquareAt((x[i] - *leastX) / square), v = SquareAt((y[i] - *leastY) / square);
      const float height = Dot(mean, this->At, i) / length;
      lowest[u][v] = std::min(lowest[u][v], height);
      highest[u][v] = std::max(highest[u][v], height);
      isOne = isOne && highest[u][v] - lowest[u][v] < ShareOfGap * gap;
    }
    return isOne;
  }

  std::size_t Size() const { return this->Count; }

  /// pi times the sum of k at element i.
  float CoverAt(std::size_t i) const
  {
    constexpr std::size_t lanes = 16; // sums that do not wait for one another
    float sums[lanes] = {};
    for (std::size_t first = 0; first < this->Count; first += lanes)
    {
      for (std::size_t l = 0; l < lanes; ++l)
      {
        sums[l] += this->CoverBy(i, first + l);
      }
    }
    float sum = 0.0f;
    for (const float part : sums)
    {
      sum += part;
    }
    return sum;
  }

private:
  static constexpr int Side = 16; // of the field of squares
  static constexpr float Infinite = 1e30f;

  /// @param place in squares; NaN is in the first one
  static int SquareAt(float place)
  {
    return place > 0.0f ? static_cast<int>(std::min(place, Side - 1.0f)) : 0;
  }

  static float Dot(const float (&v)[3], const float (&field)[3][RunSize], std::size_t i)
  {
    return v[0] * field[0][i] + v[1] * field[1][i] + v[2] * field[2][i];
  }

  /// pi k of element j at element i; 0 of what is not finite.
  float CoverBy(std::size_t i, std::size_t j) const
  {
    float squared = 0.0f, height = 0.0f, cosine = 0.0f;
    for (int c = 0; c < 3; ++c)
    {
      const float d = this->At[c][j] - this->At[c][i], n = this->Normal[c][i];
      squared += d * d;
      height += n * d;
      cosine += n * this->Normal[c][j];
    }
    const float left = std::max(0.0f, 1.0f - (squared - height * height) * this->PerReach[j]);
    const bool covers = (height > this->Gap[i]) & (cosine > CosineOfSheet);
    return covers ? left * left : 0.0f;
  }

  std::size_t Count = 0;
  alignas(64) float At[3][RunSize] = {}, Normal[3][RunSize] = {};
  alignas(64) float Gap[RunSize] = {}, PerReach[RunSize] = {};
};

/// @param uncovered [run.Size()] 1 - v
SURFEL_MULTIVERSION SURFEL_FLATTEN void FindUncovered(const Run& run, float* uncovered)
{
  constexpr auto perKernel = static_cast<float>(1.5 / Pi);
  for (std::size_t i = 0; i < run.Size(); ++i)
  {
    uncovered[i] = 1.0f - std::min(perKernel * run.CoverAt(i), 1.0f);
  }
}

/// Multiplies the leaves by what of their ancestors of a level is not covered. Returns whether any
/// is covered.
bool MultiplyLeaves(const SurfelCloud& tree, const HierarchyLayout& layout, int level,
  const Executor& executor, float* leaves)
{
  constexpr int side = HierarchyLayout::OneSided;
  const std::size_t count = layout.Count(level, side), runs = (count + RunSize - 1) / RunSize;
  std::atomic<bool> isAnyCovered{ false };
  executor.For(runs, 1, [&](std::size_t begin, std::size_t end) {
    Run run;
    float uncovered[RunSize];
    for (std::size_t r = begin; r < end; ++r)
    {
      const std::size_t first = r * RunSize, size = std::min(RunSize, count - first);
      run.Load(tree, layout.Begin(level, side) + first, size);
      if (run.IsOneSheet())
      {
        continue;
      }
      FindUncovered(run, uncovered);
      if (*std::min_element(uncovered, uncovered + size) == 1.0f)
      {
        continue;
      }
      isAnyCovered = true;
      const std::size_t last =
        std::min<std::size_t>((first + size) << level, layout.NumberOfLeaves(side));
      for (std::size_t i = first << level; i < last; ++i)
      {
        leaves[i] *= uncovered[(i >> level) - first];
      }
    }
  });
  return isAnyCovered;
}
}

std::vector<float> FindUncovered(
  const SurfelCloud& tree, const HierarchyLayout& layout, const Executor& executor)
{
  constexpr int side = HierarchyLayout::OneSided;
  if (tree.Kind != CloudKind::Surfels || layout.NumberOfLeaves(side) == 0)
  {
    return {};
  }
  std::vector<float> leaves(layout.NumberOfLeaves(), 1.0f);
  bool isAnyCovered = false;
  for (int level = 0; layout.Count(level, side) > 1; level += LevelsPerStep)
  {
    isAnyCovered |= MultiplyLeaves(tree, layout, level, executor, leaves.data());
  }
  return isAnyCovered ? leaves : std::vector<float>();
}
}
