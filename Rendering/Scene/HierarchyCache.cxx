// SPDX-License-Identifier: BSD-3-Clause
#include "Rendering/Scene/HierarchyCache.h"

#include "Core/Hierarchy/HierarchyBuilder.h"
#include "Core/Surfels/SurfelArrays.h"

#include <vtkDataArray.h>
#include <vtkFieldData.h>
#include <vtkPolyData.h>
#include <vtkUnsignedCharArray.h>
#include <vtkVariant.h>

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

/// The array of the nodes above the leaves; null if the input does not match its layout.
vtkUnsignedCharArray* FindNodes(vtkPolyData* input, const HierarchyLayout& layout)
{
  auto* array =
    vtkUnsignedCharArray::SafeDownCast(input->GetFieldData()->GetAbstractArray(Arrays::Nodes));
  const bool matches = array && array->GetNumberOfComponents() == sizeof(HierarchyNode) &&
    static_cast<std::uint64_t>(input->GetNumberOfPoints()) == layout.NumberOfLeaves() &&
    static_cast<std::uint64_t>(array->GetNumberOfTuples()) ==
      layout.NumberOfNodes() - layout.NumberOfLeaves();
  return matches ? array : nullptr;
}
}

bool HierarchyCache::IsHierarchy(vtkPolyData* input)
{
  return LeafCounts(input) != nullptr;
}

std::string HierarchyCache::Update(vtkPolyData* input, vtkDataArray* colors, bool paperCut,
  const Executor& executor, SurfelCloud& cloud)
{
  const HierarchyLayout layout = ReadLayout(LeafCounts(input));
  vtkUnsignedCharArray* nodes = FindNodes(input, layout);
  if (!nodes)
  {
    return std::string("Field array ") + Arrays::Leaves + " announces a hierarchy of " +
      std::to_string(layout.NumberOfLeaves()) + " surfels, but the input's " +
      std::to_string(input->GetNumberOfPoints()) + " points and its field array " + Arrays::Nodes +
      " do not match it. Put vtkSurfelHierarchy after filters that change the points.";
  }
  cloud.Nodes = reinterpret_cast<const HierarchyNode*>(nodes->GetPointer(0));
  const State inputState{ input, input->GetMTime() };
  if (!(this->InputState == inputState))
  {
    this->Bounds = ClusterBounds(cloud, layout, executor);
    this->InputState = inputState;
    this->ColorState = State();
    this->HasColors = false;
    this->LeafCovariances.clear();
    this->PreparedSurfels += layout.NumberOfLeaves();
  }
  const State colorState{ colors, colors ? colors->GetMTime() : 0 };
  if (colors && !(this->HasColors && this->ColorState == colorState))
  {
    this->Colors = MakeNodeColors(cloud, layout, executor);
    this->ColorState = colorState;
    this->PreparedSurfels += layout.NumberOfLeaves();
  }
  if (paperCut && this->LeafCovariances.empty())
  {
    this->LeafCovariances = MakeLeafCovariances(cloud, layout, executor);
  }
  this->HasColors = colors != nullptr;
  cloud.Clusters = &this->Bounds;
  cloud.NodeColors = colors ? this->Colors.data() : nullptr;
  cloud.LeafCovariances = paperCut ? this->LeafCovariances.data() : nullptr;
  return std::string();
}
}
