// SPDX-License-Identifier: BSD-3-Clause
#include "Rendering/Scene/HierarchyCache.h"

#include "Core/Hierarchy/HierarchyBuilder.h"
#include "Core/Hierarchy/NodeCheck.h"
#include "Core/Hierarchy/NodeColors.h"
#include "Core/Hierarchy/NodeHarmonics.h"
#include "Core/Hierarchy/SheetOverlap.h"
#include "Core/Surfels/SurfelArrays.h"
#include "Rendering/Scene/MappedArrays.h"
#include "SurfelData/HierarchyArrays.h"

#include <vtkDataArray.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkSmartPointer.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>

namespace SurfelSplatting
{
namespace
{
/// Surfels that a thread moves at a time.
constexpr std::size_t SettleGrain = 16384;

template <typename Value>
const Value* ValuesOf(vtkDataArray* array)
{
  return static_cast<const Value*>(array->GetVoidPointer(0));
}
}

/// What an input that has changed needs before it is drawn.
void HierarchyCache::Examine(vtkPolyData* input, const Executor& executor, SurfelCloud& cloud)
{
  const HierarchyLayout layout = ReadLayout(input);
  const std::size_t entries = ClusterBounds::NumberOfEntries(layout);
  vtkDataArray* clusters =
    FindComputed(input, Arrays::Clusters, sizeof(ClusterBounds::Node), entries);
  vtkDataArray* extents =
    FindComputed(input, Arrays::Extents, ClusterBounds::LevelsBelow * sizeof(NodeExtent), entries);
  const bool areStored = clusters && extents;
  this->Placement = areStored ? LeafPlacement() : FindLeafPlacement(cloud, layout);
  this->Settle(cloud, executor);
  this->ColorState = State();
  this->LeafCovariances.clear();
  this->HasUncovered = false;
  this->Nodes.Clear();
  if (this->Placement.Kind == LeafPlacement::Other)
  {
    this->Warning =
      "The points of the hierarchy were moved, and not all in the same way, but their kernels were "
      "not: the surfels are drawn as they were oriented, without level of detail. Put "
      "vtkPointsToSurfels after filters that move points.";
    return;
  }
  this->UseSettled(cloud);
  if (!this->RemakeNodes(input, layout, executor, cloud))
  {
    return;
  }
  this->Bounds = areStored
    ? ClusterBounds(layout, ValuesOf<ClusterBounds::Node>(clusters), ValuesOf<NodeExtent>(extents))
    : ClusterBounds(cloud, layout, executor);
  this->File = areStored ? FindArrayFile(FindNodes(input, layout)) : nullptr;
  this->StoredTime = areStored ? clusters->GetMTime() : 0;
  this->PreparedSurfels += areStored ? 0 : layout.NumberOfLeaves();
}

/// Moves surfels back to where the nodes know them.
void HierarchyCache::Settle(const SurfelCloud& moved, const Executor& executor)
{
  const bool isMoved = this->Placement.Kind == LeafPlacement::Translation ||
    this->Placement.Kind == LeafPlacement::AffineMap;
  const std::size_t values = isMoved ? 3 * moved.NumberOfSurfels : 0;
  const bool turnAreas = isMoved && this->Placement.MovedVectors;
  this->SettledPoints.resize(values);
  this->SettledAreas.resize(turnAreas ? values : 0);
  if (!isMoved)
  {
    return;
  }
  const Affine3& back = this->Placement.Back;
  executor.For(moved.NumberOfSurfels, SettleGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
    {
      const Vector3 p = back.Apply(moved.Position(i));
      std::copy(p.begin(), p.end(), this->SettledPoints.begin() + 3 * i);
      if (turnAreas)
      {
        const Vector3 a = back.ApplyLinear(moved.AreaVector(i));
        std::copy(a.begin(), a.end(), this->SettledAreas.begin() + 3 * i);
      }
    }
  });
}

void HierarchyCache::UseSettled(SurfelCloud& cloud) const
{
  if (this->SettledPoints.empty())
  {
    return;
  }
  cloud.LocalToWorld = this->Placement.Map;
  cloud.PositionsFloat = this->SettledPoints.data();
  cloud.PositionsDouble = nullptr;
  if (!this->SettledAreas.empty())
  {
    cloud.AreaVectors = this->SettledAreas.data();
  }
}

/// Makes new nodes if those of the input are no longer those of its kernels. False, and the surfels
/// are drawn without nodes, if they are no longer in the trees of their sides.
bool HierarchyCache::RemakeNodes(
  vtkPolyData* input, const HierarchyLayout& layout, const Executor& executor, SurfelCloud& cloud)
{
  if (!IsOutdated(input, FindNodes(input, layout)))
  {
    return true;
  }
  if (!AreSidesOfTrees(cloud, layout))
  {
    this->Placement.Kind = LeafPlacement::Other;
    this->Warning = std::string("The point array ") + Arrays::TwoSided +
      " of the hierarchy was changed: the surfels are drawn without level of detail. Put "
      "vtkSurfelHierarchy after what changes it.";
    return false;
  }
  if (!AreNodesOfKernels(cloud, layout, executor))
  {
    this->Nodes.Resize(layout.NumberOfInnerNodes());
    FillNodes(cloud, layout, executor, this->Nodes.Data());
    cloud.Nodes = this->Nodes.Data();
  }
  return true;
}

