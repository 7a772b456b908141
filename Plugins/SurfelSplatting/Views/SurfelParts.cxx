// SPDX-License-Identifier: BSD-3-Clause
#include "SurfelParts.h"

#include "SurfelViewProcesses.h"
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
/// Children of a node; empty: it is a leaf.
std::vector<vtkDataObject*> ChildrenOf(vtkDataObject* data)
{
  std::vector<vtkDataObject*> children;
  if (auto* blocks = vtkMultiBlockDataSet::SafeDownCast(data))
  {
    for (unsigned int i = 0; i < blocks->GetNumberOfBlocks(); ++i)
    {
      children.push_back(blocks->GetBlock(i));
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

/// As ParaView's geometry filter notes it.
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

void AddParts(vtkDataObject* data, vtkCompositeDataDisplayAttributes* attributes, Part inherited,
  std::vector<Part>& parts)
{
  if (data && attributes)
  {
    if (attributes->HasBlockVisibility(data))
    {
      inherited.Visible = attributes->GetBlockVisibility(data);
    }
    if (attributes->HasBlockColor(data))
    {
      inherited.HasColor = true;
      attributes->GetBlockColor(data, inherited.Color);
    }
    if (attributes->HasBlockOpacity(data))
    {
      inherited.HasOpacity = true;
      inherited.Opacity = attributes->GetBlockOpacity(data);
    }
  }
  if (data && data->IsA("vtkCompositeDataSet"))
  {
    for (vtkDataObject* child : ChildrenOf(data))
    {
      AddParts(child, attributes, inherited, parts);
    }
    return;
  }
  inherited.Points = vtkPolyData::SafeDownCast(data);
  inherited.CompositeIndex = CompositeIndexOf(inherited.Points);
  parts.push_back(inherited);
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

/// A hierarchy of these very points: pieces that were put together have lost theirs.
bool HasHierarchy(vtkPolyData* points)
{
  vtkDataArray* leaves = points->GetFieldData()->GetArray("SurfelLeaves");
  return leaves && leaves->GetNumberOfValues() == 2 &&
    leaves->GetComponent(0, 0) +
      (leaves->GetNumberOfComponents() == 2 ? leaves->GetComponent(0, 1)
                                            : leaves->GetComponent(1, 0)) ==
    static_cast<double>(points->GetNumberOfPoints());
}

vtkSmartPointer<vtkPolyData> WithIds(vtkPolyData* points)
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
      "Surfel Splats: %lld points have no surfel arrays; surfels are estimated. The filters "
      "under Point Cloud do the same with settings.",
      static_cast<long long>(points->GetNumberOfPoints()));
  }
  vtkNew<vtkSurfelEstimation> estimation;
  estimation->SetController(controller);
  estimation->SetInputData(points);
  vtkNew<vtkSurfelNormalization> normalization;
  normalization->SetController(controller);
  normalization->SetInputConnection(estimation->GetOutputPort());
  normalization->Update();
  return normalization->GetOutput();
}
}

std::vector<Part> FindParts(vtkDataObject* data, vtkCompositeDataDisplayAttributes* attributes)
{
  std::vector<Part> parts;
  AddParts(data, attributes, Part(), parts);
  return parts;
}

vtkSmartPointer<vtkPolyData> MakeSurfels(vtkPolyData* points, vtkMultiProcessController* controller)
{
  const bool mustEstimate =
    Largest(!IsEmpty(points) && !HasSurfels(points) ? 1 : 0, controller) != 0;
  if (!mustEstimate && (IsEmpty(points) || HasHierarchy(points)))
  {
    return points;
  }
  vtkNew<vtkPolyData> nothing;
  vtkSmartPointer<vtkPolyData> surfels = WithIds(points ? points : nothing.Get());
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
