// SPDX-License-Identifier: BSD-3-Clause
/**
 * The polygon that becomes a Voronoi cell. Which corners a bisector cuts off is hard to predict, so
 * the loops have no branches on it.
 */
#pragma once

#include "Filters/Common/Intrinsics.h"
#include "Filters/Common/VectorMath.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <utility>

namespace SurfelGeometry
{
/// A convex polygon, cut by half-planes. Lengths in spacings of its point.
class CellPolygon
{
public:
  CellPolygon() = default;
  CellPolygon(const CellPolygon&) = delete; // has pointers to its own buffers
  void operator=(const CellPolygon&) = delete;

  /// @param reach radius of the circle that the polygon encloses
  void Reset(double reach)
  {
    static const Corners corners = UnitCorners();
    const auto scale = static_cast<float>(reach);
    this->Count = ReachCorners;
    for (int k = 0; k < 2 * Block; ++k) // padding included
    {
      this->Now->X[k] = scale * corners.X[k];
      this->Now->Y[k] = scale * corners.Y[k];
    }
  }

  /// Keeps the part with n.x <= d. A polygon of MostCorners stays as it is.
  /// @param d positive: the padding, at the origin, is not cut off
  /// @return whether anything was cut off
  bool Cut(float nx, float ny, float d)
  {
    alignas(32) float distances[Capacity];
    std::uint64_t cut = 0; // a bit for each corner
    for (int first = 0; first < this->Padded(); first += Lanes)
    {
      for (int k = first; k < first + Lanes; ++k)
      {
        distances[k] = nx * this->Now->X[k] + ny * this->Now->Y[k] - d;
      }
      cut |= std::uint64_t{ PositiveBits(distances + first) } << first;
    }
    const std::uint64_t all = (std::uint64_t{ 1 } << this->Count) - 1;
    if (cut == all)
    {
      this->Count = 0;
    }
    else if (cut != 0 && this->Count < MostCorners)
    {
      this->Replace(distances, cut, all);
      this->Pad();
    }
    return cut != 0;
  }

  /// Squared distance of the farthest corner.
  float SquaredRadius() const
  {
    float largest[Lanes] = {};
    for (int first = 0; first < this->Padded(); first += Lanes)
    {
      for (int k = 0; k < Lanes; ++k)
      {
        const float x = this->Now->X[first + k], y = this->Now->Y[first + k];
        const float squared = x * x + y * y;
        largest[k] = squared > largest[k] ? squared : largest[k];
      }
    }
    for (int half = Lanes / 2; half > 0; half /= 2)
    {
      for (int k = 0; k < half; ++k)
      {
        const float other = largest[k + half];
        largest[k] = other > largest[k] ? other : largest[k];
      }
    }
    return largest[0];
  }

  /// Area, first and second moments about the origin, as sums over the triangles with the origin.
  void Moments(double& area, double first[2], double second[3]) const
  {
    double sum = 0.0, sumX = 0.0, sumY = 0.0, sumXX = 0.0, sumYY = 0.0, sumXY = 0.0;
    const int last = std::max(this->Count - 1, 0);
    double ax = this->Now->X[last], ay = this->Now->Y[last];
    for (int k = 0; k < this->Count; ++k)
    {
      const double bx = this->Now->X[k], by = this->Now->Y[k];
      const double cross = ax * by - ay * bx;
      sum += cross;
      sumX += cross * (ax + bx);
      sumY += cross * (ay + by);
      sumXX += cross * (ax * ax + ax * bx + bx * bx);
      sumYY += cross * (ay * ay + ay * by + by * by);
      sumXY += cross * (2.0 * (ax * ay + bx * by) + ax * by + bx * ay);
      ax = bx;
      ay = by;
    }
    area = sum / 2.0;
    first[0] = sumX / 6.0;
    first[1] = sumY / 6.0;
    second[0] = sumXX / 12.0;
    second[1] = sumYY / 12.0;
    second[2] = sumXY / 24.0;
  }

private:
  static constexpr int ReachCorners = 12;

