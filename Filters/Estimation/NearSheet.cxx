// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Estimation/NearSheet.h"

#include "Filters/Common/LocalCloud.h"
#include "Filters/Common/Multiversion.h"

#include <cmath>

namespace SurfelGeometry
{
namespace
{
/// What is loaded of each neighbour. Differences are exact in float where neighbours are near each
/// other. Lanes without one have no normal and are of no sheet.
struct RawSheet
{
  alignas(32) float DX[NearSheet::Capacity] = {}, DY[NearSheet::Capacity] = {},
                    DZ[NearSheet::Capacity] = {};
  alignas(32) float NX[NearSheet::Capacity] = {}, NY[NearSheet::Capacity] = {},
                    NZ[NearSheet::Capacity] = {};
  alignas(32) int EitherTwoSided[NearSheet::Capacity] = {};
};

/// Maps the neighbours to the tangent plane, if they are of one sheet: see AreOfOneSheet.
SURFEL_MULTIVERSION void Flatten(
  const RawSheet& raw, const Float3& normal, const Float3& u, const Float3& v, NearSheet& sheet)
{
  constexpr auto leastCosine = static_cast<float>(SheetCosine);
  constexpr auto mostClimb = static_cast<float>(SheetClimb * SheetClimb);
  for (int k = 0; k < NearSheet::Capacity; ++k)
  {
    const float dx = raw.DX[k], dy = raw.DY[k], dz = raw.DZ[k];
    const float cosine = normal.X * raw.NX[k] + normal.Y * raw.NY[k] + normal.Z * raw.NZ[k];
    const float climb = normal.X * dx + normal.Y * dy + normal.Z * dz;
    const float squared = dx * dx + dy * dy + dz * dz;
    const float x = u.X * dx + u.Y * dy + u.Z * dz;
    const float y = v.X * dx + v.Y * dy + v.Z * dz;
    const float flat = x * x + y * y;
    const float agreement = raw.EitherTwoSided[k] != 0 ? std::abs(cosine) : cosine;
    const bool isOfSheet = (agreement >= leastCosine) & (climb * climb <= mostClimb * squared);
    const float scale = isOfSheet ? std::sqrt(squared / (flat > 0.0f ? flat : 1.0f)) : 0.0f;
    sheet.X[k] = scale * x;
    sheet.Y[k] = scale * y;
    sheet.OfSheet[k] = isOfSheet ? 1.0f : 0.0f;
  }
}
}

void NearSheet::Load(
  const OrientedCloud& oriented, const PlaneFits& fits, int i, const int* ids, int count)
{
  const float* p = oriented.Cloud.Position(i);
  const float inverse = 1.0f / fits[i].Spacing;
  RawSheet raw;
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
  TangentFrame(fits[i].Normal, this->U, this->V);
  Flatten(raw, fits[i].Normal, this->U, this->V, *this);
}
}
