// SPDX-License-Identifier: BSD-3-Clause
/**
 * Of SetupImplementation.h: as many surfels as a vector has lanes, and how they get into
 * camera space.
 */
#pragma once

#include "Core/Simd/RealLanes.h"
#include "Core/Splats/SetupTarget.h"

namespace SurfelSplatting
{
namespace
{
/// Surfels in camera space and on their way to the screen, one in each lane.
struct Batch
{
  RealMask Alive, Invalid;
  Reals3 P, Area; ///< position and area vector, camera space
  Reals Deposit, InverseZ;
  RealMask BackSide;
  Reals XX, YY, ZZ, XY, YZ, XZ;          ///< covariance, camera space
  Reals MX0, MX2, MY1, MY2;              ///< the Jacobian's elements that are not zero
  Reals ConfusionX, ConfusionY, SignedC; ///< px; px over focal length
  Reals VarianceX, VarianceY;            ///< isotropic part of W, px^2
  Reals SquaredConfusion;                ///< that the kernel's shape is made for, px^2
  Reals OffsetX, OffsetY;                ///< of the blur's centre, px
  Reals WXX, WYY, WXY, Determinant;      ///< W
  Reals InverseWYY, InverseRoot;         ///< 1 / sqrt(det W)
  Reals Smooth;                          ///< share of W that lens and pixel filter make
  RealMask Tilted;
  Reals Cell; ///< of the coarse grid, px; 1: the picture
  Reals A, K, B, Peak, HalfWidth, HalfHeight, Shape, Tilt;
  Reals X, Y, Weight;
  Reals Near, Far, DepthX, DepthY;
  Reals Base[3], Share[3]; ///< of the shading
  Reals Red, Green, Blue, Opacity;
};

/// Field f of an array with the given stride, widened.
SURFELSPLATTING_INLINE Reals Gather(const float* field, const std::size_t* index, int stride)
{
  return ToReals(FillLanes<Floats>([=](int l) { return field[stride * index[l]]; }));
}

SURFELSPLATTING_INLINE Reals3 GatherPosition(const SetupJob& job, const std::size_t* index)
{
  if (job.PositionsFloat)
  {
    const float* p = job.PositionsFloat;
    return { Gather(p, index, 3), Gather(p + 1, index, 3), Gather(p + 2, index, 3) };
  }
  const double* p = job.PositionsDouble;
  return { FillLanes<Reals>([=](int l) { return p[3 * index[l]]; }),
    FillLanes<Reals>([=](int l) { return p[3 * index[l] + 1]; }),
    FillLanes<Reals>([=](int l) { return p[3 * index[l] + 2]; }) };
}

/// Covariance to camera space, L S L'.
SURFELSPLATTING_INLINE void PlaceCovariance(const SetupJob& job, const Reals s[6], Batch& b)
{
  Reals3 rows[3]; // S times each row of L
  for (int i = 0; i < 3; ++i)
  {
    const double* l = job.Linear[i];
    rows[i] = { s[0] * l[0] + s[3] * l[1] + s[5] * l[2], s[3] * l[0] + s[1] * l[1] + s[4] * l[2],
      s[5] * l[0] + s[4] * l[1] + s[2] * l[2] };
  }
  b.XX = Dot(job.Linear[0], rows[0]);
  b.YY = Dot(job.Linear[1], rows[1]);
  b.ZZ = Dot(job.Linear[2], rows[2]);
  b.XY = Dot(job.Linear[0], rows[1]);
  b.YZ = Dot(job.Linear[1], rows[2]);
  b.XZ = Dot(job.Linear[0], rows[2]);
}

/// Surfels or nodes as they are stored, one in each lane.
struct Stored
{
  Reals3 Position, Area;
  Reals Covariance[6];
  RealMask TwoSided;
};

SURFELSPLATTING_INLINE void GatherSurfels(const SetupJob& job, const std::size_t* index, Stored& s)
{
  s.Position = GatherPosition(job, index);
  const float* a = job.AreaVectors;
  s.Area = { Gather(a, index, 3), Gather(a + 1, index, 3), Gather(a + 2, index, 3) };
  for (int i = 0; i < 6; ++i)
  {
    s.Covariance[i] = Gather(job.Covariances + i, index, 6);
  }
  const unsigned char* twoSided = job.TwoSided;
  s.TwoSided =
    twoSided ? FillLanes<RealMask>([=](int l) { return twoSided[index[l]] ? -1 : 0; }) : RealMask{};
}

/// NodePacking.h.
SURFELSPLATTING_INLINE void GatherNodes(const SetupJob& job, const std::size_t* index, Stored& s)
{
  const HierarchyNode* nodes[RealLaneCount];
  for (int l = 0; l < RealLaneCount; ++l)
  {
    nodes[l] = job.Nodes + (index[l] - job.NumberOfSurfels);
  }
  Reals position[3], normal[3], x[6];
  const Reals areaUnit =
    ToReals(FillLanes<Floats>([&](int l) { return nodes[l]->Area; })) / PackedOne;
  for (int i = 0; i < 3; ++i)
  {
    position[i] = ToReals(FillLanes<Floats>([&](int l) { return nodes[l]->Position[i]; }));
    normal[i] = areaUnit * ToReals(FillLanes<Ints>([&](int l) { return nodes[l]->Normal[i]; }));
  }
  s.Position = { position[0], position[1], position[2] };
  s.Area = { normal[0], normal[1], normal[2] };
  s.TwoSided = FillLanes<RealMask>([&](int l) { return nodes[l]->TwoSided ? -1 : 0; });
  const Reals unit =
    ToReals(FillLanes<Floats>([&](int l) { return nodes[l]->Deviation; })) / PackedOne;
  for (int i = 0; i < 6; ++i)
  {
    x[i] = unit * ToReals(FillLanes<Ints>([&](int l) { return nodes[l]->Factor[i]; }));
  }
  s.Covariance[0] = x[0] * x[0];
  s.Covariance[1] = x[1] * x[1] + x[2] * x[2];
  s.Covariance[2] = x[3] * x[3] + x[4] * x[4] + x[5] * x[5];
  s.Covariance[3] = x[0] * x[1];
  s.Covariance[4] = x[1] * x[3] + x[2] * x[4];
  s.Covariance[5] = x[0] * x[3];
}

/// PlaceSurfel.
SURFELSPLATTING_INLINE void Place(
  const SetupJob& job, const std::size_t* index, const RealMask& present, int level, Batch& b)
{
  Stored stored;
  level > 0 ? GatherNodes(job, index, stored) : GatherSurfels(job, index, stored);
  const Reals3 &local = stored.Position, &area = stored.Area;
  Reals zero = 0.0 * (local.X + local.Y + local.Z) + 0.0 * (area.X + area.Y + area.Z);
  for (const Reals& s : stored.Covariance)
  {
    zero += 0.0 * s;
  }
  const RealMask finite = zero == 0.0;
  b.Invalid = present & ~finite;
  b.P = { Dot(job.Linear[0], local) + job.Translation[0],
    Dot(job.Linear[1], local) + job.Translation[1],
    Dot(job.Linear[2], local) + job.Translation[2] };
  b.Area = { Dot(job.AreaToCamera[0], area), Dot(job.AreaToCamera[1], area),
    Dot(job.AreaToCamera[2], area) };
  b.Alive = present & finite & (b.P.Z >= job.Near) & (b.P.Z <= job.Far);
  b.InverseZ = job.Parallel ? ToReals(1.0) : 1.0 / b.P.Z;
  const double f2 = -job.Fx * job.Fy;
  b.Deposit =
    job.Parallel ? f2 * b.Area.Z : f2 * Dot(b.Area, b.P) * b.InverseZ * b.InverseZ * b.InverseZ;
  b.BackSide = b.Deposit < 0.0;
  b.Deposit = (b.BackSide & stored.TwoSided) ? -b.Deposit : b.Deposit;
  b.Alive &= b.Deposit > 0.0;
  PlaceCovariance(job, stored.Covariance, b);
  if (!job.Parallel)
  {
    b.Alive &= b.P.Z * b.P.Z >= job.Support / job.Tau * b.ZZ;
  }
}
}
}
