// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Neighbors/LocalCloud.h"

#include "Filters/Common/Hash.h"
#include "Filters/Common/ParallelFor.h"
#include "Filters/Neighbors/MortonGrid.h"

#include "vtkPoints.h"
#include "vtkSMPTools.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace SurfelGeometry
{
namespace
{
struct KeyedPoint
{
  std::uint64_t Key; // Morton's
  int Index;
};

bool IsUsable(const double p[3])
{
  // A comparison with NaN is false.
  return std::abs(p[0]) < CoordinateLimit && std::abs(p[1]) < CoordinateLimit &&
    std::abs(p[2]) < CoordinateLimit;
}

/// The order of points with the same key: by position, then by index.
bool IsBefore(const float* positions, int a, int b)
{
  const float* p = positions + 3 * static_cast<size_t>(a);
  const float* q = positions + 3 * static_cast<size_t>(b);
  for (int c = 0; c < 3; ++c)
  {
    if (p[c] != q[c])
    {
      return p[c] < q[c];
    }
  }
  return a < b;
}

bool AreSame(const float* positions, int a, int b)
{
  const float* p = positions + 3 * static_cast<size_t>(a);
  const float* q = positions + 3 * static_cast<size_t>(b);
  return p[0] == q[0] && p[1] == q[1] && p[2] == q[2];
}

/// Sorts by position within runs of equal keys and keeps the lowest index of each position.
void RemoveDuplicates(const float* positions, RawVector<KeyedPoint>& keyed)
{
  size_t kept = 0;
  for (size_t begin = 0, end = 0; begin < keyed.size(); begin = end)
  {
    for (end = begin + 1; end < keyed.size() && keyed[end].Key == keyed[begin].Key; ++end)
    {
    }
    if (end > begin + 1)
    {
      std::sort(keyed.begin() + begin, keyed.begin() + end,
        [positions](const KeyedPoint& a, const KeyedPoint& b) {
          return IsBefore(positions, a.Index, b.Index);
        });
    }
    int last = -1; // of this run
    for (size_t i = begin; i < end; ++i)
    {
      const KeyedPoint point = keyed[i];
      if (last < 0 || !AreSame(positions, last, point.Index))
      {
        keyed[kept++] = point;
      }
      last = point.Index;
    }
  }
  keyed.resize(kept);
}

/// The points in Morton order, without duplicates.
RawVector<KeyedPoint> SortByKey(const RawVector<float>& positions)
{
  const MortonGrid grid(positions);
  RawVector<KeyedPoint> keyed(positions.size() / 3);
  ParallelFor(0, static_cast<vtkIdType>(keyed.size()), [&](vtkIdType i, vtkIdType end) {
    for (; i < end; ++i)
    {
      keyed[i] = { grid.Key(positions.data() + 3 * i), static_cast<int>(i) };
    }
  });
  // A total order: the result does not depend on the algorithm or its threads.
  vtkSMPTools::Sort(keyed.begin(), keyed.end(), [](const KeyedPoint& a, const KeyedPoint& b) {
    return a.Key != b.Key ? a.Key < b.Key : a.Index < b.Index;
  });
  RemoveDuplicates(positions.data(), keyed);
  return keyed;
}

/// Ids of the usable points, and their bounds.
RawVector<vtkIdType> FindUsable(vtkPoints* points, double lower[3], double upper[3])
{
  struct Piece
  {
    vtkIdType Count = 0;
    double Lower[3], Upper[3];
  };
  constexpr vtkIdType size = 1 << 16;
  const vtkIdType count = points->GetNumberOfPoints();
  RawVector<vtkIdType> ids(count); // first each piece's ids at the beginning of its range
  std::vector<Piece> pieces((count + size - 1) / size);
  ParallelFor(0, static_cast<vtkIdType>(pieces.size()), 1, [&](vtkIdType p, vtkIdType last) {
    for (; p < last; ++p)
    {
      Piece& piece = pieces[p];
      for (vtkIdType id = p * size; id < std::min(count, (p + 1) * size); ++id)
      {
        double x[3];
        points->GetPoint(id, x);
        if (!IsUsable(x))
        {
          continue;
        }
        for (int c = 0; c < 3; ++c)
        {
          piece.Lower[c] = piece.Count == 0 ? x[c] : std::min(piece.Lower[c], x[c]);
          piece.Upper[c] = piece.Count == 0 ? x[c] : std::max(piece.Upper[c], x[c]);
        }
        ids[p * size + piece.Count++] = id;
      }
    }
  });
  vtkIdType kept = 0;
  for (size_t p = 0; p < pieces.size(); ++p)
  {
    const Piece& piece = pieces[p];
    for (int c = 0; piece.Count > 0 && c < 3; ++c)
    {
      lower[c] = kept == 0 ? piece.Lower[c] : std::min(lower[c], piece.Lower[c]);
      upper[c] = kept == 0 ? piece.Upper[c] : std::max(upper[c], piece.Upper[c]);
    }
    if (kept != static_cast<vtkIdType>(p) * size)
    {
      std::copy_n(ids.begin() + p * size, piece.Count, ids.begin() + kept);
    }
    kept += piece.Count;
  }
  ids.resize(kept);
  return ids;
}
}

void ChooseOrigin(
  const double lower[3], const double upper[3], const double inputOrigin[3], double origin[3])
{
  double squaredDiagonal = 0.0;
  double largest = 0.0;
  for (int c = 0; c < 3; ++c)
  {
    squaredDiagonal += (upper[c] - lower[c]) * (upper[c] - lower[c]);
    largest = std::max({ largest, std::abs(lower[c]), std::abs(upper[c]) });
  }
  const bool move = largest > LocalOriginRatio * std::sqrt(squaredDiagonal);
  for (int c = 0; c < 3; ++c)
  {
    const double center = 0.5 * (lower[c] + upper[c]) + inputOrigin[c];
    origin[c] = move ? static_cast<double>(static_cast<float>(center)) : inputOrigin[c];
  }
}

vtkIdType FindBounds(vtkPoints* points, double lower[3], double upper[3])
{
  return static_cast<vtkIdType>(FindUsable(points, lower, upper).size());
}

void PlaceAbout(vtkPoints* points, const double inputOrigin[3], const double origin[3],
  std::vector<float>& positions)
{
  const vtkIdType count = points->GetNumberOfPoints();
  positions.resize(3 * static_cast<size_t>(count));
  ParallelFor(0, count, [&](vtkIdType begin, vtkIdType end) {
    for (vtkIdType i = begin; i < end; ++i)
    {
      double p[3];
      points->GetPoint(i, p);
      const bool drop = !IsUsable(p);
      for (int c = 0; c < 3; ++c)
      {
        positions[3 * i + c] = drop ? std::numeric_limits<float>::quiet_NaN()
                                    : static_cast<float>(p[c] + (inputOrigin[c] - origin[c]));
      }
    }
  });
}

vtkIdType PlacePoints(
  vtkPoints* points, const double inputOrigin[3], double origin[3], std::vector<float>& positions)
{
  double lower[3] = { 0.0, 0.0, 0.0 };
  double upper[3] = { 0.0, 0.0, 0.0 };
  const vtkIdType usable = FindBounds(points, lower, upper);
  ChooseOrigin(lower, upper, inputOrigin, origin);
  PlaceAbout(points, inputOrigin, origin, positions);
  return points->GetNumberOfPoints() - usable;
}

void GatherCloud(vtkPoints* points, const double inputOrigin[3], LocalCloud& cloud)
{
  double lower[3] = { 0.0, 0.0, 0.0 };
  double upper[3] = { 0.0, 0.0, 0.0 };
  const RawVector<vtkIdType> ids = FindUsable(points, lower, upper);
  cloud.NonFinite = points->GetNumberOfPoints() - static_cast<vtkIdType>(ids.size());
  ChooseOrigin(lower, upper, inputOrigin, cloud.Origin);
  const double shift[3] = { inputOrigin[0] - cloud.Origin[0], inputOrigin[1] - cloud.Origin[1],
    inputOrigin[2] - cloud.Origin[2] };

  // Duplicates are exact in the positions as stored.
  RawVector<float> positions(3 * ids.size());
  ParallelFor(0, static_cast<vtkIdType>(ids.size()), [&](vtkIdType begin, vtkIdType end) {
    for (vtkIdType i = begin; i < end; ++i)
    {
      double p[3];
      points->GetPoint(ids[i], p);
      for (int c = 0; c < 3; ++c)
      {
        positions[3 * i + c] = static_cast<float>(p[c] + shift[c]);
      }
    }
  });
  const RawVector<KeyedPoint> order = SortByKey(positions);
  cloud.Duplicates = static_cast<vtkIdType>(ids.size() - order.size());

  cloud.InputIds.resize(order.size());
  cloud.Positions.resize(3 * order.size());
  ParallelFor(0, static_cast<vtkIdType>(order.size()), [&](vtkIdType begin, vtkIdType end) {
    for (vtkIdType i = begin; i < end; ++i)
    {
      const auto from = static_cast<size_t>(order[i].Index);
      cloud.InputIds[i] = static_cast<int>(ids[from]);
      std::copy_n(positions.data() + 3 * from, 3, cloud.Positions.data() + 3 * i);
    }
  });
}

std::vector<int> SamplePoints(const LocalCloud& cloud, double share)
{
  std::vector<int> sample;
  for (int i = 0; i < cloud.Size(); ++i)
  {
    if (Hash(static_cast<std::uint64_t>(cloud.SampleId(i))) < share)
    {
      sample.push_back(i);
    }
  }
  return sample;
}

std::vector<int> OrderOfInput(const LocalCloud& cloud, const std::vector<char>& kept)
{
  std::vector<int> order(kept.size());
  ParallelFor(0, cloud.Size(), [&](vtkIdType i, vtkIdType end) {
    for (; i < end; ++i)
    {
      order[cloud.InputIds[i]] = static_cast<int>(i);
    }
  });
  if (cloud.InputIds.size() < kept.size())
  {
    size_t next = 0;
    for (size_t id = 0; id < kept.size(); ++id)
    {
      order[next] = order[id];
      next += kept[id];
    }
    order.resize(next);
  }
  return order;
}
}
