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
  const double minors =
    s.XX * s.YY - s.XY * s.XY + s.YY * s.ZZ - s.YZ * s.YZ + s.XX * s.ZZ - s.XZ * s.XZ;
  const double sum = std::fmax(0.0, s.Trace() - first); // of the others
  const double product = std::fmax(0.0, minors - first * sum);
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
}

double OverlapOfLeaf(const SurfelCloud& leaves, const HierarchyLayout& layout, std::size_t i)
{
  const std::uint64_t trees = layout.Begin(0, HierarchyLayout::TwoSided);
  const std::uint64_t start = i < trees ? 0 : trees;
  const std::uint64_t end = i < trees ? trees : layout.NumberOfLeaves();
  const std::uint64_t first = start + ((i - start) >> PatchLevel << PatchLevel);
  const std::uint64_t last = std::min(end, first + (1 << PatchLevel));
  const double count = static_cast<double>(last - first);
  if (count < 3.0)
  {
    return 0.0;
  }
  double mass = 0.0;
  Vector3 mean{ 0, 0, 0 };
  for (std::uint64_t k = first; k < last; ++k)
  {
    mass += leaves.Area(k);
    const Vector3 p = leaves.Position(k);
    mean = { mean[0] + p[0] / count, mean[1] + p[1] / count, mean[2] + p[2] / count };
  }
  Symmetric3 places{};
  for (std::uint64_t k = first; k < last; ++k)
  {
    const Vector3 p = leaves.Position(k);
    AddOuterProduct(places, { p[0] - mean[0], p[1] - mean[1], p[2] - mean[2] }, 1.0 / count);
  }
  const double covered = 2.0 * Pi * mass, area = PatchArea(places, count);
  if (!(covered > 0.0))
  {
    return 0.0;
  }
  const double hidden = -area * std::expm1(-covered / std::fmax(area, 1e-9 * covered));
  return std::fmin(1.0 - hidden / covered, LargestOverlap);
}

void KeepSurfaces(const HierarchyLayout& layout, const Executor& executor, HierarchyNode* nodes)
{
  const int top = layout.NumberOfLevels() - 1;
  const auto nodeAt = [&](int level, int tree, std::uint64_t j) -> HierarchyNode& {
    return nodes[layout.Begin(level, tree) + j - layout.NumberOfLeaves()];
  };
  for (int tree = 0; tree < HierarchyLayout::NumberOfTrees; ++tree)
  {
    for (int level = 1; level <= top; ++level)
    {
      const int above = std::min(level + LevelsAbove, top);
      executor.For(layout.Count(level, tree), 4096, [&](std::size_t begin, std::size_t end) {
        for (std::size_t j = begin; j < end; ++j)
        {
          const std::array<double, 3> l =
            EigenvaluesOf(CovarianceOf(nodeAt(above, tree, j >> (above - level))));
          HierarchyNode& node = nodeAt(level, tree, j);
          const double share = l[1] > 0.0 ? std::fmin(1.0, l[2] / (NoSurface * l[1])) : 0.0;
          SetOverlap(share * OverlapOf(node), node);
        }
      });
    }
  }
}
}
