// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Hierarchy/NodeHarmonics.h"

#include "Core/Hierarchy/NodeColors.h"
#include "Core/Hierarchy/NodeRecursion.h"

#include <algorithm>
#include <cmath>

namespace SurfelSplatting
{
namespace
{
constexpr int MaxCoefficients = 3 * MaxHarmonics;
constexpr std::size_t LeavesPerTask = 4096;

struct WeightedHarmonics
{
  double Mass;
  float Coefficients[MaxCoefficients];
};

PackedHarmonics Pack(const float* coefficients, int count)
{
  PackedHarmonics packed{};
  float largest = 0.0f;
  for (int i = 3; i < 3 * count; ++i)
  {
    largest = std::max(largest, std::abs(coefficients[i]));
  }
  packed.Unit = std::isfinite(largest) ? largest / PackedHarmonics::One : 0.0f;
  const float perUnit = packed.Unit > 0.0f ? 1.0f / packed.Unit : 0.0f;
  for (int c = 0; c < 3; ++c)
  {
    packed.Constant[c] = coefficients[c];
    for (int k = 1; k < count; ++k)
    {
      const float x = coefficients[3 * k + c] * perUnit;
      packed.Rest[c][k] = std::isfinite(x) ? static_cast<std::int8_t>(std::floor(x + 0.5f)) : 0;
    }
  }
  return packed;
}

class HarmonicsFiller
{
public:
  using Value = WeightedHarmonics;

  HarmonicsFiller(const SurfelCloud& tree, const HierarchyLayout& layout, const float* coefficients,
    int count, PackedHarmonics* packed)
    : Tree(tree)
    , Layout(layout)
    , Coefficients(coefficients)
    , Count(count)
    , Packed(packed)
  {
  }

  WeightedHarmonics Leaf(std::size_t i) const
  {
    WeightedHarmonics leaf{ this->Tree.Area(i) * this->Tree.Color(i)[3], {} };
    std::copy_n(this->Coefficients + 3 * this->Count * i, 3 * this->Count, leaf.Coefficients);
    return leaf;
  }

  WeightedHarmonics Join(const WeightedHarmonics& a, const WeightedHarmonics& b, int) const
  {
    WeightedHarmonics node{ a.Mass + b.Mass, {} };
    const auto share = static_cast<float>(node.Mass > 0.0 ? a.Mass / node.Mass : 0.5);
    for (int i = 0; i < 3 * this->Count; ++i)
    {
      node.Coefficients[i] = share * a.Coefficients[i] + (1.0f - share) * b.Coefficients[i];
    }
    return node;
  }

  void Store(const WeightedHarmonics& value, int tree, int level, std::size_t j) const
  {
    this->Packed[this->Layout.Begin(level, tree) + j] = Pack(value.Coefficients, this->Count);
  }

private:
  const SurfelCloud& Tree;
  const HierarchyLayout& Layout;
  const float* Coefficients;
  int Count;
  PackedHarmonics* Packed;
};
}

std::vector<PackedHarmonics> PackHarmonics(const SurfelCloud& tree, const HierarchyLayout& layout,
  const float* coefficients, int count, const Executor& executor)
{
  const std::size_t leaves = tree.NumberOfSurfels;
  std::vector<PackedHarmonics> packed(tree.Nodes ? layout.NumberOfNodes() : leaves);
  executor.For(leaves, LeavesPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
    {
      packed[i] = Pack(coefficients + 3 * count * i, count);
    }
  });
  if (tree.Nodes)
  {
    ForNodesUpwards(
      layout, executor, HarmonicsFiller(tree, layout, coefficients, count, packed.data()));
  }
  return packed;
}

void FillHarmonicColors(const SurfelCloud& tree, const HierarchyLayout& layout,
  const PackedHarmonics* packed, const Executor& executor, NodeColor* colors)
{
  const Vector3Of<double> anywhere{ 0.0, 0.0, 1.0 };
  double basis[MaxHarmonics];
  EvaluateHarmonics<double>(anywhere, 1, basis);
  std::vector<float> constant(4 * tree.NumberOfSurfels);
  executor.For(tree.NumberOfSurfels, LeavesPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
    {
      for (int c = 0; c < 3; ++c)
      {
        const float* coefficients = packed[i].Constant;
        constant[4 * i + c] = static_cast<float>(ColorOfHarmonics(
          basis, 1, [&](int /* k */) { return static_cast<double>(coefficients[c]); }));
      }
      constant[4 * i + 3] = 1.0f;
    }
  });
  SurfelCloud colored = tree;
  colored.ColorsFloat = constant.data();
  FillNodeColors(colored, layout, {}, executor, colors);
}
}
