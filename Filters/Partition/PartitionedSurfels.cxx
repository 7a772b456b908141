// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Partition/PartitionedSurfels.h"

#include "Core/Surfels/SurfelArrays.h"
#include "Filters/Arrays/InputArrays.h"
#include "Filters/Arrays/PointColors.h"
#include "Filters/Arrays/SurfelOutput.h"

#include "vtkFloatArray.h"
#include "vtkIdTypeArray.h"
#include "vtkPointData.h"
#include "vtkPointSet.h"
#include "vtkPolyData.h"
#include "vtkUnsignedCharArray.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

namespace Arrays = SurfelSplatting::Arrays;

namespace SurfelGeometry
{
namespace
{
/// How far the neighbourhood of a surfel may reach, in square roots of its area: on an even surface
/// 20 neighbours are within 2.5, and the normalization looks as far again.
constexpr double Reach = 6.0;

/// Values that are sent for a surfel: position, covariance, area vector, two-sided; then its
/// colour, if any process has colours.
constexpr int SurfelComponents = 3 + 6 + 3 + 1;

/// Index in the fetched cloud.
vtkIdType RegionPointId(vtkPolyData* surfels, vtkIdType i)
{
  auto* ids =
    vtkIdTypeArray::SafeDownCast(surfels->GetPointData()->GetArray(PartitionedCloud::IdArray));
  return ids->GetValue(i);
}

double AreaOf(vtkPolyData* surfels, vtkIdType i)
{
  double a[3];
  surfels->GetPointData()->GetArray(Arrays::AreaVector)->GetTuple(i, a);
  return std::hypot(a[0], a[1], a[2]);
}

/// Whether too many of the region's surfels may have neighbours beyond its halo.
bool IsTooNarrow(const PartitionedCloud& cloud, double haloWidth, vtkPolyData* surfels)
{
  vtkIdType all = 0, uncertain = 0;
  for (vtkIdType i = 0; i < surfels->GetNumberOfPoints(); ++i)
  {
    const vtkIdType point = RegionPointId(surfels, i);
    if (cloud.IsInRegion(point))
    {
      const double side = cloud.Region().DistanceToSide(cloud.Position(point));
      ++all;
      uncertain += MayReachBeyond(AreaOf(surfels, i), haloWidth + side) ? 1 : 0;
    }
  }
  return static_cast<double>(uncertain) > ToleratedShare * static_cast<double>(all);
}

/// The surfels of this rank's region.
PartitionedCloud::Results PackSurfels(const PartitionedCloud& cloud, vtkPolyData* surfels)
{
  PartitionedCloud::Results results;
  vtkDataArray* colors = FindColors(surfels);
  results.Components = SurfelComponents + (colors ? ColorComponents : 0);
  double origin[3];
  ReadOrigin(surfels, origin);
  vtkPointData* data = surfels->GetPointData();
  for (vtkIdType i = 0; i < surfels->GetNumberOfPoints(); ++i)
  {
    const vtkIdType point = RegionPointId(surfels, i);
    if (!cloud.IsInRegion(point))
    {
      continue;
    }
    results.Points.push_back(point);
    double tuple[6];
    surfels->GetPoint(i, tuple);
    for (int c = 0; c < 3; ++c)
    {
      results.Values.push_back(static_cast<float>(tuple[c] + (origin[c] - cloud.Origin()[c])));
    }
    for (const char* name : { Arrays::Covariance, Arrays::AreaVector, Arrays::TwoSided })
    {
      vtkDataArray* array = data->GetArray(name);
      array->GetTuple(i, tuple);
      results.Values.insert(results.Values.end(), tuple, tuple + array->GetNumberOfComponents());
    }
    if (colors)
    {
      colors->GetTuple(i, tuple);
      results.Values.insert(results.Values.end(), tuple, tuple + ColorComponents);
    }
  }
  return results;
}

/// The surfels of this rank's points. @return their number
vtkIdType UnpackSurfels(const PartitionedCloud::Returned& returned, int components,
  const double origin[3], bool hasColors, vtkPolyData* output)
{
  const auto count =
    static_cast<vtkIdType>(std::count(returned.Has.begin(), returned.Has.end(), char{ 1 }));
  const SurfelOutput own(count);
  CloudColors colors;
  const bool areColored = components > SurfelComponents && hasColors;
  vtkIdType to = 0;
  for (size_t i = 0; i < returned.Has.size(); ++i)
  {
    if (returned.Has[i])
    {
      const float* values = returned.Values.data() + components * i;
      own.Positions->SetTypedTuple(to, values);
      own.Covariances->SetTypedTuple(to, values + 3);
      own.AreaVectors->SetTypedTuple(to, values + 9);
      own.TwoSided->SetValue(to, values[12] != 0.0f ? 1 : 0);
      for (int c = 0; areColored && c < ColorComponents; ++c)
      {
        colors.push_back(static_cast<unsigned char>(values[SurfelComponents + c]));
      }
      ++to;
    }
  }
  own.Write(origin, output);
  if (areColored)
  {
    std::vector<int> order(count);
    std::iota(order.begin(), order.end(), 0);
    WriteColors(colors, order, output);
  }
  return count;
}

/// Area vectors and overlaps of this rank's region.
PartitionedCloud::Results PackAreas(const PartitionedCloud& cloud, vtkPolyData* surfels)
{
  PartitionedCloud::Results results;
  results.Components = 4;
  for (vtkIdType i = 0; i < surfels->GetNumberOfPoints(); ++i)
  {
    const vtkIdType point = RegionPointId(surfels, i);
    if (cloud.IsInRegion(point))
    {
      results.Points.push_back(point);
      double a[3];
      surfels->GetPointData()->GetArray(Arrays::AreaVector)->GetTuple(i, a);
      results.Values.insert(results.Values.end(), a, a + 3);
      surfels->GetPointData()->GetArray(Arrays::Overlap)->GetTuple(i, a);
      results.Values.push_back(static_cast<float>(a[0]));
    }
  }
  return results;
}

/// Those of this rank's surfels.
void UnpackAreas(const PartitionedCloud::Returned& returned, vtkPolyData* output)
{
  vtkDataArray* own = output->GetPointData()->GetArray(Arrays::AreaVector);
  if (!own)
  {
    return; // this rank has no surfels
  }
  vtkNew<vtkFloatArray> areas;
  areas->DeepCopy(own);
  areas->SetName(Arrays::AreaVector);
  const auto overlaps =
    MakeArray<vtkUnsignedCharArray>(Arrays::Overlap, 1, areas->GetNumberOfTuples());
  overlaps->FillValue(0);
  for (size_t i = 0; i < returned.Has.size(); ++i)
  {
    if (returned.Has[i])
    {
      const float* values = returned.Values.data() + 4 * i;
      areas->SetTypedTuple(static_cast<vtkIdType>(i), values);
      overlaps->SetValue(static_cast<vtkIdType>(i), static_cast<unsigned char>(values[3]));
    }
  }
  output->GetPointData()->AddArray(areas);
  output->GetPointData()->AddArray(overlaps);
}
}

bool MayReachBeyond(double area, double distance)
{
  return distance < Reach * std::sqrt(area);
}

vtkSmartPointer<vtkPolyData> WorkOnRegion(SurfelSplatting::Ranks& ranks, PartitionedCloud& cloud,
  const std::vector<PartitionedCloud::Array>& arrays, double haloWidth,
  const std::function<vtkSmartPointer<vtkPolyData>(vtkPolyData*)>& work)
{
  haloWidth = std::max(haloWidth, cloud.HaloWidth(HaloSpacings));
  for (int widenings = 0;; ++widenings, haloWidth *= 2.0)
  {
    const vtkSmartPointer<vtkPolyData> surfels = work(cloud.Fetch(haloWidth, arrays));
    if (!ranks.All(surfels != nullptr))
    {
      return nullptr;
    }
    if (!ranks.Any(IsTooNarrow(cloud, haloWidth, surfels)) || widenings == MaximumWidenings)
    {
      return surfels;
    }
  }
}

vtkIdType WritePartitionedSurfels(SurfelSplatting::Ranks& ranks, PartitionedCloud& cloud,
  vtkPolyData* surfels, vtkPointSet* input, vtkPolyData* output)
{
  PartitionedCloud::Results results;
  ranks.DoOwn([&] { results = PackSurfels(cloud, surfels); });
  const PartitionedCloud::Returned returned = cloud.Return(results);
  vtkIdType count = 0;
  ranks.DoOwn([&] {
    PassPointData(input, returned.Has, output);
    count = UnpackSurfels(returned, results.Components, cloud.Origin(), FindColors(input), output);
  });
  return count;
}

void WritePartitionedAreas(
  SurfelSplatting::Ranks& ranks, PartitionedCloud& cloud, vtkPolyData* surfels, vtkPolyData* output)
{
  PartitionedCloud::Results results;
  ranks.DoOwn([&] { results = PackAreas(cloud, surfels); });
  const PartitionedCloud::Returned returned = cloud.Return(results);
  ranks.DoOwn([&] { UnpackAreas(returned, output); });
}
}
