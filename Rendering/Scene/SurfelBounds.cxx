// SPDX-License-Identifier: BSD-3-Clause
#include "Rendering/Scene/SurfelBounds.h"

#include "Core/Surfels/SurfelArrays.h"
#include "SurfelData/HierarchyArrays.h"

#include <vtkBoundingBox.h>
#include <vtkDataArray.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace SurfelSplatting
{
namespace
{
bool FindStoredBounds(vtkPolyData* surfels, double bounds[6])
{
  constexpr std::size_t bytes = 6 * sizeof(double);
  vtkDataArray* stored = FindComputed(surfels, Arrays::Bounds, bytes, 1);
  if (!stored || stored->GetDataType() != VTK_DOUBLE)
  {
    return false;
  }
  stored->GetTuple(0, bounds);
  return std::all_of(bounds, bounds + 6, [](double x) { return std::isfinite(x); });
}

/// Adds a centre, or the centre widened by the standard deviations along the axes.
/// @param s covariance, beginning with XX, YY, ZZ
void AddKernel(const double p[3], const double s[6], bool widened, vtkBoundingBox& box)
{
  double low[3], high[3];
  for (int i = 0; i < 3; ++i)
  {
    const double deviation = widened && s[i] > 0.0 ? std::sqrt(s[i]) : 0.0;
    low[i] = p[i] - deviation;
    high[i] = p[i] + deviation;
  }
  box.AddPoint(low);
  box.AddPoint(high);
}
}

bool FindSurfelBounds(vtkPolyData* surfels, double bounds[6])
{
  if (FindStoredBounds(surfels, bounds))
  {
    return true;
  }
  // Surfels that are not drawn do not count: a single NaN, as organised scans have them, would
  // break ResetCamera.
  vtkBoundingBox box;
  double largest = 0.0;
  vtkDataArray* covariance = surfels->GetPointData()->GetArray(Arrays::GaussianCovariance);
  const bool isInSpace = covariance != nullptr;
  covariance = isInSpace ? covariance : surfels->GetPointData()->GetArray(Arrays::Covariance);
  if (covariance &&
    (covariance->GetNumberOfComponents() != 6 ||
      covariance->GetNumberOfTuples() != surfels->GetNumberOfPoints()))
  {
    covariance = nullptr;
  }
  for (vtkIdType i = 0; i < surfels->GetNumberOfPoints(); ++i)
  {
    double p[3], s[6] = { 0, 0, 0, 0, 0, 0 };
    surfels->GetPoint(i, p);
    if (covariance)
    {
      covariance->GetTuple(i, s);
    }
    const double trace = s[0] + s[1] + s[2];
    if (std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]) && std::isfinite(trace))
    {
      AddKernel(p, s, isInSpace, box);
      largest = isInSpace ? 0.0 : std::max(largest, trace);
    }
  }
  if (!box.IsValid())
  {
    return false;
  }
  box.Inflate(std::sqrt(largest));
  box.GetBounds(bounds);
  return true;
}
}
