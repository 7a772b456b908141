// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Surfels/NodePacking.h"

#include <cmath>
#include <limits>

namespace SurfelSplatting
{
namespace
{
/// NaN becomes 0.
double Clamp(double x, double low, double high)
{
  return x >= low ? (x < high ? x : high) : x < low ? low : 0.0;
}

float ToFloat(double x)
{
  constexpr double largest = std::numeric_limits<float>::max();
  return static_cast<float>(Clamp(x, -largest, largest));
}

/// What a number is multiplied by for Pack().
double ScaleOf(float unit)
{
  return unit > 0.0f ? PackedOne / unit : 0.0;
}

std::int16_t Pack(double x, double scale)
{
  // The floor, by a conversion of a positive number: floor() may be a call.
  constexpr double offset = PackedOne + 1.0;
  return static_cast<std::int16_t>(
    static_cast<int>(Clamp(x * scale, -PackedOne, PackedOne) + (0.5 + offset)) -
    static_cast<int>(offset));
}

std::uint16_t PackShare(double x)
{
  return static_cast<std::uint16_t>(Pack(Clamp(x, 0.0, 1.0), PackedOne));
}

double Unpack(int x, double unit)
{
  return x * (unit / PackedOne);
}

/// L with S = L L'. Where a pivot is no more than a rounding error (singular S), its column is 0.
void Factorize(const Symmetric3& s, double l[6])
{
  const double smallest = 1e-14 * s.Trace();
  const auto root = [smallest](double pivot) { return pivot > smallest ? std::sqrt(pivot) : 0.0; };
  const auto quotient = [](double x, double pivot) { return pivot > 0.0 ? x / pivot : 0.0; };
  l[0] = root(s.XX);
  l[1] = quotient(s.XY, l[0]);
  l[2] = root(s.YY - l[1] * l[1]);
  l[3] = quotient(s.XZ, l[0]);
  l[4] = quotient(s.YZ - l[1] * l[3], l[2]);
  l[5] = root(s.ZZ - l[3] * l[3] - l[4] * l[4]);
}

double LargestMagnitude(const double* values, int count)
{
  double largest = 0.0;
  for (int i = 0; i < count; ++i)
  {
    const double magnitude = std::abs(values[i]);
    largest = magnitude > largest ? magnitude : largest; // without NaN
  }
  return largest;
}
}

HierarchyNode PackNode(const NodeMoments& moments, bool twoSided)
{
  HierarchyNode node{};
  double factor[6];
  Factorize(moments.Covariance, factor);
  node.Deviation = ToFloat(LargestMagnitude(factor, 6));
  const double perDeviation = ScaleOf(node.Deviation);
  for (int i = 0; i < 6; ++i)
  {
    node.Factor[i] = Pack(factor[i], perDeviation);
  }
  node.Area = ToFloat(moments.Area);
  const double perArea = ScaleOf(node.Area);
  for (int i = 0; i < 3; ++i)
  {
    node.Position[i] = ToFloat(moments.Position[i]);
    node.Normal[i] = Pack(moments.AreaVector[i], perArea);
  }
  node.Opacity = PackShare(moments.Opacity);
  node.Sides = twoSided ? 1 : 0;
  SetOverlap(moments.Overlap, node);
  return node;
}

void SetBounds(double radius, double cosine, HierarchyNode& node)
{
  node.Bound = ToFloat(radius * (1.0 + 1e-6)); // a few floats more
  node.Cone = static_cast<std::int16_t>(std::floor(Clamp(cosine - 1e-6, -1.0, 1.0) * PackedOne));
}

Vector3 PositionOf(const HierarchyNode& node)
{
  return { node.Position[0], node.Position[1], node.Position[2] };
}

Symmetric3 CovarianceOf(const HierarchyNode& node)
{
  double l[6];
  for (int i = 0; i < 6; ++i)
  {
    l[i] = Unpack(node.Factor[i], node.Deviation);
  }
  return { l[0] * l[0], l[1] * l[1] + l[2] * l[2], l[3] * l[3] + l[4] * l[4] + l[5] * l[5],
    l[0] * l[1], l[1] * l[3] + l[2] * l[4], l[0] * l[3] };
}

bool IsTwoSided(const HierarchyNode& node)
{
  return (node.Sides & 1) != 0;
}

double OverlapOf(const HierarchyNode& node)
{
  return static_cast<double>(node.Sides >> 1) / PackedOverlap;
}

void SetOverlap(double overlap, HierarchyNode& node)
{
  const auto packed =
    static_cast<unsigned int>(std::lround(Clamp(overlap, 0.0, 1.0) * PackedOverlap));
  node.Sides = static_cast<std::uint16_t>(packed << 1 | (node.Sides & 1u));
}

Vector3 AreaVectorOf(const HierarchyNode& node)
{
  return { Unpack(node.Normal[0], node.Area), Unpack(node.Normal[1], node.Area),
    Unpack(node.Normal[2], node.Area) };
}

double OpacityOf(const HierarchyNode& node)
{
  return Unpack(node.Opacity, 1.0);
}

double ConeOf(const HierarchyNode& node)
{
  return Unpack(node.Cone, 1.0);
}

NodeColor PackColor(const ColorMoments& moments)
{
  NodeColor packed{};
  packed.ColorUnit = ToFloat(LargestMagnitude(moments.Color, 3));
  packed.MomentUnit = ToFloat(LargestMagnitude(moments.First[0], 9));
  const double perColor = ScaleOf(packed.ColorUnit), perMoment = ScaleOf(packed.MomentUnit);
  for (int c = 0; c < 3; ++c)
  {
    packed.Color[c] = Pack(moments.Color[c], perColor);
    for (int x = 0; x < 3; ++x)
    {
      packed.Moment[c][x] = Pack(moments.First[c][x], perMoment);
    }
  }
  packed.Opacity = PackShare(moments.Opacity);
  return packed;
}

ColorMoments UnpackColor(const NodeColor& packed)
{
  ColorMoments moments;
  for (int c = 0; c < 3; ++c)
  {
    moments.Color[c] = Unpack(packed.Color[c], packed.ColorUnit);
    for (int x = 0; x < 3; ++x)
    {
      moments.First[c][x] = Unpack(packed.Moment[c][x], packed.MomentUnit);
    }
  }
  moments.Opacity = Unpack(packed.Opacity, 1.0);
  return moments;
}
}
