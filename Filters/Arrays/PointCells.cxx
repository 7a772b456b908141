// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Arrays/PointCells.h"

#include "Filters/Common/ParallelFor.h"

#include "vtkCellArray.h"
#include "vtkNew.h"
#include "vtkTypeInt32Array.h"
#include "vtkTypeInt64Array.h"

#include <limits>

namespace SurfelGeometry
{
namespace
{
template <typename Array>
void Fill(vtkIdType count, vtkCellArray* cells)
{
  vtkNew<Array> offsets, connectivity;
  offsets->InsertNextValue(0);
  offsets->InsertNextValue(static_cast<typename Array::ValueType>(count));
  connectivity->SetNumberOfValues(count);
  auto* ids = connectivity->GetPointer(0);
  ParallelFor(0, count, [ids](vtkIdType begin, vtkIdType end) {
    for (vtkIdType i = begin; i < end; ++i)
    {
      ids[i] = static_cast<typename Array::ValueType>(i);
    }
  });
  cells->SetData(offsets, connectivity);
}
}

vtkSmartPointer<vtkCellArray> MakePointCell(vtkIdType count)
{
  auto cells = vtkSmartPointer<vtkCellArray>::New();
  if (count > std::numeric_limits<vtkTypeInt32>::max())
  {
    Fill<vtkTypeInt64Array>(count, cells);
  }
  else if (count > 0)
  {
    Fill<vtkTypeInt32Array>(count, cells);
  }
  return cells;
}
}
