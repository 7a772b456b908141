// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Estimation/NearSheet.h"

#include "Core/Simd/Multiversion.h"
#include "Filters/Neighbors/LocalCloud.h"
#include "Filters/Neighbors/SurfaceFold.h"

namespace SurfelGeometry
{
namespace
{
/// Maps the neighbours to the tangent plane, if they are of one sheet (AreOfOneSheet) or across a
/// fold within a distance.
SURFEL_MULTIVERSION void Flatten(const NearSheet::Raw& raw, const Float3& normal, const Float3& u,
  const Float3& v, float foldReach, NearSheet& sheet)
{
  constexpr auto leastCosine = static_cast<float>(SheetCosine);
  constexpr auto mostClimb = static_cast<float>(SheetClimb * SheetClimb);
  for (int k = 0; k < NearSheet::Capacity; ++k)
  {
    const float dx = raw.DX[k], dy = raw.DY[k], dz = raw.DZ[k];
    const float cosine = normal.X * raw.NX[k] + normal.Y * raw.NY[k] + normal.Z * raw.NZ[k];
    const float climb = normal.X * dx + normal.Y * dy + normal.Z * dz;
    const float otherClimb = raw.NX[k] * dx + raw.NY[k] * dy + raw.NZ[k] * dz;
    const float agreeing = AgreeingSign(cosine, climb, otherClimb);
    const float sign = raw.EitherTwoSided[k] != 0 ? agreeing : 1.0f;
    const float nx = sign * raw.NX[k], ny = sign * raw.NY[k], nz = sign * raw.NZ[k];
    FoldedNeighbor at;
    at.X = u.X * dx + u.Y * dy + u.Z * dz;
    at.Y = v.X * dx + v.Y * dy + v.Z * dz;
    at.Climb = climb;
    at.OtherClimb = sign * otherClimb;
    at.Cosine = sign * cosine;
    at.TiltX = u.X * nx + u.Y * ny + u.Z * nz;
    at.TiltY = v.X * nx + v.Y * ny + v.Z * nz;
    const float squared = dx * dx + dy * dy + dz * dz;
    const bool isOfSheet =
      (at.Cosine >= leastCosine) & (at.Climb * at.Climb <= mostClimb * squared);
    const bool isNear = isOfSheet | at.HasFoldWithin(foldReach);
    sheet.Folded[k] = isNear & at.HasFold() ? 1.0f : 0.0f;
    sheet.Cosines[k] = at.Cosine;
    sheet.Heights[k] = 0.5f * (at.Climb + at.OtherClimb);
    at.Unroll();
    sheet.X[k] = isNear ? at.X : 0.0f;
    sheet.Y[k] = isNear ? at.Y : 0.0f;
    sheet.OfSheet[k] = isOfSheet ? 1.0f : 0.0f;
  }
}
}

void NearSheet::Load(const OrientedCloud& oriented, const PlaneFits& fits, int i, const int* ids,
  int count, float foldReach)
{
  const float* p = oriented.Cloud.Position(i);
  const float inverse = 1.0f / fits[i].Spacing;
  Raw& raw = this->Neighbors;
  for (int k = 0; k < count; ++k)
  {
    const int j = ids[k];
    const float* q = oriented.Cloud.Position(j);
    const Float3& normal = fits[j].Normal;
    raw.DX[k] = inverse * (q[0] - p[0]);
    raw.DY[k] = inverse * (q[1] - p[1]);
    raw.DZ[k] = inverse * (q[2] - p[2]);
    raw.NX[k] = normal.X;
    raw.NY[k] = normal.Y;
    raw.NZ[k] = normal.Z;
    raw.EitherTwoSided[k] = oriented.TwoSided[i] | oriented.TwoSided[j];
  }
  for (int k = count; k < this->Loaded; ++k)
  {
    raw.DX[k] = raw.DY[k] = raw.DZ[k] = raw.NX[k] = raw.NY[k] = raw.NZ[k] = 0.0f;
    raw.EitherTwoSided[k] = 0;
  }
  this->Loaded = count;
  TangentFrame(fits[i].Normal, this->U, this->V);
  Flatten(raw, fits[i].Normal, this->U, this->V, foldReach, *this);
}
}
