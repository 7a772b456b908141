// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Hierarchy/HierarchyBuilder.h"

#include "Core/Hierarchy/CaptureOverlap.h"
#include "Core/Hierarchy/NodeRecursion.h"
#include "Core/Hierarchy/SheetOverlap.h"
#include "Core/Surfels/NodeMoments.h"
#include "Core/Surfels/NodePacking.h"

#include <algorithm>
#include <cmath>

namespace SurfelSplatting
{
namespace
{
/// Spheres and cones bound the leaves of nodes up to this level. Higher nodes bound the spheres and
/// cones of this level, which keeps them tight without visiting all leaves once per level.
constexpr int BoundedLevel = 6;

/// @param lengthOfB Norm(b)
double CosineBetween(const Vector3& a, const Vector3& b, double lengthOfB)
{
  const double lengths = Norm(a) * lengthOfB;
  return lengths > 0.0 ? Dot(a, b) / lengths : -1.0;
}

double AngleOf(double cosine)
{
  return std::acos(std::fmin(1.0, std::fmax(-1.0, cosine)));
}

/// Nodes from their leaves upwards.
class NodeFiller
{
public:
  using Value = NodeMoments;

  NodeFiller(const SurfelCloud& leaves, const HierarchyLayout& layout, HierarchyNode* nodes)
    : Tree(leaves)
    , Layout(layout)
    , Nodes(nodes)
  {
    this->Tree.NumberOfSurfels = layout.NumberOfLeaves();
    this->Tree.Nodes = nodes;
  }

  NodeMoments Leaf(std::size_t i) const
  {
    NodeMoments m;
    m.Area = this->Tree.Area(i);
    m.AreaVector = this->IsCapture() ? Vector3{ this->DepthOf(i), 0.0, 0.0 }
      : this->Tree.Normals           ? WeightedNormal(this->Tree, i, m.Area)
                                     : this->Tree.AreaVector(i);
    m.Position = this->Tree.Position(i);
    m.Covariance = this->Tree.Covariance(i);
    m.Opacity = this->Tree.OwnOpacity(i);
    m.Overlap = this->Tree.OverlapOf(i);
    return m;
  }

  NodeMoments Join(const NodeMoments& a, const NodeMoments& b, int tree) const
  {
    return SurfelSplatting::Join(a, b, tree == HierarchyLayout::TwoSided);
  }

  /// Called before its parent's and after its children's.
  void Store(const NodeMoments& moments, int tree, int level, std::size_t j) const
  {
    const bool twoSided = tree == HierarchyLayout::TwoSided;
    const std::size_t node = this->Layout.Begin(level, tree) + j;
    HierarchyNode& stored = this->Nodes[node - this->Tree.NumberOfSurfels];
    stored = PackNode(this->IsCapture() ? WithLeafScale(moments) : moments, twoSided);
    const int below = level <= BoundedLevel ? 0 : BoundedLevel;
    const std::size_t begin = this->Layout.Begin(below, tree);
    const std::size_t first = begin + (j << (level - below));
    const std::size_t last =
      begin + std::min<std::size_t>((j + 1) << (level - below), this->Layout.Count(below, tree));
    const double cosine = twoSided ? -1.0 : this->Cone(node, first, last); // seen from everywhere
    SetBounds(this->Radius(node, first, last), cosine, stored);
  }

private:
  bool IsCapture() const { return this->Tree.Kind == CloudKind::Capture; }

  /// Mass over kernel area of a Gaussian.
  double DepthOf(std::size_t i) const
  {
    return this->Tree.Area(i) / MeanKernelArea(this->Tree.Covariance(i));
  }

  /// Replaces the sum of the leaves' depths by what is stored, LeafScale (HierarchyNode.h).
  static NodeMoments WithLeafScale(NodeMoments moments)
  {
    const double depth = moments.AreaVector[0], own = MeanKernelArea(moments.Covariance);
    const double leaf = depth > 0.0 ? std::fmin(moments.Area / depth, own) : own;
    const double scale = std::fmax(std::sqrt(leaf / own), 1.0 / PackedOne);
    moments.AreaVector = { moments.Area * scale, 0.0, 0.0 };
    return moments;
  }

