// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Estimation/ThinPoints.h"

#include "Filters/Common/Median.h"
#include "Filters/Common/ParallelFor.h"
#include "Filters/Common/ParallelMedian.h"
#include "Filters/Estimation/PrincipalPlane.h"
#include "Filters/Neighbors/LocalCloud.h"
#include "Filters/Neighbors/NeighborGraph.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <vector>

namespace SurfelGeometry
{
namespace
{
/// Neighbours lie in no plane from this flatness on: those of a wire as thick as its spacing have
/// 0.06 to 0.3, of a surface with noise of a quarter of a spacing 0.05. It is also so many times
/// that of the whole cloud, whose noise it may be.
constexpr float LeastThickness = 0.05f, PerUsualThickness = 1.5f;

/// One in so many points tells what is usual.
constexpr int UsualStride = 16;

/// So many of the neighbours of a thin point lie in no plane either.
constexpr double ThinShare = 0.6;

/// At most so many of the others have the point in their plane, by the sine of the angle to it:
/// beside the edges of boxes, more do.
constexpr int MostInPlanes = 2;
constexpr double InPlaneSine = 0.25;

/// Neighbours that tell the size of a thin point: more are on the next wire.
constexpr int ThinNeighbors = 8;

class ThinTest
{
public:
  ThinTest(const OrientedCloud& oriented, const PlaneFits& fits)
    : Oriented(oriented)
    , Fits(fits)
  {
    const auto samples = static_cast<vtkIdType>((fits.size() + UsualStride - 1) / UsualStride);
    const float usual =
      ParallelMedian(samples, [&fits](vtkIdType k) { return fits[UsualStride * k].Flatness; });
    this->Thickness = std::max(LeastThickness, PerUsualThickness * usual);
  }

  bool IsThin(int i) const
  {
    const PlaneFit& fit = this->Fits[i];
    if (!this->IsThick(fit) || fit.Given || fit.OnScanLines || fit.OnPlate || fit.Sharp ||
      !fit.HasPlane())
    {
      return false;
    }
    const int* ids = this->Oriented.Graph.Row(static_cast<std::size_t>(i));
    const int count = CountIds(ids, KeptNeighbors);
    int thick = 0, inPlane = 0;
    for (int k = 0; k < count; ++k)
    {
      const bool isThick = this->IsThick(this->Fits[ids[k]]);
      thick += isThick ? 1 : 0;
      inPlane += !isThick && this->IsInPlaneOf(ids[k], i) ? 1 : 0;
    }
    return count >= ThinNeighbors && inPlane <= MostInPlanes && thick >= ThinShare * count;
  }

  /// What the nearest neighbours tell, but no more than the usual spacing around.
  float Spacing(int i, Patch& patch, std::vector<float>& around) const
  {
    const LocalCloud& cloud = this->Oriented.Cloud;
    const int* ids = this->Oriented.Graph.Row(static_cast<std::size_t>(i));
    patch.Load(cloud, i, ids, ThinNeighbors);
    const Vector3 second = Load(cloud.Position(ids[1])) - Load(cloud.Position(i));
    const Principal principal(patch.Covariance());
    const double least = LineVariance * Dot(second, second);
    const double area = AreaPerPoint(std::max(principal.Variances[2], least),
      std::max(principal.Variances[1], least), ThinNeighbors);
    around.clear();
    std::transform(ids, ids + CountIds(ids, KeptNeighbors), std::back_inserter(around),
      [this](int j) { return this->Fits[j].Spacing; });
    return std::min({ static_cast<float>(std::sqrt(area)), this->Fits[i].Spacing, Median(around) });
  }

private:
  bool IsInPlaneOf(int j, int i) const
  {
    const LocalCloud& cloud = this->Oriented.Cloud;
    const Vector3 way = Load(cloud.Position(i)) - Load(cloud.Position(j));
    return std::abs(Dot(this->Fits[j].Normal, way)) < InPlaneSine * Norm(way);
  }

  bool IsThick(const PlaneFit& fit) const { return fit.Flatness > this->Thickness; }

  const OrientedCloud& Oriented;
  const PlaneFits& Fits;
  float Thickness; // PlaneFit::Flatness from which neighbours lie in no plane
};
}

bool RoundThinPoints(const OrientedCloud& oriented, const StageProgress& progress, PlaneFits& fits)
{
  const ThinTest test(oriented, fits);
  const int count = oriented.Cloud.Size();
  RawVector<float> spacings(static_cast<std::size_t>(count)); // first all of them, then all changes
  const bool done = ParallelFor(count, progress, [&](vtkIdType begin, vtkIdType end) {
    Patch patch;
    std::vector<float> around;
    for (int i = static_cast<int>(begin); i < end; ++i)
    {
      spacings[i] = test.IsThin(i) ? test.Spacing(i, patch, around) : -1.0f;
    }
  });
  ParallelFor(0, done ? count : 0, [&](vtkIdType i, vtkIdType end) {
    for (; i < end; ++i)
    {
      if (spacings[i] > 0.0f)
      {
        fits[i].OnRod = true;
        fits[i].MakeRound(spacings[i]);
      }
    }
  });
  return done;
}
}
