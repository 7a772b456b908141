// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Hierarchy/CaptureOverlap.h"

#include "Core/Surfels/NodeMoments.h"
#include "Core/Surfels/NodePacking.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace SurfelSplatting
{
namespace
{
constexpr int PatchLevel = 2;
constexpr int LevelsAbove = 2;
/// Smallest l3 / l2 of what has no surface; a half sphere has 0.1.
constexpr double NoSurface = 0.2;
/// Gaussians at one place do not tell the area that they cover.
constexpr double LargestOverlap = 31.0 / 32.0;

/// Eigenvalues, falling, at least 0.
std::array<double, 3> EigenvaluesOf(const Symmetric3& s)
{
  const double first = std::fmax(0.0, s.LargestEigenvalue());
  const double sum = std::fmax(0.0, s.Trace() - first); // of the others
  const double product = std::fmax(0.0, s.SumOfMinors() - first * sum);
  const double root = std::sqrt(std::fmax(0.0, 0.25 * sum * sum - product));
  return { first, 0.5 * sum + root, std::fmax(0.0, 0.5 * sum - root) };
}

/// Area of the patch of which n points are random samples. A square has A / 12 along each side; the
/// determinant of n samples is on average (n - 1) (n - 2) / n^2 of that.
double PatchArea(const Symmetric3& covariance, double n)
{
  const std::array<double, 3> l = EigenvaluesOf(covariance);
  return 12.0 * std::sqrt(l[0] * l[1]) * n / std::sqrt((n - 1.0) * (n - 2.0));
}

/// The nodes of a tree.
class Nodes
{
public:
  Nodes(const HierarchyLayout& layout, int tree, HierarchyNode* nodes)
    : Layout(layout)
    , Tree(tree)
    , First(nodes)
  {
  }

  std::uint64_t Count(int level) const { return this->Layout.Count(level, this->Tree); }
  HierarchyNode& At(int level, std::uint64_t j) const
  {
    return this->First[this->Layout.Begin(level, this->Tree) + j - this->Layout.NumberOfLeaves()];
  }

private:
  const HierarchyLayout& Layout;
  int Tree;
  HierarchyNode* First; // above the leaves
};

/// Gives a node the mean of its children's overlaps, weighted with their masses.
void TakeMean(const Nodes& nodes, int level, std::uint64_t j)
{
  double mass = 0.0, sum = 0.0;
  for (std::uint64_t k = 2 * j; k < std::min(2 * j + 2, nodes.Count(level - 1)); ++k)
  {
    const HierarchyNode& child = nodes.At(level - 1, k);
    mass += child.Area;
    sum += child.Area * OverlapOf(child);
  }
  SetOverlap(mass > 0.0 ? sum / mass : 0.0, nodes.At(level, j));
}

/// Leaves what is part of a surface to the nodes of a level below one of the level `above`.
void KeepSurface(const Nodes& nodes, int level, int above, std::uint64_t j)
{
  const std::array<double, 3> l = EigenvaluesOf(CovarianceOf(nodes.At(above, j)));
  const double share = l[1] > 0.0 ? std::fmin(1.0, l[2] / (NoSurface * l[1])) : 0.0;
  const std::uint64_t end = std::min((j + 1) << (above - level), nodes.Count(level));
  for (std::uint64_t k = j << (above - level); k < end; ++k)
  {
    HierarchyNode& node = nodes.At(level, k);
    SetOverlap(share * OverlapOf(node), node);
  }
}
}

double OverlapOfPatch(const SurfelCloud& leaves, std::size_t begin, std::size_t end)
{
  const double count = static_cast<double>(end - begin);
  if (count < 3.0)
  {
    return 0.0;
  }
  double mass = 0.0;
  Vector3 mean{ 0, 0, 0 };
  for (std::size_t i = begin; i < end; ++i)
  {
    mass += leaves.Area(i);
    const Vector3 p = leaves.Position(i);
    mean = { mean[0] + p[0] / count, mean[1] + p[1] / count, mean[2] + p[2] / count };
  }
  Symmetric3 places{};
  for (std::size_t i = begin; i < end; ++i)
  {
    AddOuterProduct(places, leaves.Position(i) - mean, 1.0 / count);
  }
  const double covered = 2.0 * Pi * mass, area = PatchArea(places, count);
  if (!(covered > 0.0))
  {
    return 0.0;
  }
  const double hidden = -area * std::expm1(-covered / std::fmax(area, 1e-9 * covered));
  return std::fmin(1.0 - hidden / covered, LargestOverlap);
}

void FillCaptureOverlaps(const SurfelCloud& leaves, const HierarchyLayout& layout,
  const Executor& executor, HierarchyNode* nodes)
{
  const int top = layout.NumberOfLevels() - 1;
  for (int tree = 0; top >= PatchLevel && tree < HierarchyLayout::NumberOfTrees; ++tree)
  {
    const Nodes of(layout, tree, nodes);
    const auto forNodes = [&](int level, auto&& function) {
      executor.For(of.Count(level), 1024, [&](std::size_t begin, std::size_t end) {
        for (std::size_t j = begin; j < end; ++j)
        {
          function(j);
        }
      });
    };
    forNodes(PatchLevel, [&](std::uint64_t j) {
      const std::uint64_t first = layout.Begin(0, tree), count = layout.Count(0, tree);
      const std::uint64_t end = std::min((j + 1) << PatchLevel, count);
      const double overlap = OverlapOfPatch(leaves, first + (j << PatchLevel), first + end);
      SetOverlap(overlap, of.At(PatchLevel, j));
    });
    forNodes(1, [&](std::uint64_t j) { // pairs have the overlap of their patch
      SetOverlap(OverlapOf(of.At(PatchLevel, j >> (PatchLevel - 1))), of.At(1, j));
    });
    for (int level = PatchLevel + 1; level <= top; ++level)
    {
      forNodes(level, [&](std::uint64_t j) { TakeMean(of, level, j); });
    }
    for (int level = 1; level <= top; ++level)
    {
      const int above = std::min(level + LevelsAbove, top);
      forNodes(above, [&](std::uint64_t j) { KeepSurface(of, level, above, j); });
    }
  }
}
}
