// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Arrays/SurfelOutput.h"

#include "Core/Surfels/SurfelArrays.h"
#include "Filters/Arrays/InputArrays.h"
#include "Filters/Arrays/PointCells.h"

#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkFloatArray.h"
#include "vtkIdList.h"
#include "vtkPointData.h"
#include "vtkPointSet.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkUnsignedCharArray.h"

#include <algorithm>
#include <cstring>
#include <iterator>
#include <numeric>

namespace Arrays = SurfelSplatting::Arrays;

namespace SurfelGeometry
{
SurfelOutput::SurfelOutput(vtkIdType count)
  : Positions(MakeArray<vtkFloatArray>("Points", 3, count))
  , Covariances(MakeArray<vtkFloatArray>(Arrays::Covariance, 6, count))
  , AreaVectors(MakeArray<vtkFloatArray>(Arrays::AreaVector, 3, count))
  , TwoSided(MakeArray<vtkUnsignedCharArray>(Arrays::TwoSided, 1, count))
  , Overlaps(MakeArray<vtkUnsignedCharArray>(Arrays::Overlap, 1, count))
{
  this->Overlaps->FillValue(0);
}

void SurfelOutput::Write(const double origin[3], vtkPolyData* output) const
{
  vtkNew<vtkPoints> points;
  points->SetData(this->Positions);
  output->SetPoints(points);
  output->SetVerts(MakePointCell(this->Positions->GetNumberOfTuples()));
  output->GetPointData()->AddArray(this->Covariances);
  output->GetPointData()->AddArray(this->AreaVectors);
  output->GetPointData()->AddArray(this->TwoSided);
  output->GetPointData()->AddArray(this->Overlaps);
  RemoveHierarchy(output);
  auto array = MakeArray<vtkDoubleArray>(Arrays::Origin, 3, 1);
  array->SetTuple(0, origin);
  output->GetFieldData()->AddArray(array);
}

bool IsOfSurfels(const char* name)
{
  return name &&
    std::any_of(std::begin(SurfelOutput::Names), std::end(SurfelOutput::Names),
      [name](const char* other) { return std::strcmp(name, other) == 0; });
}

void RemoveHierarchy(vtkPolyData* surfels)
{
  vtkFieldData* data = surfels->GetFieldData();
  data->RemoveArray(Arrays::Leaves);
  data->RemoveArray(Arrays::Nodes);
  for (const char* name : Arrays::Computed)
  {
    data->RemoveArray(name);
  }
}

void PassPointData(vtkPointSet* input, const std::vector<char>& kept, vtkPolyData* output)
{
  output->GetFieldData()->PassData(input->GetFieldData());
  const auto count = static_cast<vtkIdType>(std::count(kept.begin(), kept.end(), char{ 1 }));
  if (count == input->GetNumberOfPoints())
  {
    output->GetPointData()->PassData(input->GetPointData());
    return;
  }
  vtkNew<vtkIdList> from, to;
  from->SetNumberOfIds(count);
  to->SetNumberOfIds(count);
  std::iota(to->GetPointer(0), to->GetPointer(0) + count, vtkIdType{ 0 });
  vtkIdType next = 0;
  for (std::size_t i = 0; i < kept.size(); ++i)
  {
    if (kept[i])
    {
      from->SetId(next++, static_cast<vtkIdType>(i));
    }
  }
  output->GetPointData()->CopyAllOn();
  output->GetPointData()->CopyAllocate(input->GetPointData(), count);
  output->GetPointData()->CopyData(input->GetPointData(), from, to);
}
}
