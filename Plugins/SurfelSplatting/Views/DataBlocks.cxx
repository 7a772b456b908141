// SPDX-License-Identifier: BSD-3-Clause
#include "DataBlocks.h"

#include "DistributedView.h"
#include "vtkPointsToSurfels.h"
#include "vtkSurfelEstimation.h"
#include "vtkSurfelHierarchy.h"
#include "vtkSurfelNormalization.h"

#include <vtkCompositeDataDisplayAttributes.h>
#include <vtkDataArray.h>
#include <vtkFieldData.h>
#include <vtkIdTypeArray.h>
#include <vtkLogger.h>
#include <vtkMultiBlockDataSet.h>
#include <vtkNew.h>
#include <vtkPartitionedDataSet.h>
#include <vtkPartitionedDataSetCollection.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>

#include <numeric>

namespace SurfelViews
{
namespace
{
/// Empty for leaves.
std::vector<vtkDataObject*> ChildrenOf(vtkDataObject* data)
{
  std::vector<vtkDataObject*> children;
  if (auto* multiBlock = vtkMultiBlockDataSet::SafeDownCast(data))
  {
    for (unsigned int i = 0; i < multiBlock->GetNumberOfBlocks(); ++i)
    {
      children.push_back(multiBlock->GetBlock(i));
    }
  }
  else if (auto* sets = vtkPartitionedDataSetCollection::SafeDownCast(data))
  {
    for (unsigned int i = 0; i < sets->GetNumberOfPartitionedDataSets(); ++i)
    {
      children.push_back(sets->GetPartitionedDataSet(i));
    }
  }
  else if (auto* set = vtkPartitionedDataSet::SafeDownCast(data))
  {
    for (unsigned int i = 0; i < set->GetNumberOfPartitions(); ++i)
    {
      children.push_back(set->GetPartition(i));
    }
  }
  return children;
}

/// The flat index that ParaView's geometry filter has stored.
unsigned int CompositeIndexOf(vtkPolyData* points)
{
  for (int association : { vtkDataObject::FIELD, vtkDataObject::POINT, vtkDataObject::CELL })
  {
    vtkFieldData* data = points ? points->GetAttributesAsFieldData(association) : nullptr;
    vtkDataArray* index = data ? data->GetArray("vtkCompositeIndex") : nullptr;
    if (index && index->GetNumberOfTuples() > 0)
    {
      return static_cast<unsigned int>(index->GetComponent(0, 0));
    }
  }
  return 0;
}

/// @param block the appearance that the node has from its parent
void AddBlocks(vtkDataObject* data, vtkCompositeDataDisplayAttributes* attributes, Block block,
  std::vector<Block>& blocks)
{
  if (data && attributes)
  {
    if (attributes->HasBlockVisibility(data))
    {
      block.Visible = attributes->GetBlockVisibility(data);
    }
    if (attributes->HasBlockColor(data))
    {
      block.HasColor = true;
      attributes->GetBlockColor(data, block.Color);
    }
    if (attributes->HasBlockOpacity(data))
    {
      block.HasOpacity = true;
      block.Opacity = attributes->GetBlockOpacity(data);
    }
  }
  if (data && data->IsA("vtkCompositeDataSet"))
  {
    for (vtkDataObject* child : ChildrenOf(data))
    {
      AddBlocks(child, attributes, block, blocks);
    }
    return;
  }
  block.Points = vtkPolyData::SafeDownCast(data);
  block.CompositeIndex = CompositeIndexOf(block.Points);
  blocks.push_back(block);
}

bool IsEmpty(vtkPolyData* points)
{
  return !points || points->GetNumberOfPoints() == 0;
}

bool HasSurfels(vtkPolyData* points)
{
  return points->GetPointData()->GetArray("SurfelCovariance") &&
    points->GetPointData()->GetArray("SurfelAreaVector");
}

/// Whether the hierarchy belongs to exactly these points: appended pieces keep the hierarchy of one
/// piece.
bool HasHierarchy(vtkPolyData* points)
{
  vtkDataArray* leaves = points->GetFieldData()->GetArray("SurfelLeaves");
  return leaves && leaves->GetNumberOfValues() == 2 &&
    leaves->GetComponent(0, 0) +
      (leaves->GetNumberOfComponents() == 2 ? leaves->GetComponent(0, 1)
                                            : leaves->GetComponent(1, 0)) ==
    static_cast<double>(points->GetNumberOfPoints());
}

vtkSmartPointer<vtkPolyData> CopyWithIds(vtkPolyData* points)
{
  auto copy = vtkSmartPointer<vtkPolyData>::New();
  copy->ShallowCopy(points);
  copy->GetFieldData()->RemoveArray("SurfelLeaves");
  copy->GetFieldData()->RemoveArray("SurfelNodes");
  vtkNew<vtkIdTypeArray> ids;
  ids->SetName(PointIdArray);
  ids->SetNumberOfTuples(points->GetNumberOfPoints());
  std::iota(ids->GetPointer(0), ids->GetPointer(0) + points->GetNumberOfPoints(), vtkIdType{ 0 });
  copy->GetPointData()->AddArray(ids);
  return copy;
}

vtkSmartPointer<vtkPolyData> Estimate(vtkPolyData* points, vtkMultiProcessController* controller)
{
  if (!IsEmpty(points))
  {
    vtkLogF(INFO,
      "Surfel Splats: %lld points have no surfel arrays; surfels are estimated from them. The "
      "filters under Point Cloud have settings for this.",
      static_cast<long long>(points->GetNumberOfPoints()));
  }
  vtkNew<vtkPointsToSurfels> filters;
  filters->GetEstimation()->SetController(controller);
  filters->GetNormalization()->SetController(controller);
  filters->BuildHierarchyOff(); // MakeSurfels builds it
  filters->SetInputData(points);
  filters->Update();
  return filters->GetOutput();
}
}

std::vector<Block> FindBlocks(vtkDataObject* data, vtkCompositeDataDisplayAttributes* attributes)
{
  std::vector<Block> blocks;
  AddBlocks(data, attributes, Block(), blocks);
  return blocks;
}

vtkSmartPointer<vtkPolyData> MakeSurfels(vtkPolyData* points, vtkMultiProcessController* controller)
{
  const bool mustEstimate =
    MaximumOfAll(!IsEmpty(points) && !HasSurfels(points) ? 1 : 0, controller) != 0;
  if (!mustEstimate && (IsEmpty(points) || HasHierarchy(points)))
  {
    return points;
  }
  vtkNew<vtkPolyData> nothing;
  vtkSmartPointer<vtkPolyData> surfels = CopyWithIds(points ? points : nothing.Get());
  if (mustEstimate)
  {
    surfels = Estimate(surfels, controller);
  }
  vtkNew<vtkSurfelHierarchy> hierarchy;
  hierarchy->SetInputData(surfels);
  hierarchy->Update();
  return hierarchy->GetOutput();
}
}
