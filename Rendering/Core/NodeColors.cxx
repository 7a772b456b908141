// SPDX-License-Identifier: BSD-3-Clause
#include "NodeColors.h"

#include <algorithm>

namespace SurfelSplatting
{
namespace
{
constexpr std::size_t Grain = 4096;

struct ColorMoments
{
  double Mass = 0.0; ///< sum a o
  double Area = 0.0;
  double Color[3] = { 0, 0, 0 };
  double First[3][3] = {}; ///< H
  Vector3 Position{ 0, 0, 0 };
};

/// Means of nodes below level 1 come from the leaves' own arrays.
class ColorAccess
{
public:
  ColorAccess(const SurfelCloud& cloud, const float* areas, NodeColorArrays& arrays)
    : Cloud(cloud)
    , Areas(areas)
    , Arrays(arrays)
  {
    this->Cloud.Opacity = 1.0;
    this->Cloud.NodeColors = nullptr;
  }

  ColorMoments Get(std::size_t i) const
  {
    ColorMoments m;
    m.Position = this->Cloud.Position(i);
    m.Area = this->Areas[i];
    if (i < this->Cloud.NumberOfLeaves)
    {
      const std::array<double, 4> c = this->Cloud.Color(i);
      std::copy_n(c.begin(), 3, m.Color);
      m.Mass = m.Area * c[3];
      return m;
    }
    const std::size_t node = i - this->Cloud.NumberOfLeaves;
    const float* c = this->Arrays.Colors.data() + 4 * node;
    const float* h = this->Arrays.Gradients.data() + 9 * node;
    std::copy_n(c, 3, m.Color);
    m.Mass = m.Area * c[3];
    for (int channel = 0; channel < 3; ++channel)
    {
      std::copy_n(h + 3 * channel, 3, m.First[channel]);
    }
    return m;
  }

  void Set(std::size_t i, const ColorMoments& m) const
  {
    const std::size_t node = i - this->Cloud.NumberOfLeaves;
    float* c = this->Arrays.Colors.data() + 4 * node;
    float* h = this->Arrays.Gradients.data() + 9 * node;
    std::copy_n(m.Color, 3, c);
    c[3] = static_cast<float>(m.Area > 0.0 ? std::fmin(1.0, m.Mass / m.Area) : 0.0);
    for (int channel = 0; channel < 3; ++channel)
    {
      std::copy_n(m.First[channel], 3, h + 3 * channel);
    }
  }

private:
  SurfelCloud Cloud;
  const float* Areas;
  NodeColorArrays& Arrays;
};

ColorMoments Join(const ColorMoments& a, const ColorMoments& b)
{
  ColorMoments node;
  node.Mass = a.Mass + b.Mass;
  node.Area = a.Area + b.Area;
  const double fa = node.Mass > 0.0 ? a.Mass / node.Mass : 0.5;
  const double fb = 1.0 - fa;
  for (int c = 0; c < 3; ++c)
  {
    node.Color[c] = fa * a.Color[c] + fb * b.Color[c];
    const double step = fa * fb * (b.Color[c] - a.Color[c]);
    for (int x = 0; x < 3; ++x)
    {
      node.First[c][x] =
        fa * a.First[c][x] + fb * b.First[c][x] + step * (b.Position[x] - a.Position[x]);
    }
  }
  return node;
}
}

NodeColorArrays MakeNodeColors(const SurfelCloud& cloud, const HierarchyLayout& layout,
  const float* areas, const Executor& executor)
{
  NodeColorArrays arrays;
  const std::size_t inner = layout.NumberOfNodes() - layout.NumberOfLeaves();
  arrays.Colors.resize(4 * inner);
  arrays.Gradients.resize(9 * inner);
  const ColorAccess access(cloud, areas, arrays);
  for (int level = 1; level < layout.NumberOfLevels(); ++level)
  {
    for (int tree = 0; tree < HierarchyLayout::NumberOfTrees; ++tree)
    {
      const std::size_t below = layout.Begin(level - 1, tree);
      const std::size_t belowCount = layout.Count(level - 1, tree);
      const std::size_t first = layout.Begin(level, tree);
      executor.For(layout.Count(level, tree), Grain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t j = begin; j < end; ++j)
        {
          const ColorMoments left = access.Get(below + 2 * j);
          access.Set(
            first + j, 2 * j + 1 < belowCount ? Join(left, access.Get(below + 2 * j + 1)) : left);
        }
      });
    }
  }
  return arrays;
}
}