void HierarchyCache::NoteSelection(vtkPolyData* input)
{
  const State inputState{ input, input->GetMTime() };
  if (this->InputState == inputState)
  {
    return;
  }
  this->InputState = inputState;
  this->Warning = "The input was a hierarchy of " +
    std::to_string(ReadLayout(input).NumberOfLeaves()) + " surfels and has " +
    std::to_string(input->GetNumberOfPoints()) +
    " points: they are drawn without level of detail. Put vtkSurfelHierarchy after filters that "
    "select points.";
}

std::string HierarchyCache::TakeWarning()
{
  std::string taken;
  taken.swap(this->Warning);
  return taken;
}

std::string HierarchyCache::Update(vtkPolyData* input, vtkDataArray* colors, bool paperCut,
  const Executor& executor, SurfelCloud& cloud)
{
  if (!IsWhole(input))
  {
    this->NoteSelection(input);
    return std::string();
  }
  const std::string problem = CheckHierarchy(input);
  if (!problem.empty())
  {
    return problem;
  }
  const HierarchyLayout layout = ReadLayout(input);
  cloud.Nodes = NodesOf(input, layout);
  const State inputState{ input, input->GetMTime() };
  if (!(this->InputState == inputState))
  {
    this->Examine(input, executor, cloud);
    this->InputState = inputState;
  }
  if (this->Placement.Kind == LeafPlacement::Other)
  {
    cloud.Nodes = nullptr;
    return std::string();
  }
  cloud.Nodes = this->Nodes.Size() > 0 ? this->Nodes.Data() : cloud.Nodes;
  this->UseSettled(cloud);
  if (colors && colors->GetMTime() > this->StoredTime && FindArrayFile(colors))
  {
    this->File = nullptr; // colours that were changed in memory differ from their checksums
  }
  if (paperCut && this->LeafCovariances.empty())
  {
    this->CheckFile(executor);
    this->LeafCovariances = MakeLeafCovariances(cloud, layout, executor);
  }
  cloud.Clusters = &this->Bounds;
  cloud.NodeColors = colors ? this->UpdateColors(input, colors, layout, executor, cloud) : nullptr;
  cloud.LeafCovariances = paperCut ? this->LeafCovariances.data() : nullptr;
  cloud.Guard = this->File.get();
  return std::string();
}

/// Before all of the file is read.
void HierarchyCache::CheckFile(const Executor& executor) const
{
  if (this->File)
  {
    this->File->CheckAll(executor);
  }
}

/// The colours of the nodes; those of the file if they are the means of these colours.
const NodeColor* HierarchyCache::UpdateColors(vtkPolyData* input, vtkDataArray* colors,
  const HierarchyLayout& layout, const Executor& executor, const SurfelCloud& cloud)
{
  vtkDataArray* stored =
    FindComputed(input, Arrays::NodeColors, sizeof(NodeColor), layout.NumberOfInnerNodes());
  const char* source = stored ? stored->GetComponentName(0) : nullptr;
  if (source && colors == input->GetPointData()->GetAbstractArray(source) &&
    colors->GetMTime() <= stored->GetMTime())
  {
    this->Colors.Clear();
    this->ColorState = State();
    return ValuesOf<NodeColor>(stored);
  }
  const State colorState{ colors, colors->GetMTime() };
  if (!(this->ColorState == colorState))
  {
    this->CheckFile(executor);
    this->Colors.Clear();
    this->Colors.Resize(layout.NumberOfInnerNodes());
    if (!this->HasUncovered)
    {
      this->Uncovered = FindUncovered(cloud, layout, executor);
      this->HasUncovered = true;
    }
    FillNodeColors(cloud, layout, this->Uncovered, executor, this->Colors.Data());
    this->ColorState = colorState;
    this->PreparedSurfels += layout.NumberOfLeaves();
  }
  return this->Colors.Data();
}

void HierarchyCache::UpdateHarmonics(
  vtkPolyData* input, vtkDataArray* coefficients, const Executor& executor, SurfelCloud& cloud)
{
  cloud.NumberOfHarmonics = coefficients->GetNumberOfComponents() / 3;
  const State state{ input, input->GetMTime() };
  if (!(this->HarmonicsState == state))
  {
    const vtkSmartPointer<vtkDataArray> floats = AsType(coefficients, VTK_FLOAT);
    const HierarchyLayout layout = cloud.Nodes ? ReadLayout(input) : HierarchyLayout();
    this->Harmonics =
      PackHarmonics(cloud, layout, ValuesOf<float>(floats), cloud.NumberOfHarmonics, executor);
    this->HarmonicColors.Resize(cloud.Nodes ? layout.NumberOfInnerNodes() : 0);
    if (cloud.Nodes)
    {
      FillHarmonicColors(
        cloud, layout, this->Harmonics.data(), executor, this->HarmonicColors.Data());
    }
    this->HarmonicsState = state;
  }
  cloud.Harmonics = this->Harmonics.data();
  cloud.NodeColors = cloud.Nodes ? this->HarmonicColors.Data() : nullptr;
}
}
