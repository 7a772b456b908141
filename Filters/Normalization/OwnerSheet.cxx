// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Normalization/OwnerSheet.h"

#include "Core/Simd/Multiversion.h"
#include "Filters/Neighbors/SurfaceFold.h"

#include <algorithm>
#include <cmath>

namespace SurfelGeometry
{
namespace
{
/// What all neighbours are related to.
struct Owner
{
  Float3 Position, Normal, U, V;
  float Spacing;     // world units
  float Radius;      // of its samples, spacings
  float Offset;      // see WeightSettings::NormalOffset
  float LeastCosine; // of the normals of surfels of one sheet
};

/// Sheets are layers of noise from this roughness on, and distinct below it by this range. A lion's
/// have 0.3 in the median, flat sheets beside one another 0.1. (If the foremost of a lion's hides
/// the others, one picture of it has 0.4 dB less: few points are foremost, and they leave gaps.)
constexpr float RoughestSheet = 0.25f, RangeOfRoughness = 0.15f;

/// A kernel as it covers what lies behind or in front of it along a direction: it is evaluated
/// where the line through a sample meets its plane. At a crease the kernels of the other side do
/// not count then. One that is seen edge-on covers nothing.
WeightedKernel SeenAlong(const Float3& direction, const WeightedKernel& kernel)
{
  const Float3& n = kernel.Normal;
  const float inverse = 1.0f / SingleDot(direction, n);
  WeightedKernel seen = kernel;
  for (Float3* row : { &seen.B1, &seen.B2 })
  {
    const float along = SingleDot(direction, *row) * inverse;
    row->X -= along * n.X;
    row->Y -= along * n.Y;
    row->Z -= along * n.Z;
  }
  return seen;
}

/// A neighbour's kernel at the owner's samples, across a fold. It is evaluated along the mean of
/// both normals, which unrolls the surface: a place beyond the fold is that on the other side of
/// it.
/// @param at the neighbour, seen from the owner
WeightedKernel Unrolled(const WeightedKernel& owner, const WeightedKernel& kernel, const Float3& at)
{
  const float cosine = SingleDot(owner.Normal, kernel.Normal);
  const float sign = owner.TwoSided
    ? AgreeingSign(cosine, SingleDot(at, owner.Normal), SingleDot(at, kernel.Normal))
    : 1.0f;
  Float3 mean;
  mean.X = owner.Normal.X + sign * kernel.Normal.X;
  mean.Y = owner.Normal.Y + sign * kernel.Normal.Y;
  mean.Z = owner.Normal.Z + sign * kernel.Normal.Z;
  return SeenAlong(mean, kernel);
}

/// Places the neighbours from `first` on, and finds out which of them are on the owner's sheet, and
/// which kernels reach its samples.
SURFEL_MULTIVERSION void Relate(
  const OwnerSheet::Row& __restrict row, const Owner& o, int first, OwnerSheet& __restrict s)
{
  SheetKernels& to = s.Kernels;
  const float spacing = o.Spacing, inverse = 1.0f / spacing;
  const Float3 p = o.Position, n = o.Normal, u = o.U, v = o.V;
  for (int lane = 0; lane < SheetKernels::Lanes; ++lane)
  {
    const int k = first + lane;
    const float x = inverse * (row.X[k] - p.X);
    const float y = inverse * (row.Y[k] - p.Y);
    const float z = inverse * (row.Z[k] - p.Z);
    const float nx = row.NX[k], ny = row.NY[k], nz = row.NZ[k];
    const float squared = x * x + y * y + z * z;
    const float cosine = n.X * nx + n.Y * ny + n.Z * nz;
    const bool isAlike = (row.Alike[k] != 0) & (cosine > o.LeastCosine);
    const float reach = o.Radius + inverse * row.Reaches[k];
    const bool reaches = isAlike & (squared < reach * reach);
    const float height = o.Offset * (row.Sigmas[k] * inverse);
    // On smooth surfaces no sample is so far off the planes of kernels.
    const float flat = height - std::abs(nx * x + ny * y + nz * z);
    const float slope = o.Radius * o.Radius * (1.0f - cosine * cosine);
    const bool isFlat = (flat > 0.0f) & (slope < flat * flat);
    s.Folded[k] = reaches & (std::abs(cosine) <= FlattestFold) ? 1 : 0;
    s.OfOther[k] = isAlike & !isFlat ? 1 : 0;
    s.Squared[k] = isAlike ? squared : OwnerSheet::Elsewhere;
    s.AlongU[k] = u.X * x + u.Y * y + u.Z * z;
    s.AlongV[k] = v.X * x + v.Y * y + v.Z * z;
    s.Climbs[k] = n.X * x + n.Y * y + n.Z * z;
    to.X[k] = x;
    to.Y[k] = y;
    to.Z[k] = z;
    to.B1X[k] = spacing * row.B1X[k];
    to.B1Y[k] = spacing * row.B1Y[k];
    to.B1Z[k] = spacing * row.B1Z[k];
    to.B2X[k] = spacing * row.B2X[k];
    to.B2Y[k] = spacing * row.B2Y[k];
    to.B2Z[k] = spacing * row.B2Z[k];
    to.NX[k] = nx;
    to.NY[k] = ny;
    to.NZ[k] = nz;
    to.Climb[k] = reaches ? height : 0.0f;
  }
}
}

void OwnerSheet::Load(const SurfelTable& table, std::uint16_t own, const std::uint16_t* neighbors,
  int count, const WeightSettings& settings)
{
  const auto& [kernel, position, reach] = table[own];
  this->Kernels.Numbers[0] = own;
  std::copy_n(neighbors, count, this->Kernels.Numbers + 1);
  this->Kernels.Count = count + 1;
  this->InFront.Count = this->Behind.Count = 0;
  this->LoadRow(table, kernel.TwoSided);
  Vector3 u, v;
  TangentFrame(kernel.Normal, u, v);
  const Owner owner{ position, kernel.Normal, u, v, std::sqrt(kernel.Area),
    static_cast<float>(settings.SampleRadius), static_cast<float>(settings.NormalOffset),
    kernel.TwoSided ? -2.0f : SharpestFold };
  for (int first = 0; first < this->Kernels.Count; first += SheetKernels::Lanes)
  {
    Relate(this->Raw, owner, first, *this);
  }
  if (this->NeedsCloserLook())
  {
    this->LookCloser(table, settings, owner.Spacing);
  }
  this->InFront.Pad();
  this->Behind.Pad();
}

void OwnerSheet::LoadRow(const SurfelTable& table, bool isTwoSided)
{
  Row& row = this->Raw;
  for (int k = 0; k < this->Kernels.Count; ++k)
  {
    const auto& [kernel, position, reach] = table[this->Kernels.Numbers[k]];
    row.X[k] = position.X;
    row.Y[k] = position.Y;
    row.Z[k] = position.Z;
    row.NX[k] = kernel.Normal.X;
    row.NY[k] = kernel.Normal.Y;
    row.NZ[k] = kernel.Normal.Z;
    row.B1X[k] = kernel.B1.X;
    row.B1Y[k] = kernel.B1.Y;
    row.B1Z[k] = kernel.B1.Z;
    row.B2X[k] = kernel.B2.X;
    row.B2Y[k] = kernel.B2.Y;
    row.B2Z[k] = kernel.B2.Z;
    row.Sigmas[k] = kernel.Sigma;
    row.Reaches[k] = reach;
    row.Alike[k] = kernel.Usable & (kernel.TwoSided == isTwoSided) ? 1 : 0;
  }
  for (int k = this->Kernels.Count; k < this->Kernels.Padded(); ++k)
  {
    row.Alike[k] = 0; // the rest is of neighbours before, and all are finite
  }
}

bool OwnerSheet::NeedsCloserLook() const
{
  int needs = 0;
  for (int k = 1; k < this->Kernels.Count; ++k)
  {
    needs |= this->Folded[k] | this->OfOther[k];
  }
  return needs != 0;
}

void OwnerSheet::LookCloser(const SurfelTable& table, const WeightSettings& settings, float spacing)
{
  SheetKernels& near = this->Kernels;
  const WeightedKernel& owner = table[near.Numbers[0]].Kernel;
  const auto first = static_cast<float>(settings.NormalOffset);
  const ClimbRange range{ first, static_cast<float>(settings.OtherSheets) * first };
  for (int k = 1; k < near.Count; ++k)
  {
    const WeightedKernel& kernel = table[near.Numbers[k]].Kernel;
    Float3 at;
    at.X = near.X[k];
    at.Y = near.Y[k];
    at.Z = near.Z[k];
    if (this->Folded[k])
    {
      near.SetRows(k, Unrolled(owner, kernel, at), spacing);
    }
    if (this->OfOther[k])
    {
      SheetKernels& others = this->Climbs[k] > 0.0f ? this->InFront : this->Behind;
      others.Add(near.Numbers[k], at, SeenAlong(owner.Normal, kernel), spacing, range);
    }
  }
  const float smooth = (RoughestSheet - this->Roughness(first, spacing)) / RangeOfRoughness;
  this->Distinct = owner.TwoSided ? 0.0f : std::clamp(smooth, 0.0f, 1.0f);
}

float OwnerSheet::Roughness(float sigmas, float spacing) const
{
  float squares = 0.0f, count = 0.0f;
  for (int k = 1; k < this->Kernels.Count; ++k)
  {
    if (this->Has(k) && !this->OfOther[k])
    {
      const float distance = this->Climbs[k] * spacing / (sigmas * this->Raw.Sigmas[k]);
      squares += distance * distance;
      count += 1.0f;
    }
  }
  return count > 0.0f ? std::sqrt(squares / count) : 1.0f;
}
}
