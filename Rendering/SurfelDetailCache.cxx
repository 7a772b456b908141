// SPDX-License-Identifier: BSD-3-Clause
#include "SurfelDetailCache.h"

#include "SurfelArrays.h"

#include <vtkDataArray.h>
#include <vtkFieldData.h>
#include <vtkFloatArray.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkUnsignedCharArray.h>
#include <vtkVariant.h>

#include <algorithm>

namespace SurfelSplatting
{
namespace
{
vtkDataArray* LeafCounts(vtkPolyData* input)
{
  return input ? input->GetFieldData()->GetArray(Arrays::Leaves) : nullptr;
}

HierarchyLayout ReadLayout(vtkDataArray* counts)
{
  if (counts->GetNumberOfValues() != HierarchyLayout::NumberOfTrees)
  {
    return HierarchyLayout();
  }
  std::uint64_t leaves[HierarchyLayout::NumberOfTrees];
  for (int tree = 0; tree < HierarchyLayout::NumberOfTrees; ++tree)
  {
    const double count = counts->GetVariantValue(tree).ToDouble();
    leaves[tree] = count >= 0.0 && count < 4294967296.0 ? static_cast<std::uint64_t>(count) : 0;
  }
  return HierarchyLayout(leaves[0], leaves[1]);
}

/// The values of a hierarchy's array of one float for each node, or null.
const float* NodeFloats(vtkPolyData* input, const char* name)
{
  auto* array = vtkFloatArray::SafeDownCast(input->GetPointData()->GetArray(name));
  return array && array->GetNumberOfComponents() == 1 &&
      array->GetNumberOfTuples() == input->GetNumberOfPoints()
    ? array->GetPointer(0)
    : nullptr;
}
}

bool SurfelDetailCache::IsHierarchy(vtkPolyData* input)
{
  return LeafCounts(input) != nullptr;
}

vtkIdType SurfelDetailCache::NumberOfLeaves(vtkPolyData* input)
{
  vtkDataArray* counts = LeafCounts(input);
  const vtkIdType points = input->GetNumberOfPoints();
  return counts ? std::min(points, static_cast<vtkIdType>(ReadLayout(counts).NumberOfLeaves()))
                : points;
}

std::string SurfelDetailCache::Update(
  vtkPolyData* input, vtkUnsignedCharArray* colors, const Executor& executor, SurfelCloud& cloud)
{
  const HierarchyLayout layout = ReadLayout(LeafCounts(input));
  const float* areas = NodeFloats(input, Arrays::Area);
  const float* bounds = NodeFloats(input, Arrays::Bound);
  const float* cones = NodeFloats(input, Arrays::Cone);
  if (layout.NumberOfNodes() != static_cast<std::uint64_t>(input->GetNumberOfPoints()) || !areas ||
    !bounds || !cones)
  {
    return std::string("The input says that it is a hierarchy (field array ") + Arrays::Leaves +
      "), but its " + std::to_string(input->GetNumberOfPoints()) +
      " points are not all its nodes, " + std::to_string(layout.NumberOfNodes()) +
      ", with the arrays " + Arrays::Area + ", " + Arrays::Bound + " and " + Arrays::Cone +
      ". Put vtkSurfelHierarchy after filters that change the points.";
  }
  cloud.NumberOfLeaves = static_cast<std::size_t>(layout.NumberOfLeaves());
  const State inputState{ input, input->GetMTime() };
  if (!(this->InputState == inputState))
  {
    this->Table = DetailTable(cloud, layout, areas, bounds, cones, executor);
    this->InputState = inputState;
    this->ColorState = State();
    this->HasColors = false;
    this->PreparedSurfels += layout.NumberOfLeaves();
  }
  const State colorState{ colors, colors ? colors->GetMTime() : 0 };
  if (colors && !(this->HasColors && this->ColorState == colorState))
  {
    this->Colors = MakeNodeColors(cloud, layout, areas, executor);
    this->ColorState = colorState;
    this->PreparedSurfels += layout.NumberOfLeaves();
  }
  this->HasColors = colors != nullptr;
  cloud.Detail = &this->Table;
  cloud.NodeColors = colors ? this->Colors.Colors.data() : nullptr;
  cloud.NodeGradients = colors ? this->Colors.Gradients.data() : nullptr;
  return std::string();
}
}
