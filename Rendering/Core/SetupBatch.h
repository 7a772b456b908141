// SPDX-License-Identifier: BSD-3-Clause
/**
 * Of SetupKernelImplementation.h: as many surfels as a vector has lanes, and how they get into
 * camera space.
 */
#pragma once

#include "RealLanes.h"
#include "SetupKernel.h"

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
  Floats x;
  for (int l = 0; l < RealLaneCount; ++l)
  {
    x[l] = field[stride * index[l]];
  }
  return ToReals(x);
}

SURFELSPLATTING_INLINE Reals3 GatherPosition(const SetupJob& job, const std::size_t* index)
{
  if (job.PositionsFloat)
  {
    const float* p = job.PositionsFloat;
    return { Gather(p, index, 3), Gather(p + 1, index, 3), Gather(p + 2, index, 3) };
  }
  Reals3 p;
  for (int l = 0; l < RealLaneCount; ++l)
  {
    const double* source = job.PositionsDouble + 3 * index[l];
    p.X[l] = source[0];
    p.Y[l] = source[1];
    p.Z[l] = source[2];
  }
  return p;
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

/// PlaceSurfel.
SURFELSPLATTING_INLINE void Place(
  const SetupJob& job, const std::size_t* index, const RealMask& present, Batch& b)
{
  const Reals3 local = GatherPosition(job, index);
  const float* a = job.AreaVectors;
  const Reals3 area{ Gather(a, index, 3), Gather(a + 1, index, 3), Gather(a + 2, index, 3) };
  Reals s[6];
  Reals zero = 0.0 * (local.X + local.Y + local.Z) + 0.0 * (area.X + area.Y + area.Z);
  for (int i = 0; i < 6; ++i)
  {
    s[i] = Gather(job.Covariances + i, index, 6);
    zero += 0.0 * s[i];
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
  if (job.TwoSided)
  {
    RealMask twoSided;
    for (int l = 0; l < RealLaneCount; ++l)
    {
      twoSided[l] = job.TwoSided[index[l]] ? -1 : 0;
    }
    b.Deposit = (b.BackSide & twoSided) ? -b.Deposit : b.Deposit;
  }
  b.Alive &= b.Deposit > 0.0;
  PlaceCovariance(job, s, b);
  if (!job.Parallel)
  {
    b.Alive &= b.P.Z * b.P.Z >= job.Support / job.Tau * b.ZZ;
  }
}
}
}
