// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Meshes/MeshParts.h"

#include "Filters/Common/ParityUnionFind.h"

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <tuple>

namespace SurfelGeometry
{
namespace
{
/// Largest part of the edges that two faces pass in the same direction, of a mesh with sides.
constexpr double MixedEdges = 0.05;

/// Part of the faces that are where others are, from which on a mesh has none: a third to a half in
/// foliage, whose leaves have two faces.
constexpr double TwinFaces = 0.25;

/// One triangle's side, between two places.
struct MeshEdge
{
  int Low, High; // places
  int Triangle;
  bool IsForward; // from Low to High

  bool IsWith(const MeshEdge& other) const
  {
    return this->Low == other.Low && this->High == other.High;
  }
};

/// Those between the same places follow each other, in the order of the triangles.
std::vector<MeshEdge> SortedEdges(const std::vector<Corners>& triangles)
{
  std::vector<MeshEdge> edges;
  edges.reserve(3 * triangles.size());
  for (std::size_t t = 0; t < triangles.size(); ++t)
  {
    for (std::size_t c = 0; c < 3; ++c)
    {
      const int begin = triangles[t][c], end = triangles[t][(c + 1) % 3];
      edges.push_back(
        { std::min(begin, end), std::max(begin, end), static_cast<int>(t), begin < end });
    }
  }
  std::sort(edges.begin(), edges.end(), [](const MeshEdge& a, const MeshEdge& b) {
    return std::tie(a.Low, a.High, a.Triangle) < std::tie(b.Low, b.High, b.Triangle);
  });
  return edges;
}

/// Calls visit(first, last) for the edges between each two places.
template <typename Visit>
void ForShared(const std::vector<MeshEdge>& edges, const Visit& visit)
{
  for (auto first = edges.begin(); first != edges.end();)
  {
    const auto last =
      std::find_if(first, edges.end(), [&](const MeshEdge& edge) { return !edge.IsWith(*first); });
    visit(first, last);
    first = last;
  }
}

bool AreTwins(std::vector<Corners> triangles)
{
  for (Corners& corners : triangles)
  {
    std::sort(corners.begin(), corners.end());
  }
  std::sort(triangles.begin(), triangles.end());
  const auto different = std::unique(triangles.begin(), triangles.end()) - triangles.begin();
  const auto all = static_cast<double>(triangles.size());
  return all - static_cast<double>(different) > TwinFaces * all;
}
}

bool HaveSides(const std::vector<Corners>& triangles)
{
  std::ptrdiff_t repeated = 0, surplus = 0;
  ForShared(SortedEdges(triangles), [&](auto first, auto last) {
    const auto all = last - first;
    const auto forward = std::count_if(first, last, [](const MeshEdge& e) { return e.IsForward; });
    const auto backward = all - forward;
    repeated +=
      std::max<std::ptrdiff_t>(forward - 1, 0) + std::max<std::ptrdiff_t>(backward - 1, 0);
    surplus += std::max<std::ptrdiff_t>(std::abs(forward - backward) - 1, 0);
  });
  const double most = MixedEdges * 3.0 * static_cast<double>(triangles.size());
  return static_cast<double>(repeated) <= most ||
    (static_cast<double>(surplus) <= most && !AreTwins(triangles));
}

std::vector<int> FindParts(const std::vector<Corners>& triangles)
{
  const int count = static_cast<int>(triangles.size());
  ParityUnionFind sets(count);
  ForShared(SortedEdges(triangles), [&sets](auto first, auto last) {
    if (last - first == 2 && first->IsForward != (first + 1)->IsForward)
    {
      sets.Join(first->Triangle, (first + 1)->Triangle, false);
    }
  });
  std::vector<int> numbers(triangles.size(), -1), parts(triangles.size());
  int next = 0;
  for (int t = 0; t < count; ++t)
  {
    int& number = numbers[sets.Find(t).first];
    number = number < 0 ? next++ : number;
    parts[t] = number;
  }
  return parts;
}
}
