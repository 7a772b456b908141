// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Arrays/PointAttributes.h"

#include "Filters/Arrays/SurfelOutput.h"

#include "vtkAbstractArray.h"
#include "vtkDataArray.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkSmartPointer.h"

#include <cstring>

namespace SurfelGeometry
{
namespace
{
using SurfelSplatting::Executor;

constexpr std::size_t AttributeGrain = 16384;

/// Copies the tuples of an array that is one block of memory.
void CopyTuples(
  vtkDataArray* source, const TupleOrder& order, const Executor& executor, vtkDataArray* array)
{
  const std::size_t size =
    static_cast<std::size_t>(source->GetNumberOfComponents()) * source->GetDataTypeSize();
  const auto* from = static_cast<const unsigned char*>(source->GetVoidPointer(0));
  auto* to = static_cast<unsigned char*>(array->GetVoidPointer(0));
  executor.For(order.size(), AttributeGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
    {
      std::memcpy(to + size * i, from + size * order[i], size);
    }
  });
}

/// A new array with the source's tuples in the order of the leaves.
vtkSmartPointer<vtkAbstractArray> Reorder(
  vtkAbstractArray* source, const TupleOrder& order, const Executor& executor)
{
  vtkSmartPointer<vtkAbstractArray> array;
  array.TakeReference(source->NewInstance());
  array->SetName(source->GetName());
  array->SetNumberOfComponents(source->GetNumberOfComponents());
  array->SetNumberOfTuples(static_cast<vtkIdType>(order.size()));
  array->CopyComponentNames(source);
  vtkDataArray* numbers = vtkDataArray::SafeDownCast(source);
  // One thread only for bits, which share bytes, and for strings.
  if (numbers && numbers->HasStandardMemoryLayout() && numbers->GetDataType() != VTK_BIT)
  {
    CopyTuples(numbers, order, executor, vtkDataArray::SafeDownCast(array));
    return array;
  }
  for (std::size_t i = 0; i < order.size(); ++i)
  {
    array->SetTuple(static_cast<vtkIdType>(i), order[i], source);
  }
  return array;
}
}

void PassLeafAttributes(vtkPolyData* input, const TupleOrder& surfels, const TupleOrder& points,
  const Executor& executor, vtkPolyData* output)
{
  vtkPointData *from = input->GetPointData(), *to = output->GetPointData();
  for (int i = 0; i < from->GetNumberOfArrays(); ++i)
  {
    vtkAbstractArray* source = from->GetAbstractArray(i);
    const TupleOrder& order = IsOfSurfels(source->GetName()) ? surfels : points;
    const int index = to->AddArray(Reorder(source, order, executor));
    const int attribute = from->IsArrayAnAttribute(i);
    if (attribute >= 0)
    {
      to->SetActiveAttribute(index, attribute);
    }
  }
}
}
