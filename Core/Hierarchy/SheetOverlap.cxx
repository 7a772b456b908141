// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Hierarchy/SheetOverlap.h"

#include "Core/Simd/Multiversion.h"
#include "Core/Surfels/NodePacking.h"

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
/// these levels both sheets lie in a run, and each node holds only one of them. (With 4, things
/// that lie on a table have 0.7 dB less; with 1, a Kinect scan has seams.)
constexpr int LevelsPerStep = 2;

/// An element covers another from this height on, in spacings of elements: a surface that only
/// bends stays below. Their normals have at least this cosine: those of a fold have less.
constexpr float NearestSheet = 1.5f, CosineOfSheet = 0.8f;

/// Up to this height, what is seen between sheets from the side is as narrow as the blur. (Without
/// it, bars at 36 px lose 0.27 dB; with 5, masts lose 0.7.)
constexpr float FarthestSheet = 7.5f;

/// v rises with the sum of kernels by this slope, from this sum on. At the border of a sheet, where
/// the sum is 1/2, it is 5/8, and behind most random points 1. (With 3/2 of the sum, a wall eight
/// spacings behind posters is dark beside them, 4 dB less, but a lion gains 0.4 dB, masts 0.8: what
/// is left out there adds up elsewhere.)
constexpr float CoverSlope = 1.75f, LeastCover = 1.0f / 7.0f;

/// Within a square, heights of one sheet differ by less than this share of NearestSheet.
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
      this->Gap[i] = NearestSheet * std::sqrt(area);
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
  static constexpr float FarthestOverNearest = FarthestSheet / NearestSheet;

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
    const bool isSheet = (height > this->Gap[i]) & (height < FarthestOverNearest * this->Gap[i]);
    const bool covers = isSheet & (cosine > CosineOfSheet);
    return covers ? left * left : 0.0f;
  }

  std::size_t Count = 0;
  alignas(64) float At[3][RunSize] = {}, Normal[3][RunSize] = {};
  alignas(64) float Gap[RunSize] = {}, PerReach[RunSize] = {};
};

/// @param uncovered [run.Size()] 1 - v
SURFEL_MULTIVERSION SURFEL_FLATTEN void FindUncovered(const Run& run, float* uncovered)
{
  constexpr auto perKernel = static_cast<float>(CoverSlope / Pi);
  for (std::size_t i = 0; i < run.Size(); ++i)
  {
    const float cover = perKernel * run.CoverAt(i) - CoverSlope * LeastCover;
    uncovered[i] = 1.0f - std::max(0.0f, std::min(cover, 1.0f));
  }
}

/// Calls function(first, uncovered, count) for parts of a level's one-sided elements.
/// @param uncovered 1 - v of the elements from the first one on; null: all are 1
template <typename Function>
void ForUncovered(const SurfelCloud& tree, const HierarchyLayout& layout, int level,
  const Executor& executor, const Function& function)
{
  constexpr int side = HierarchyLayout::OneSided;
  const std::size_t count = layout.Count(level, side), runs = (count + RunSize - 1) / RunSize;
  executor.For(runs, 1, [&](std::size_t begin, std::size_t end) {
    Run run;
    float uncovered[RunSize];
    for (std::size_t r = begin; r < end; ++r)
    {
      const std::size_t first = r * RunSize, size = std::min(RunSize, count - first);
      run.Load(tree, layout.Begin(level, side) + first, size);
      const bool isCovered = !run.IsOneSheet();
      if (isCovered)
      {
        FindUncovered(run, uncovered);
      }
      function(first, isCovered ? uncovered : nullptr, size);
    }
  });
}

/// u of the nodes of a tree.
class NodesOfSheets
{
public:
  NodesOfSheets(const SurfelCloud& tree, const HierarchyLayout& layout, HierarchyNode* nodes)
    : Tree(tree)
    , Layout(layout)
    , Nodes(nodes)
  {
  }

  /// The overlap of a node of level 1. @param uncovered 1 - v of its leaves, or null: 1
  double OverlapOfLeaves(std::size_t j, const float* uncovered) const
  {
    const std::size_t leaf = this->Layout.Begin(0, HierarchyLayout::OneSided);
    return this->MeanOverlap(1, j, [&](std::size_t k) {
      const double u = 1.0 - this->Tree.OverlapOf(leaf + k);
      return uncovered ? u * static_cast<double>(uncovered[k - 2 * j]) : u;
    });
  }