  struct Point2
  {
    float X, Y;
  };

  static constexpr int Lanes = 8;

  /// Corners are padded to full blocks with zeros. Most polygons have one.
  static constexpr int Block = 16;

  /// Corners have bits. A circle that is cut by so many tangents is 0.1 % too large.
  static constexpr int MostCorners = 62;
  static constexpr int Capacity = 64 + 2 * Block;

  struct Corners
  {
    alignas(32) float X[Capacity];
    alignas(32) float Y[Capacity];
  };

  static Corners UnitCorners()
  {
    Corners corners = {};
    const double outer = 1.0 / std::cos(Pi / ReachCorners);
    for (int k = 0; k < ReachCorners; ++k)
    {
      const double angle = 2.0 * Pi * k / ReachCorners;
      corners.X[k] = static_cast<float>(outer * std::cos(angle));
      corners.Y[k] = static_cast<float>(outer * std::sin(angle));
    }
    return corners;
  }

  /// Number of corners and padding: hardly ever more than a block, so that loops are predictable.
  int Padded() const { return (std::max(this->Count, 1) + Block - 1) / Block * Block; }

  int Next(int k) const { return k + 1 < this->Count ? k + 1 : 0; }

  /// The point where the edge from corner a to corner b is cut. It is clamped to the edge: after
  /// rounding the polygon may be not quite convex and both ends on one side of a line far away.
  Point2 Between(int a, int b, const float* distances) const
  {
    const Corners& now = *this->Now;
    const float along = distances[a] / (distances[a] - distances[b]);
    const float t = along >= 0.0f ? std::min(along, 1.0f) : 0.0f;
    return { now.X[a] + t * (now.X[b] - now.X[a]), now.Y[a] + t * (now.Y[b] - now.Y[a]) };
  }

  /// A half-plane cuts off one run of corners; two new corners replace it. They become the last
  /// ones. No branch depends on where the run is: it is hard to predict.
  void Replace(const float* distances, std::uint64_t cut, std::uint64_t all)
  {
    const int count = this->Count;
    const std::uint64_t nexts = cut >> 1 | (cut & 1) << (count - 1);
    const int last = LowestBit(~cut & nexts & all); // before the run
    const std::uint64_t run = cut >> (last + 1) | (cut << (count - last - 1) & all);
    const int size = LowestBit(~run);
    const int end = last + size < count ? last + size : last + size - count;
    const int after = this->Next(end);
    const Point2 a = this->Between(last, this->Next(last), distances);
    const Point2 b = this->Between(end, after, distances);
    // From the first corner after the run to the last one of the array, and on from its beginning.
    CopyBlocks(*this->Now, after, count, *this->Other, 0);
    CopyBlocks(*this->Now, 0, after, *this->Other, count - after);
    std::swap(this->Now, this->Other);
    this->Count = count - size;
    this->Set(this->Count++, a);
    this->Set(this->Count++, b);
  }

  /// Copies the corners from `begin` to `end`, and writes up to a block beyond them.
  static void CopyBlocks(const Corners& from, int begin, int end, Corners& to, int at)
  {
    do
    {
      std::memcpy(to.X + at, from.X + begin, Block * sizeof(float));
      std::memcpy(to.Y + at, from.Y + begin, Block * sizeof(float));
      begin += Block;
      at += Block;
    } while (begin < end);
  }

  void Set(int k, const Point2& p)
  {
    this->Now->X[k] = p.X;
    this->Now->Y[k] = p.Y;
  }

  /// Call after every change of the corners.
  void Pad()
  {
    std::fill_n(this->Now->X + this->Count, Block, 0.0f);
    std::fill_n(this->Now->Y + this->Count, Block, 0.0f);
  }

  Corners Buffers[2] = {};
  Corners* Now = &this->Buffers[0];
  Corners* Other = &this->Buffers[1];
  int Count = 0;
};
}
