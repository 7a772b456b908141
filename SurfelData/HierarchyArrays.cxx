// SPDX-License-Identifier: BSD-3-Clause
#include "SurfelData/HierarchyArrays.h"

#include "Core/Surfels/SurfelArrays.h"

#include <vtkDataArray.h>
#include <vtkFieldData.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkUnsignedCharArray.h>
#include <vtkVariant.h>

#include <algorithm>
#include <cstdint>
#include <iterator>

namespace SurfelSplatting
{
namespace
{
vtkDataArray* LeafCounts(vtkPolyData* input)
{
  return input ? input->GetFieldData()->GetArray(Arrays::Leaves) : nullptr;
}

/// What nodes are computed from, but for the places of the surfels.
constexpr const char* SourcesOfNodes[] = { Arrays::Covariance, Arrays::AreaVector, Arrays::TwoSided,
  Arrays::Overlap, Arrays::Opacity, Arrays::GaussianCovariance, Arrays::GaussianOpacity,
  Arrays::GaussianExtinction, Arrays::GaussianNormal };

std::string NamesOfSources(vtkPolyData* input)
{
  std::string names;
  for (const char* name : SourcesOfNodes)
  {
    names += input->GetPointData()->HasArray(name) ? std::string(names.empty() ? "" : " ") + name
                                                   : std::string();
  }
  return names;
}
}

void NoteSources(vtkPolyData* input)
{
  vtkAbstractArray* nodes = input->GetFieldData()->GetAbstractArray(Arrays::Nodes);
  nodes->SetComponentName(0, NamesOfSources(input).c_str());
}

bool HaveOtherSources(vtkPolyData* input)
{
  vtkAbstractArray* nodes = input->GetFieldData()->GetAbstractArray(Arrays::Nodes);
  const char* names = nodes ? nodes->GetComponentName(0) : nullptr;
  return names && NamesOfSources(input) != names;
}

bool IsHierarchy(vtkPolyData* input)
{
  return LeafCounts(input) != nullptr;
}

HierarchyLayout ReadLayout(vtkPolyData* input)
{
  vtkDataArray* counts = LeafCounts(input);
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

vtkUnsignedCharArray* FindNodes(vtkPolyData* input, const HierarchyLayout& layout)
{
  auto* array =
    vtkUnsignedCharArray::SafeDownCast(input->GetFieldData()->GetAbstractArray(Arrays::Nodes));
  const bool matches = array && array->GetNumberOfComponents() == sizeof(HierarchyNode) &&
    static_cast<std::uint64_t>(input->GetNumberOfPoints()) == layout.NumberOfLeaves() &&
    static_cast<std::uint64_t>(array->GetNumberOfTuples()) == layout.NumberOfInnerNodes();
  return matches ? array : nullptr;
}

const HierarchyNode* NodesOf(vtkPolyData* input, const HierarchyLayout& layout)
{
  return reinterpret_cast<const HierarchyNode*>(FindNodes(input, layout)->GetPointer(0));
}

std::string CheckHierarchy(vtkPolyData* input)
{
  if (!IsHierarchy(input))
  {
    return std::string("There is no field array ") + Arrays::Leaves + ": it is no hierarchy.";
  }
  const HierarchyLayout layout = ReadLayout(input);
  if (FindNodes(input, layout))
  {
    return std::string();
  }
  return std::string("Field array ") + Arrays::Leaves + " announces a hierarchy of " +
    std::to_string(layout.NumberOfLeaves()) + " surfels, but the input's " +
    std::to_string(input->GetNumberOfPoints()) + " points and its field array " + Arrays::Nodes +
    " do not match it. Put vtkSurfelHierarchy after filters that change the points.";
}

bool IsWhole(vtkPolyData* input)
{
  return static_cast<std::uint64_t>(input->GetNumberOfPoints()) ==
    ReadLayout(input).NumberOfLeaves();
}

LeafPlacement FindPlacement(vtkPolyData* input, const SurfelCloud& leaves)
{
  SurfelCloud tree = leaves;
  const HierarchyLayout layout = ReadLayout(input);
  tree.Nodes = NodesOf(input, layout);
  return FindLeafPlacement(tree, layout);
}

vtkDataArray* FindComputed(
  vtkPolyData* input, const char* name, std::size_t bytesPerTuple, std::size_t tuples)
{
  vtkDataArray* array = input->GetFieldData()->GetArray(name);
  const bool matches = array && array->HasStandardMemoryLayout() &&
    static_cast<std::size_t>(array->GetNumberOfTuples()) == tuples &&
    static_cast<std::size_t>(array->GetNumberOfComponents()) * array->GetDataTypeSize() ==
      bytesPerTuple;
  return matches && !IsOutdated(input, array) ? array : nullptr;
}

bool IsOutdated(vtkPolyData* input, vtkAbstractArray* computed)
{
  const auto isLater = [computed](vtkAbstractArray* source) {
    return source && source->GetMTime() > computed->GetMTime();
  };
  vtkPointData* data = input->GetPointData();
  return HaveOtherSources(input) || isLater(input->GetPoints()->GetData()) ||
    isLater(input->GetFieldData()->GetAbstractArray(Arrays::Nodes)) ||
    std::any_of(std::begin(SourcesOfNodes), std::end(SourcesOfNodes),
      [&](const char* name) { return isLater(data->GetAbstractArray(name)); });
}
}