  /// Gives a node of level 1 the mean of its leaves.
  void TakeLeaves(std::size_t j, const float* uncovered) const
  {
    SetOverlap(this->OverlapOfLeaves(j, uncovered), this->At(1, j));
  }

  /// Gives a higher node the mean of its children. @param uncovered 1 - v of the node
  void TakeMean(int level, std::size_t j, float uncovered) const
  {
    const double mean = this->MeanOverlap(level, j, [&](std::size_t k) {
      return (1.0 - OverlapOf(this->At(level - 1, k))) * static_cast<double>(uncovered);
    });
    SetOverlap(mean, this->At(level, j));
  }

private:
  HierarchyNode& At(int level, std::size_t j) const
  {
    return this->Nodes[this->Layout.Begin(level, HierarchyLayout::OneSided) + j -
      this->Layout.NumberOfLeaves()];
  }

  /// @param of u of the k-th element of the level below
  template <typename Function>
  double MeanOverlap(int level, std::size_t j, const Function& of) const
  {
    const std::size_t begin = this->Layout.Begin(level - 1, HierarchyLayout::OneSided);
    const std::size_t count = this->Layout.Count(level - 1, HierarchyLayout::OneSided);
    double area = 0.0, sum = 0.0;
    for (std::size_t k = 2 * j; k < std::min(2 * j + 2, count); ++k)
    {
      const double a = this->Tree.Area(begin + k);
      area += a;
      sum += a * of(k);
    }
    return area > 0.0 ? 1.0 - sum / area : 0.0;
  }

  const SurfelCloud& Tree;
  const HierarchyLayout& Layout;
  HierarchyNode* Nodes;
};
}

std::vector<float> FindUncovered(
  const SurfelCloud& tree, const HierarchyLayout& layout, const Executor& executor)
{
  if (tree.Kind != CloudKind::Surfels)
  {
    return {};
  }
  const std::size_t end = layout.NumberOfLeaves(HierarchyLayout::OneSided);
  std::vector<float> leaves(layout.NumberOfLeaves(), 1.0f);
  std::atomic<bool> isAnyCovered{ false };
  for (int level = 0; level < layout.NumberOfLevels(); level += LevelsPerStep)
  {
    ForUncovered(tree, layout, level, executor,
      [&](std::size_t first, const float* uncovered, std::size_t count) {
        if (!uncovered || *std::min_element(uncovered, uncovered + count) == 1.0f)
        {
          return;
        }
        isAnyCovered = true;
        for (std::size_t i = first << level; i < std::min((first + count) << level, end); ++i)
        {
          leaves[i] *= uncovered[(i >> level) - first];
        }
      });
  }
  return isAnyCovered ? leaves : std::vector<float>();
}

void FillSheetOverlaps(const SurfelCloud& tree, const HierarchyLayout& layout,
  const Executor& executor, HierarchyNode* nodes)
{
  const NodesOfSheets sheets(tree, layout, nodes);
  const int last = layout.NumberOfLevels() - 1;
  for (int level = 0; level <= last; level += LevelsPerStep)
  {
    ForUncovered(tree, layout, level, executor,
      [&](std::size_t first, const float* uncovered, std::size_t count) {
        for (std::size_t k = 0; level > 0 && k < count; ++k)
        {
          sheets.TakeMean(level, first + k, uncovered ? uncovered[k] : 1.0f);
        }
        for (std::size_t k = 0; level < last && k < count; k += 2) // the level above
        {
          level == 0 ? sheets.TakeLeaves((first + k) / 2, uncovered ? uncovered + k : nullptr)
                     : sheets.TakeMean(level + 1, (first + k) / 2, 1.0f);
        }
      });
  }
}

bool AreSheetOverlaps(
  const SurfelCloud& tree, const HierarchyLayout& layout, const Executor& executor, double unseen)
{
  if (tree.Kind != CloudKind::Surfels || layout.NumberOfLevels() < 2)
  {
    return true;
  }
  const NodesOfSheets sheets(tree, layout, nullptr);
  const std::size_t above = layout.Begin(1, HierarchyLayout::OneSided);
  std::atomic<bool> same{ true };
  ForUncovered(
    tree, layout, 0, executor, [&](std::size_t first, const float* uncovered, std::size_t count) {
      for (std::size_t k = 0; k < count && same; k += 2)
      {
        const std::size_t j = (first + k) / 2;
        const double overlap = sheets.OverlapOfLeaves(j, uncovered ? uncovered + k : nullptr);
        if (std::abs(overlap - tree.OverlapOf(above + j)) > unseen)
        {
          same = false;
        }
      }
    });
  return same;
}
}
