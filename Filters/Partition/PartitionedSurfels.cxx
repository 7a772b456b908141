// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Partition/PartitionedSurfels.h"

#include "Core/Surfels/SurfelArrays.h"
#include "Filters/Common/InputArrays.h"
#include "Filters/Common/PointCells.h"

#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkFloatArray.h"
#include "vtkIdList.h"
#include "vtkIdTypeArray.h"
#include "vtkPointData.h"
#include "vtkPointSet.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkUnsignedCharArray.h"

#include <algorithm>
#include <cmath>

namespace Arrays = SurfelSplatting::Arrays;

namespace SurfelGeometry
{
namespace
{
/// What the neighbourhood of a surfel may reach, in roots of its area: 20 neighbours of an even
/// surface lie within 2.5, and the weights look as far again.
constexpr double Reach = 6.0;

vtkIdType DealtId(vtkPolyData* surfels, vtkIdType i)
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

/// Whether too many of the region's surfels may have neighbours beyond its border.
bool IsTooNarrow(const PartitionedCloud& cloud, double margin, vtkPolyData* surfels)
{
  vtkIdType all = 0, doubtful = 0;
  for (vtkIdType i = 0; i < surfels->GetNumberOfPoints(); ++i)
  {
    const vtkIdType dealt = DealtId(surfels, i);
    if (cloud.IsMine(dealt))
    {
      const double side = cloud.Region().DistanceToSide(cloud.Position(dealt));
      ++all;
      doubtful += IsDoubtful(AreaOf(surfels, i), margin + side) ? 1 : 0;
    }
  }
  return static_cast<double>(doubtful) > LeastDoubt * static_cast<double>(all);
}

/// Point data of the input's points that have a surfel.
void PassArrays(vtkPointSet* input, const std::vector<char>& has, vtkPolyData* output)
{
  vtkNew<vtkIdList> from, to;
  for (size_t i = 0; i < has.size(); ++i)
  {
    if (has[i])
    {
      to->InsertNextId(from->GetNumberOfIds());
      from->InsertNextId(static_cast<vtkIdType>(i));
    }
  }
  output->GetPointData()->CopyAllOn();
  output->GetPointData()->CopyAllocate(input->GetPointData(), from->GetNumberOfIds());
  output->GetPointData()->CopyData(input->GetPointData(), from, to);
  output->GetFieldData()->PassData(input->GetFieldData());
}
}

bool IsDoubtful(double area, double reach)
{
  return reach < Reach * std::sqrt(area);
}

vtkSmartPointer<vtkPolyData> WorkOnRegion(SurfelSplatting::Ranks& ranks, PartitionedCloud& cloud,
  const std::vector<PartitionedCloud::Array>& arrays, double margin,
  const std::function<vtkSmartPointer<vtkPolyData>(vtkPolyData*)>& work)
{
  margin = std::max(margin, cloud.Margin(BorderSpacings));
  for (int widenings = 0;; ++widenings, margin *= 2.0)
  {
    const vtkSmartPointer<vtkPolyData> surfels = work(cloud.Fetch(margin, arrays));
    if (!ranks.All(surfels != nullptr))
    {
      return nullptr;
    }
    if (!ranks.Any(IsTooNarrow(cloud, margin, surfels)) || widenings == MostWidenings)
    {
      return surfels;
    }
  }
}

vtkIdType WritePartitionedSurfels(
  PartitionedCloud& cloud, vtkPolyData* surfels, vtkPointSet* input, vtkPolyData* output)
{
  PartitionedCloud::Results results;
  results.Components = 13;
  double origin[3];
  ReadOrigin(surfels, origin);
  vtkPointData* data = surfels->GetPointData();
  for (vtkIdType i = 0; i < surfels->GetNumberOfPoints(); ++i)
  {
    if (!cloud.IsMine(DealtId(surfels, i)))
    {
      continue;
    }
    results.Dealt.push_back(DealtId(surfels, i));
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
  }
  const PartitionedCloud::Returned returned = cloud.Return(results);
  const auto count =
    static_cast<vtkIdType>(std::count(returned.Has.begin(), returned.Has.end(), char{ 1 }));
  auto positions = MakeArray<vtkFloatArray>("Points", 3, count);
  auto covariances = MakeArray<vtkFloatArray>(Arrays::Covariance, 6, count);
  auto areas = MakeArray<vtkFloatArray>(Arrays::AreaVector, 3, count);
  auto twoSided = MakeArray<vtkUnsignedCharArray>(Arrays::TwoSided, 1, count);
  vtkIdType to = 0;
  for (size_t i = 0; i < returned.Has.size(); ++i)
  {
    if (returned.Has[i])
    {
      const float* values = returned.Values.data() + 13 * i;
      positions->SetTypedTuple(to, values);
      covariances->SetTypedTuple(to, values + 3);
      areas->SetTypedTuple(to, values + 9);
      twoSided->SetValue(to, values[12] != 0.0f ? 1 : 0);
      ++to;
    }
  }
  vtkNew<vtkPoints> points;
  points->SetData(positions);
  output->SetPoints(points);
  output->SetVerts(MakePointCell(count));
  PassArrays(input, returned.Has, output);
  output->GetPointData()->AddArray(covariances);
  output->GetPointData()->AddArray(areas);
  output->GetPointData()->AddArray(twoSided);
  auto common = MakeArray<vtkDoubleArray>(Arrays::Origin, 3, 1);
  common->SetTuple(0, cloud.Origin());
  output->GetFieldData()->AddArray(common);
  return count;
}

void WritePartitionedAreas(PartitionedCloud& cloud, vtkPolyData* surfels, vtkPolyData* output)
{
  PartitionedCloud::Results results;
  results.Components = 3;
  for (vtkIdType i = 0; i < surfels->GetNumberOfPoints(); ++i)
  {
    if (cloud.IsMine(DealtId(surfels, i)))
    {
      results.Dealt.push_back(DealtId(surfels, i));
      double a[3];
      surfels->GetPointData()->GetArray(Arrays::AreaVector)->GetTuple(i, a);
      results.Values.insert(results.Values.end(), a, a + 3);
    }
  }
  const PartitionedCloud::Returned returned = cloud.Return(results);
  vtkDataArray* own = output->GetPointData()->GetArray(Arrays::AreaVector);
  if (!own)
  {
    return; // a rank without surfels
  }
  vtkNew<vtkFloatArray> areas;
  areas->DeepCopy(own);
  areas->SetName(Arrays::AreaVector);
  for (size_t i = 0; i < returned.Has.size(); ++i)
  {
    if (returned.Has[i])
    {
      areas->SetTypedTuple(static_cast<vtkIdType>(i), returned.Values.data() + 3 * i);
    }
  }
  output->GetPointData()->AddArray(areas);
}
}
