// SPDX-License-Identifier: BSD-3-Clause
#include "DataBlocks.h"

#include "DistributedView.h"
#include "vtkPVPointsToSurfels.h"
#include "vtkSurfelHierarchy.h"

#include <vtkAppendPolyData.h>
#include <vtkBoundingBox.h>
#include <vtkCompositeDataDisplayAttributes.h>
#include <vtkDataArray.h>
#include <vtkDoubleArray.h>
#include <vtkFieldData.h>
#include <vtkIdTypeArray.h>
#include <vtkLogger.h>
#include <vtkMultiBlockDataSet.h>
#include <vtkNew.h>
#include <vtkPartitionedDataSet.h>
#include <vtkPartitionedDataSetCollection.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkUnsignedIntArray.h>

#include <algorithm>
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
  return children;
}

/// The partitions of one data set, or a leaf alone.
std::vector<vtkDataObject*> PiecesOf(vtkDataObject* data)
{
  auto* set = vtkPartitionedDataSet::SafeDownCast(data);
  if (!set)
  {
    return { data };
  }
  std::vector<vtkDataObject*> pieces;
  for (unsigned int i = 0; i < set->GetNumberOfPartitions(); ++i)
  {
    pieces.push_back(set->GetPartitionAsDataObject(i));
  }
  return pieces;
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

/// The appearance that data have themselves, in place of their parent's.
void AddAppearance(vtkDataObject* data, vtkCompositeDataDisplayAttributes* attributes, Block& block)
{
  if (!data || !attributes)
  {
    return;
  }
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

bool IsEmpty(vtkPolyData* points)
{
  return !points || points->GetNumberOfPoints() == 0;
}

/// @param block the appearance that the node has from its parent
void AddBlocks(vtkDataObject* data, vtkCompositeDataDisplayAttributes* attributes, Block block,
  std::vector<Block>& blocks)
{
  AddAppearance(data, attributes, block);
  if (data && data->IsA("vtkCompositeDataSet") && !data->IsA("vtkPartitionedDataSet"))
  {
    for (vtkDataObject* child : ChildrenOf(data))
    {
      AddBlocks(child, attributes, block, blocks);
    }
    return;
  }
  for (vtkDataObject* piece : PiecesOf(data))
  {
    auto* points = vtkPolyData::SafeDownCast(piece);
    if (IsEmpty(points))
    {
      continue;
    }
    if (block.Pieces.empty())
    {
      AddAppearance(points, attributes, block);
      block.CompositeIndex = CompositeIndexOf(points);
    }
    block.Pieces.push_back(points);
  }
  blocks.push_back(block);
}

/// Whether the points are surfels, or Gaussians in space.
bool HasSurfels(vtkPolyData* points)
{
  vtkPointData* data = points->GetPointData();
  return data->GetArray("GaussianCovariance") ||
    (data->GetArray("SurfelCovariance") && data->GetArray("SurfelAreaVector"));
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

/// Makes the coordinates of a piece relative to another origin.
void MoveToOrigin(const double origin[3], vtkPolyData* piece)
{
  double own[3];
  vtkSurfelHierarchy::ReadOrigin(piece, own);
  if (std::equal(own, own + 3, origin))
  {
    return;
  }
  vtkNew<vtkPoints> points;
  points->SetDataType(piece->GetPoints()->GetDataType());
  points->SetNumberOfPoints(piece->GetNumberOfPoints());
  for (vtkIdType i = 0; i < piece->GetNumberOfPoints(); ++i)
  {
    double p[3];
    piece->GetPoint(i, p);
    points->SetPoint(
      i, p[0] + own[0] - origin[0], p[1] + own[1] - origin[1], p[2] + own[2] - origin[2]);
  }
  piece->SetPoints(points);
}

/// The pieces as one cloud, with ids. A surface goes on from one piece to the next.
vtkSmartPointer<vtkPolyData> Join(const std::vector<vtkPolyData*>& pieces)
{
  if (pieces.size() < 2)
  {
    vtkNew<vtkPolyData> nothing;
    return CopyWithIds(pieces.empty() ? nothing.Get() : pieces[0]);
  }
  vtkNew<vtkAppendPolyData> append;
  auto origin = vtkSmartPointer<vtkDoubleArray>::New();
  origin->SetName("SurfelOrigin");
  origin->SetNumberOfComponents(3);
  origin->SetNumberOfTuples(1);
  for (vtkPolyData* piece : pieces)
  {
    vtkSmartPointer<vtkPolyData> copy = CopyWithIds(piece);
    if (piece == pieces[0])
    {
      vtkSurfelHierarchy::ReadOrigin(piece, origin->GetPointer(0));
    }
    MoveToOrigin(origin->GetPointer(0), copy);
    vtkNew<vtkUnsignedIntArray> index;
    index->SetName(CompositeIndexArray);
    index->SetNumberOfTuples(piece->GetNumberOfPoints());
    index->FillValue(CompositeIndexOf(piece));
    copy->GetPointData()->AddArray(index);
    append->AddInputData(copy);
  }
  append->Update();
  append->GetOutput()->GetFieldData()->AddArray(origin);
  return append->GetOutput();
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
  vtkNew<vtkPVPointsToSurfels> filters;
  filters->SetController(controller);
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

void AddBounds(const Block& block, vtkBoundingBox& box)
{
  for (vtkPolyData* piece : block.Pieces)
  {
    double bounds[6], origin[3];
    piece->GetBounds(bounds);
    vtkSurfelHierarchy::ReadOrigin(piece, origin);
    for (int side = 0; side < 6; ++side)
    {
      bounds[side] += origin[side / 2];
    }
    box.AddBounds(bounds);
  }
}

vtkSmartPointer<vtkPolyData> MakeSurfels(
  const std::vector<vtkPolyData*>& pieces, vtkMultiProcessController* controller)
{
  const bool haveSurfels = std::all_of(pieces.begin(), pieces.end(), HasSurfels);
  const bool mustEstimate = MaximumOfAll(haveSurfels ? 0 : 1, controller) != 0;
  if (!mustEstimate && pieces.empty())
  {
    return nullptr;
  }
  if (!mustEstimate && pieces.size() == 1 && HasHierarchy(pieces[0]))
  {
    return pieces[0];
  }
  vtkSmartPointer<vtkPolyData> surfels = Join(pieces);
  if (mustEstimate)
  {
    return Estimate(surfels, controller);
  }
  vtkNew<vtkSurfelHierarchy> hierarchy;
  hierarchy->SetInputData(surfels);
  hierarchy->Update();
  return hierarchy->GetOutput();
}
}
