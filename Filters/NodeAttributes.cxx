// SPDX-License-Identifier: BSD-3-Clause
#include "NodeAttributes.h"

#include "vtkAbstractArray.h"
#include "vtkDataArray.h"
#include "vtkDataSetAttributes.h"
#include "vtkPointData.h"
#include "vtkSmartPointer.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace SurfelGeometry
{
namespace
{
using SurfelSplatting::Executor;
using SurfelSplatting::HierarchyLayout;
using SurfelSplatting::LeafOrder;

constexpr std::size_t Grain = 4096;

bool IsIdentifier(vtkPointData* data, vtkAbstractArray* array)
{
  return array == data->GetAbstractAttribute(vtkDataSetAttributes::GLOBALIDS) ||
    array == data->GetAbstractAttribute(vtkDataSetAttributes::PEDIGREEIDS) ||
    array->GetDataType() == VTK_ID_TYPE;
}

/// Calls function(node, first child, second child or the first again) for all nodes of a level.
template <typename Function>
void ForNodes(
  const HierarchyLayout& layout, int level, const Executor& executor, Function&& function)
{
  for (int tree = 0; tree < HierarchyLayout::NumberOfTrees; ++tree)
  {
    const std::size_t below = layout.Begin(level - 1, tree);
    const std::size_t belowCount = layout.Count(level - 1, tree);
    const std::size_t first = layout.Begin(level, tree);
    executor.For(layout.Count(level, tree), Grain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t j = begin; j < end; ++j)
      {
        const std::size_t left = below + 2 * j;
        function(first + j, left, 2 * j + 1 < belowCount ? left + 1 : left);
      }
    });
  }
}

/// Means of one component of all nodes, in double, so that whole numbers are rounded once.
void FillMeans(vtkDataArray* array, int component, const HierarchyLayout& layout,
  const float* areas, const Executor& executor, std::vector<double>& means)
{
  means.resize(layout.NumberOfNodes());
  executor.For(layout.NumberOfLeaves(), Grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
    {
      means[i] = array->GetComponent(static_cast<vtkIdType>(i), component);
    }
  });
  const bool whole = array->GetDataType() != VTK_FLOAT && array->GetDataType() != VTK_DOUBLE;
  for (int level = 1; level < layout.NumberOfLevels(); ++level)
  {
    ForNodes(layout, level, executor, [&](std::size_t node, std::size_t a, std::size_t b) {
      const double area = static_cast<double>(areas[a]) + areas[b];
      const double share = area > 0.0 ? areas[b] / area : 0.5;
      means[node] = means[a] + share * (means[b] - means[a]);
      array->SetComponent(
        static_cast<vtkIdType>(node), component, whole ? std::round(means[node]) : means[node]);
    });
  }
}

vtkSmartPointer<vtkAbstractArray> MakeNodeArray(vtkPointData* input, vtkAbstractArray* source,
  const LeafOrder& order, const float* areas, const Executor& executor)
{
  const HierarchyLayout& layout = order.Layout;
  vtkSmartPointer<vtkAbstractArray> array;
  array.TakeReference(source->NewInstance());
  array->SetName(source->GetName());
  array->SetNumberOfComponents(source->GetNumberOfComponents());
  array->SetNumberOfTuples(static_cast<vtkIdType>(layout.NumberOfNodes()));
  array->CopyComponentNames(source);
  vtkDataArray* numbers = vtkDataArray::SafeDownCast(array);
  const bool averaged = numbers && !IsIdentifier(input, source);
  auto copyLeaves = [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
    {
      array->SetTuple(static_cast<vtkIdType>(i), order.Surfels[i], source);
    }
  };
  // Text is reference-counted memory: one thread.
  numbers ? executor.For(layout.NumberOfLeaves(), Grain, copyLeaves)
          : copyLeaves(0, layout.NumberOfLeaves());
  if (averaged)
  {
    std::vector<double> means;
    for (int component = 0; component < array->GetNumberOfComponents(); ++component)
    {
      FillMeans(numbers, component, layout, areas, executor, means);
    }
    return array;
  }
  for (int level = 1; level < layout.NumberOfLevels(); ++level)
  {
    ForNodes(layout, level, SurfelSplatting::SerialExecutor(),
      [&](std::size_t node, std::size_t a, std::size_t) {
        array->SetTuple(static_cast<vtkIdType>(node), static_cast<vtkIdType>(a), array);
      });
  }
  return array;
}
}

void PassNodeAttributes(vtkPointData* input, const LeafOrder& order, const float* areas,
  const Executor& executor, vtkPointData* output)
{
  for (int i = 0; i < input->GetNumberOfArrays(); ++i)
  {
    vtkAbstractArray* source = input->GetAbstractArray(i);
    if (!source->GetName() || output->GetAbstractArray(source->GetName()) ||
      source->GetNumberOfTuples() < static_cast<vtkIdType>(order.Surfels.size()))
    {
      continue;
    }
    const vtkSmartPointer<vtkAbstractArray> array =
      MakeNodeArray(input, source, order, areas, executor);
    const int index = output->AddArray(array);
    const int attribute = input->IsArrayAnAttribute(i);
    if (attribute >= 0)
    {
      output->SetActiveAttribute(index, attribute);
    }
  }
}
}