  /// Radius of a sphere about a node that contains the spheres of nodes, or the leaves, below.
  double Radius(std::size_t node, std::size_t first, std::size_t last) const
  {
    double radius = 0.0, squared = 0.0; // squared: of the leaves
    const Vector3 p = this->Tree.Position(node);
    for (std::size_t i = first; i < last; ++i)
    {
      const Vector3 d = this->Tree.Position(i) - p;
      if (this->Tree.IsNode(i))
      {
        radius = std::max(radius, Norm(d) + this->Tree.Node(i).Bound);
      }
      else
      {
        squared = std::max(squared, Dot(d, d));
      }
    }
    return std::max(radius, std::sqrt(squared));
  }

  /// Cosine of the cone about a node's area vector that contains the cones of nodes, or the normals
  /// of leaves, below.
  double Cone(std::size_t node, std::size_t first, std::size_t last) const
  {
    const Vector3 axis = this->Tree.AreaVector(node);
    const double length = Norm(axis);
    double smallest = 1.0, widest = 0.0;
    for (std::size_t i = first; i < last; ++i)
    {
      const double cosine = CosineBetween(this->Tree.AreaVector(i), axis, length);
      smallest = std::min(smallest, cosine);
      if (this->Tree.IsNode(i))
      {
        widest = std::fmax(widest, AngleOf(cosine) + AngleOf(ConeOf(this->Tree.Node(i))));
      }
    }
    return first < last && this->Tree.IsNode(first) ? std::cos(std::fmin(widest, Pi)) : smallest;
  }

  SurfelCloud Tree;
  const HierarchyLayout& Layout;
  HierarchyNode* Nodes;
};

/// Mean covariances of the leaves, weighted by their areas.
class LeafCovarianceFiller
{
public:
  struct Value
  {
    double Area;
    Symmetric3 Covariance;
  };

  LeafCovarianceFiller(const SurfelCloud& tree, const HierarchyLayout& layout, float* covariances)
    : Tree(tree)
    , Layout(layout)
    , Covariances(covariances)
  {
  }

  Value Leaf(std::size_t i) const { return { this->Tree.Area(i), this->Tree.Covariance(i) }; }

  Value Join(const Value& a, const Value& b, int) const
  {
    const double area = a.Area + b.Area;
    const double share = area > 0.0 ? a.Area / area : 0.5;
    return { area, Mix(a.Covariance, share, b.Covariance, 1.0 - share) };
  }

  void Store(const Value& value, int tree, int level, std::size_t j) const
  {
    const Symmetric3& s = value.Covariance;
    const double values[6] = { s.XX, s.YY, s.ZZ, s.XY, s.YZ, s.XZ };
    const std::size_t node = this->Layout.Begin(level, tree) + j - this->Tree.NumberOfSurfels;
    std::copy_n(values, 6, this->Covariances + 6 * node);
  }

private:
  const SurfelCloud& Tree;
  const HierarchyLayout& Layout;
  float* Covariances;
};
}

Vector3 WeightedNormal(const SurfelCloud& cloud, std::size_t i, double weight)
{
  const float* from = cloud.Normals + 3 * i;
  const Vector3 n{ from[0], from[1], from[2] };
  return weight / std::max(1.0, Norm(n)) * n; // a length of more counts as 1
}

void FillNodes(const SurfelCloud& leaves, const HierarchyLayout& layout, const Executor& executor,
  HierarchyNode* nodes)
{
  ForNodesUpwards(layout, executor, NodeFiller(leaves, layout, nodes));
  if (leaves.Kind == CloudKind::Capture)
  {
    FillCaptureOverlaps(leaves, layout, executor, nodes);
  }
  else if (leaves.Kind == CloudKind::Surfels)
  {
    SurfelCloud tree = leaves;
    tree.NumberOfSurfels = layout.NumberOfLeaves();
    tree.Nodes = nodes;
    FillSheetOverlaps(tree, layout, executor, nodes);
  }
}

std::vector<float> MakeLeafCovariances(
  const SurfelCloud& tree, const HierarchyLayout& layout, const Executor& executor)
{
  std::vector<float> covariances(6 * layout.NumberOfInnerNodes());
  ForNodesUpwards(layout, executor, LeafCovarianceFiller(tree, layout, covariances.data()));
  return covariances;
}
}
