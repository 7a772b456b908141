// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Estimation/SurfaceHeights.h"

#include "Filters/Common/Multiversion.h"
#include "Filters/Estimation/NearSheet.h"

#include <algorithm>
#include <cstddef>

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

class HeightMeasurer
{
public:
  HeightMeasurer(const OrientedCloud& oriented, const PlaneFits& fits)
    : Oriented(oriented)
    , Fits(fits)
  {
  }

  /// @param raised [n] what all points have risen so far, world units; or null
  float Measure(int i, const float* raised)
  {
    const PlaneFit& fit = this->Fits[i];
    if (fit.Isolated || fit.Degenerate || !(fit.Spacing > 0.0f) || fit.Flatness < FlatEnough)
    {
      return 0.0f;
    }
    const int* ids = this->Oriented.Graph.Row(static_cast<std::size_t>(i));
    const int count = CountIds(ids, KeptNeighbors);
    this->Near.Load(this->Oriented, this->Fits, i, ids, count);
    for (int k = 0; k < count && raised; ++k)
    {
      this->Raised[k] = (raised[ids[k]] - raised[i]) / fit.Spacing;
    }
    const bool hasFold = LaneSum(this->Near.Folded) > 0.0f; // normals may be means over it
    const float mean = hasFold ? 0.0f : MeanHeight(this->Near, this->Raised);
    return (raised ? raised[i] : 0.0f) + fit.Spacing * mean;
  }

private:
  const OrientedCloud& Oriented;
  const PlaneFits& Fits;
  NearSheet Near;
  alignas(32) float Raised[NearSheet::Capacity] = {};
};
}

bool MeasureHeights(const OrientedCloud& oriented, const PlaneFits& fits,
  const StageProgress& progress, RawVector<float>& heights)
{
  const auto measure = [&](const float* raised, RawVector<float>& result) {
    return [&, raised](vtkIdType i, vtkIdType end) {
      HeightMeasurer measurer(oriented, fits);
      for (; i < end; ++i)
      {
        result[i] = measurer.Measure(static_cast<int>(i), raised);
      }
    };
  };
  const vtkIdType count = oriented.Cloud.Size();
  RawVector<float> first(fits.size());
  heights.resize(fits.size());
  return ParallelFor(count, progress.Part(0.0, 0.5), measure(nullptr, first)) &&
    ParallelFor(count, progress.Part(0.5, 1.0), measure(first.data(), heights));
}
}
