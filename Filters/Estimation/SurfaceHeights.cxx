// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Estimation/SurfaceHeights.h"

#include "Core/Simd/Multiversion.h"
#include "Filters/Neighbors/LocalCloud.h"

namespace SurfelGeometry
{
namespace
{
/// Points that are flatter than this do not rise: noise of a 30th of a spacing leaves no holes.
constexpr float FlatEnough = 1e-3f;

/// The mean height of a point, 0, and of its neighbours on the sheet, weighted by
/// (n.m)^16 (1 - h^4)^2. On thin tubes, normals tell less of the surface between the points; what
/// is a spacing or more above or below is another sheet.
/// @param raised [NearSheet::Capacity] how far the neighbours have risen, spacings of the point
SURFEL_MULTIVERSION float MeanHeight(const NearSheet& near, const float* raised)
{
  alignas(32) float weights[NearSheet::Capacity], heights[NearSheet::Capacity];
  for (int k = 0; k < NearSheet::Capacity; ++k)
  {
    const float second = near.Cosines[k] * near.Cosines[k], fourth = second * second;
    const float eighth = fourth * fourth;
    const float height = near.Heights[k] + raised[k], squared = height * height;
    const float rest = 1.0f - squared * squared, alike = rest > 0.0f ? rest : 0.0f;
    weights[k] = near.OfSheet[k] * eighth * eighth * alike * alike;
    heights[k] = height;
  }
  return LaneDot(weights, heights) / (1.0f + LaneSum(weights));
}

bool HasHeight(const PlaneFit& fit)
{
  return fit.HasPlane() && fit.Spacing > 0.0f && !(fit.Flatness < FlatEnough);
}

/// Normals may be means over a fold of the sheet.
bool HasFold(const NearSheet& sheet)
{
  return LaneDot(sheet.Folded, sheet.OfSheet) > 0.0f;
}
}

void SurfaceHeights::Resize(std::size_t count)
{
  this->First.resize(count);
  this->Final.resize(count);
}

void SurfaceHeights::Rise(int i, const PlaneFit& fit, const NearSheet& sheet)
{
  constexpr float flat[NearSheet::Capacity] = {};
  this->First[i] = HasHeight(fit) && !HasFold(sheet) ? fit.Spacing * MeanHeight(sheet, flat) : 0.0f;
}

bool SurfaceHeights::RiseAll(
  const OrientedCloud& oriented, const PlaneFits& fits, const StageProgress& progress)
{
  return ParallelFor(oriented.Cloud.Size(), progress, [&](vtkIdType i, vtkIdType end) {
    NearSheet sheet;
    for (; i < end; ++i)
    {
      if (HasHeight(fits[i]))
      {
        const int* ids = oriented.Graph.Row(static_cast<std::size_t>(i));
        sheet.Load(oriented, fits, static_cast<int>(i), ids, CountIds(ids, KeptNeighbors));
      }
      this->Rise(static_cast<int>(i), fits[i], sheet);
    }
  });
}

void SurfaceHeights::RiseAgain(
  int i, const PlaneFit& fit, const NearSheet& sheet, const int* ids, int count)
{
  const float first = this->First[i];
  this->Final[i] = first;
  if (HasHeight(fit) && !HasFold(sheet))
  {
    alignas(32) float raised[NearSheet::Capacity] = {};
    for (int k = 0; k < count; ++k)
    {
      raised[k] = (this->First[ids[k]] - first) / fit.Spacing;
    }
    this->Final[i] += fit.Spacing * MeanHeight(sheet, raised);
  }
}
}
