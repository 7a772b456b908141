// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Hierarchy/NodeColors.h"

#include "Core/Hierarchy/NodeRecursion.h"
#include "Core/Surfels/NodePacking.h"

#include <algorithm>
#include <cmath>

namespace SurfelSplatting
{
namespace
{
/// A node's colour with its weights.
struct WeightedColor
{
  ColorMoments Moments;
  double Area = 0.0;
  double Mass = 0.0;           ///< sum a o
  double Seen = 0.0;           ///< sum m
  Vector3 Position{ 0, 0, 0 }; ///< mean, weighted by m
};

WeightedColor JoinColors(const WeightedColor& a, const WeightedColor& b)
{
  WeightedColor node;
  node.Area = a.Area + b.Area;
  node.Mass = a.Mass + b.Mass;
  node.Seen = a.Seen + b.Seen;
  const double ofMass = node.Mass > 0.0 ? b.Mass / node.Mass : 0.5;
  const double fb = node.Seen > 0.0 ? b.Seen / node.Seen : ofMass;
  const double fa = 1.0 - fb;
  const Vector3 apart = b.Position - a.Position;
  node.Position = a.Position + fb * apart;
  for (int c = 0; c < 3; ++c)
  {
    const double ca = a.Moments.Color[c], cb = b.Moments.Color[c];
    node.Moments.Color[c] = fa * ca + fb * cb;
    for (int x = 0; x < 3; ++x)
    {
      node.Moments.First[c][x] =
        fa * a.Moments.First[c][x] + fb * b.Moments.First[c][x] + fa * fb * (cb - ca) * apart[x];
    }
  }
  return node;
}

class ColorFiller
{
public:
  using Value = WeightedColor;

  ColorFiller(const SurfelCloud& tree, const HierarchyLayout& layout,
    const std::vector<float>& uncovered, NodeColor* colors)
    : Tree(tree)
    , Layout(layout)
    , Uncovered(uncovered)
    , Colors(colors)
  {
    this->Tree.Opacity = 1.0; // nodes do not include the opacity of the whole cloud
  }

  WeightedColor Leaf(std::size_t i) const
  {
    WeightedColor leaf;
    leaf.Position = this->Tree.Position(i);
    leaf.Area = this->Tree.Area(i);
    const std::array<double, 4> c = this->Tree.Color(i);
    std::copy_n(c.begin(), 3, leaf.Moments.Color);
    leaf.Mass = leaf.Area * c[3];
    leaf.Seen = leaf.Mass * (1.0 - this->Tree.OverlapOf(i));
    leaf.Seen *= this->Uncovered.empty() ? 1.0 : static_cast<double>(this->Uncovered[i]);
    return leaf;
  }

  WeightedColor Join(const WeightedColor& a, const WeightedColor& b, int) const
  {
    return JoinColors(a, b);
  }

  void Store(const WeightedColor& value, int tree, int level, std::size_t j) const
  {
    ColorMoments moments = value.Moments;
    moments.Opacity = value.Area > 0.0 ? std::fmin(1.0, value.Mass / value.Area) : 0.0;
    this->Colors[this->Layout.Begin(level, tree) + j - this->Tree.NumberOfSurfels] =
      PackColor(moments);
  }

private:
  SurfelCloud Tree;
  const HierarchyLayout& Layout;
  const std::vector<float>& Uncovered;
  NodeColor* Colors;
};
}

void FillNodeColors(const SurfelCloud& tree, const HierarchyLayout& layout,
  const std::vector<float>& uncovered, const Executor& executor, NodeColor* colors)
{
  ForNodesUpwards(layout, executor, ColorFiller(tree, layout, uncovered, colors));
}
}
