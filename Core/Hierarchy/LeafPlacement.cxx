// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Hierarchy/LeafPlacement.h"

#include "Core/Surfels/NodeMoments.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace SurfelSplatting
{
namespace
{
/// Nodes of each tree that are compared.
constexpr std::uint64_t MostPairs = 2048;

/// A move by this fraction of a node's deviation is not seen.
constexpr double UnseenMove = 1.0 / 32.0;

/// Thickness over width of a cloud that counts as one in a plane, squared.
constexpr double PlanarRatio = 1e-8;

/// A node as it is stored, and the moments of the leaves below it.
struct Pair
{
  Vector3 Node, Leaves;
  Vector3 NodeArea, LeafArea; ///< area vectors
  double Unseen;              ///< length of a move that does not count, from rounding or too small
};

double LargestCoordinate(const Vector3& p)
{
  return std::fmax(std::abs(p[0]), std::fmax(std::abs(p[1]), std::abs(p[2])));
}

NodeMoments LeafMoments(const SurfelCloud& tree, std::uint64_t i)
{
  NodeMoments m;
  m.Area = tree.Area(i);
  m.AreaVector = tree.AreaVector(i);
  m.Position = tree.Position(i);
  return m;
}

std::vector<Pair> FindPairs(const SurfelCloud& cloud, const HierarchyLayout& layout)
{
  std::vector<Pair> pairs;
  for (const int tree : { HierarchyLayout::OneSided, HierarchyLayout::TwoSided })
  {
    const std::uint64_t nodes = layout.RootLevel(tree) > 0 ? layout.Count(1, tree) : 0;
    const std::uint64_t step = std::max<std::uint64_t>(1, nodes / MostPairs);
    for (std::uint64_t j = 0; j < nodes; j += step)
    {
      const std::uint64_t first = layout.Begin(0, tree) + 2 * j;
      NodeMoments leaves = LeafMoments(cloud, first);
      if (2 * j + 1 < layout.Count(0, tree))
      {
        const NodeMoments second = LeafMoments(cloud, first + 1);
        leaves = Join(leaves, second, tree == HierarchyLayout::TwoSided);
      }
      const std::uint64_t i = layout.Begin(1, tree) + j;
      const Vector3 at = cloud.Position(i);
      pairs.push_back({ at, leaves.Position, cloud.AreaVector(i), leaves.AreaVector,
        UnseenMove * cloud.Node(i).Deviation });
    }
  }
  return pairs;
}

/// Adds what is lost where floats are rounded.
void AllowForRounding(const SurfelCloud& cloud, std::vector<Pair>& pairs)
{
  double nodes = 0.0, leaves = 0.0;
  for (const Pair& pair : pairs)
  {
    nodes = std::fmax(nodes, LargestCoordinate(pair.Node));
    leaves = std::fmax(leaves, LargestCoordinate(pair.Leaves));
  }
  // Writers of text keep six digits of floats.
  const double unit = 8.0 * std::numeric_limits<float>::epsilon();
  const double rounding = unit * (nodes + (cloud.PositionsFloat ? leaves : 0.0));
  for (Pair& pair : pairs)
  {
    pair.Unseen += rounding;
  }
}

/// @param scale by which the map enlarges what does not count
bool Explains(const Affine3& map, const std::vector<Pair>& pairs, double scale)
{
  return std::all_of(pairs.begin(), pairs.end(), [&](const Pair& pair) {
    return Norm(map.Apply(pair.Node) - pair.Leaves) <= scale * pair.Unseen;
  });
}

Vector3 MeanOf(const std::vector<Pair>& pairs, Vector3 Pair::*member)
{
  Vector3 mean{ 0, 0, 0 };
  for (const Pair& pair : pairs)
  {
    for (int i = 0; i < 3; ++i)
    {
      mean[i] += (pair.*member)[i] / static_cast<double>(pairs.size());
    }
  }
  return mean;
}

/// The columns of L for a cloud in the plane with normal n, of which only those in the plane hold.
void TurnNormal(const Vector3& n, Affine3& map)
{
  const Vector3 other = std::abs(n[0]) < 0.6 ? Vector3{ 1, 0, 0 } : Vector3{ 0, 1, 0 };
  Vector3 u = Cross(n, other);
  const double length = Norm(u);
  u = { u[0] / length, u[1] / length, u[2] / length };
  const Vector3 m = Cross(map.ApplyLinear(u), map.ApplyLinear(Cross(n, u)));
  const double scale = 1.0 / std::sqrt(std::fmax(Norm(m), std::numeric_limits<double>::min()));
  const Vector3 wrong = map.ApplyLinear(n);
  for (int i = 0; i < 3; ++i)
  {
    for (int j = 0; j < 3; ++j)
    {
      map.L[i][j] += (scale * m[i] - wrong[i]) * n[j];
    }
  }
}

/// Sum over all pairs of a b', relative to the means.
Affine3 SumOfProducts(const std::vector<Pair>& pairs, Vector3 Pair::*a, const Vector3& meanOfA,
  const Vector3& meanOfNodes)
{
  Affine3 sum;
  sum.L = {};
  for (const Pair& pair : pairs)
  {
    const Vector3 x = pair.*a - meanOfA, y = pair.Node - meanOfNodes;
    for (int i = 0; i < 3; ++i)
    {
      for (int j = 0; j < 3; ++j)
      {
        sum.L[i][j] += x[i] * y[j];
      }
    }
  }
  return sum;
}

double TraceOf(const std::array<Vector3, 3>& matrix)
{
  return matrix[0][0] + matrix[1][1] + matrix[2][2];
}

/// Whether products have one eigenvalue above 0.
bool IsOnLine(const Affine3& products)
{
  const double trace = TraceOf(products.L);
  return !(std::abs(TraceOf(products.AreaMatrix())) > PlanarRatio * trace * trace);
}

/// Makes the sum of a plane's products regular; its normal, or 0 if the products are regular.
Vector3 FindNormal(Affine3& products)
{
  const std::array<Vector3, 3> adjugate = products.AreaMatrix();
  const double trace = TraceOf(products.L), minors = std::abs(TraceOf(adjugate));
  if (std::abs(products.Determinant()) > PlanarRatio * trace * minors)
  {
    return { 0, 0, 0 };
  }
  Vector3 n = *std::max_element(adjugate.begin(), adjugate.end(),
    [](const Vector3& a, const Vector3& b) { return Norm(a) < Norm(b); });
  const double length = Norm(n);
  for (int i = 0; i < 3; ++i)
  {
    n[i] /= length > 0.0 ? length : 1.0;
  }
  for (int i = 0; i < 3; ++i)
  {
    for (int j = 0; j < 3; ++j)
    {
      products.L[i][j] += trace * n[i] * n[j];
    }
  }
  return n;
}

/// Least squares. L is 0 if the nodes are on a line.
Affine3 FitAffine(const std::vector<Pair>& pairs)
{
  const Vector3 nodes = MeanOf(pairs, &Pair::Node), leaves = MeanOf(pairs, &Pair::Leaves);
  Affine3 products = SumOfProducts(pairs, &Pair::Node, nodes, nodes);
  if (IsOnLine(products))
  {
    Affine3 none;
    none.L = {};
    return none;
  }
  const Vector3 normal = FindNormal(products);
  Affine3 map =
    Affine3::Compose(SumOfProducts(pairs, &Pair::Leaves, leaves, nodes), products.Inverse());
  if (Norm(normal) > 0.0)
  {
    TurnNormal(normal, map);
  }
  map.T = leaves - map.ApplyLinear(nodes);
  return map;
}

double ScaleOf(const Affine3& map)
{
  return std::sqrt(Dot(map.L[0], map.L[0]) + Dot(map.L[1], map.L[1]) + Dot(map.L[2], map.L[2]));
}

/// How far the area vectors of nodes, multiplied with a matrix, are from those of the leaves.
double AreaError(const std::array<Vector3, 3>& matrix, const std::vector<Pair>& pairs)
{
  Affine3 map;
  map.L = matrix;
  double error = 0.0;
  for (const Pair& pair : pairs)
  {
    error += Norm(map.ApplyLinear(pair.NodeArea) - pair.LeafArea);
  }
  return error;
}
}

LeafPlacement FindLeafPlacement(const SurfelCloud& tree, const HierarchyLayout& layout)
{
  LeafPlacement placement;
  std::vector<Pair> pairs = FindPairs(tree, layout);
  AllowForRounding(tree, pairs);
  if (Explains(placement.Map, pairs, 1.0))
  {
    return placement;
  }
  placement.Map.T = MeanOf(pairs, &Pair::Leaves) - MeanOf(pairs, &Pair::Node);
  placement.Kind = LeafPlacement::Translation;
  placement.Back = placement.Map.Inverse();
  if (Explains(placement.Map, pairs, 1.0))
  {
    return placement;
  }
  placement.Map = FitAffine(pairs);
  const double scale = ScaleOf(placement.Map), determinant = placement.Map.Determinant();
  // A comparison with NaN is false.
  const bool isRegular = std::abs(determinant) > PlanarRatio * scale * scale * scale;
  placement.Kind = isRegular && Explains(placement.Map, pairs, scale) ? LeafPlacement::AffineMap
                                                                      : LeafPlacement::Other;
  placement.Back = placement.Map.Inverse();
  placement.MovedVectors =
    !tree.IsInSpace() && AreaError(placement.Map.L, pairs) < AreaError(Affine3().L, pairs);
  return placement;
}
}
