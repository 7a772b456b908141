// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Partition/CloudRegions.h"

#include "Filters/Common/ParallelFor.h"

#include <algorithm>
#include <cmath>

namespace SurfelGeometry
{
namespace
{
/// A part that may be cut further.
struct Piece
{
  CloudRegion Region;
  std::vector<vtkIdType> Ids;
};

struct Bounds
{
  float Lower[3], Upper[3];
  double Side(int c) const { return static_cast<double>(this->Upper[c]) - this->Lower[c]; }
};

Bounds BoundsOf(const std::vector<float>& positions, const std::vector<vtkIdType>& ids)
{
  Bounds b;
  for (int c = 0; c < 3; ++c)
  {
    b.Lower[c] = b.Upper[c] = positions[3 * ids[0] + c];
  }
  for (const vtkIdType id : ids)
  {
    for (int c = 0; c < 3; ++c)
    {
      b.Lower[c] = std::min(b.Lower[c], positions[3 * id + c]);
      b.Upper[c] = std::max(b.Upper[c], positions[3 * id + c]);
    }
  }
  return b;
}

/// A coordinate with about half of the points below it and at least one on either side, estimated
/// from a sample. If all points share the coordinate, it is above them.
float Middle(const std::vector<float>& positions, const std::vector<vtkIdType>& ids, int axis,
  const Bounds& bounds)
{
  constexpr std::size_t enough = 100000;
  const std::size_t step = std::max<std::size_t>(1, ids.size() / enough);
  std::vector<float> sample;
  for (std::size_t i = 0; i < ids.size(); i += step)
  {
    sample.push_back(positions[3 * ids[i] + axis]);
  }
  const auto middle = sample.begin() + static_cast<std::ptrdiff_t>(sample.size() / 2);
  std::nth_element(sample.begin(), middle, sample.end());
  return *middle > bounds.Lower[axis] ? *middle
                                      : std::nextafter(bounds.Lower[axis], bounds.Upper[axis]);
}

/// Cuts a piece in two. Returns false if its points are all at one position.
bool Halve(const std::vector<float>& positions, const Bounds& bounds, Piece& piece, Piece& rest)
{
  int axis = 0;
  for (int c = 1; c < 3; ++c)
  {
    axis = bounds.Side(c) > bounds.Side(axis) ? c : axis;
  }
  if (!(bounds.Side(axis) > 0.0))
  {
    return false; // all at one position
  }
  const float cut = Middle(positions, piece.Ids, axis, bounds);
  const auto end = std::stable_partition(piece.Ids.begin(), piece.Ids.end(),
    [&](vtkIdType id) { return positions[3 * id + axis] < cut; });
  rest.Region = piece.Region;
  rest.Region.Lower[axis] = piece.Region.Upper[axis] = cut;
  rest.Ids.assign(end, piece.Ids.end());
  piece.Ids.erase(end, piece.Ids.end());
  piece.Ids.shrink_to_fit();
  return true;
}
}

CloudRegion CloudRegion::Grown(double margin) const
{
  CloudRegion grown;
  for (int c = 0; c < 3; ++c)
  {
    grown.Lower[c] = static_cast<float>(this->Lower[c] - margin);
    grown.Upper[c] = static_cast<float>(this->Upper[c] + margin);
  }
  return grown;
}

double CloudRegion::DistanceToSide(const float* p) const
{
  double distance = std::numeric_limits<double>::infinity();
  for (int c = 0; c < 3; ++c)
  {
    distance = std::min({ distance, static_cast<double>(p[c]) - this->Lower[c],
      static_cast<double>(this->Upper[c]) - p[c] });
  }
  return distance;
}

std::vector<CloudPart> CutCloud(const std::vector<float>& positions, vtkIdType largest)
{
  std::vector<CloudPart> parts;
  std::vector<Piece> stack(1);
  stack[0].Ids = FindInside(positions, stack[0].Region);
  while (!stack.empty())
  {
    Piece piece = std::move(stack.back());
    stack.pop_back();
    const auto size = static_cast<vtkIdType>(piece.Ids.size());
    if (size == 0)
    {
      continue;
    }
    const Bounds bounds = BoundsOf(positions, piece.Ids);
    Piece rest;
    if (size > largest && Halve(positions, bounds, piece, rest))
    {
      stack.push_back(std::move(rest));
      stack.push_back(std::move(piece));
      continue;
    }
    parts.push_back(
      { piece.Region, size, std::hypot(bounds.Side(0), bounds.Side(1), bounds.Side(2)) });
  }
  return parts;
}

namespace
{
void CutPart(const std::vector<float>& positions, const CloudRegion& region,
  std::vector<vtkIdType> ids, int count, std::vector<CloudRegion>& regions)
{
  if (count == 1)
  {
    regions.push_back(region);
    return;
  }
  int axis = 0;
  float cut = 0.0f;
  const int below = count / 2;
  if (!ids.empty())
  {
    const Bounds bounds = BoundsOf(positions, ids);
    for (int c = 1; c < 3; ++c)
    {
      axis = bounds.Side(c) > bounds.Side(axis) ? c : axis;
    }
    const auto at = ids.begin() + static_cast<std::ptrdiff_t>(ids.size() * below / count);
    std::nth_element(ids.begin(), at, ids.end(),
      [&](vtkIdType a, vtkIdType b) { return positions[3 * a + axis] < positions[3 * b + axis]; });
    cut = positions[3 * *at + axis];
  }
  const auto middle = std::partition(
    ids.begin(), ids.end(), [&](vtkIdType id) { return positions[3 * id + axis] < cut; });
  CloudRegion low = region, high = region;
  low.Upper[axis] = high.Lower[axis] =
    std::min(std::max(cut, region.Lower[axis]), region.Upper[axis]);
  CutPart(positions, low, { ids.begin(), middle }, below, regions);
  CutPart(positions, high, { middle, ids.end() }, count - below, regions);
}
}

std::vector<CloudRegion> CutEvenly(const std::vector<float>& positions, int count)
{
  std::vector<CloudRegion> regions;
  const CloudRegion all;
  CutPart(positions, all, FindInside(positions, all), count, regions);
  return regions;
}

std::vector<vtkIdType> FindInside(const std::vector<float>& positions, const CloudRegion& region)
{
  constexpr vtkIdType block = 1 << 20;
  const auto count = static_cast<vtkIdType>(positions.size() / 3);
  std::vector<std::vector<vtkIdType>> found((count + block - 1) / block);
  ParallelFor(0, static_cast<vtkIdType>(found.size()), 1, [&](vtkIdType begin, vtkIdType end) {
    for (vtkIdType b = begin; b < end; ++b)
    {
      for (vtkIdType i = b * block; i < std::min(count, (b + 1) * block); ++i)
      {
        if (region.Contains(positions.data() + 3 * i))
        {
          found[b].push_back(i);
        }
      }
    }
  });
  std::size_t size = 0;
  for (const auto& ids : found)
  {
    size += ids.size();
  }
  std::vector<vtkIdType> all;
  all.reserve(size);
  for (const auto& ids : found)
  {
    all.insert(all.end(), ids.begin(), ids.end());
  }
  return all;
}
}
