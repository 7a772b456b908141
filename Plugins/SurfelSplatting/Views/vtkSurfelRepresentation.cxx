// SPDX-License-Identifier: BSD-3-Clause
#include "vtkSurfelRepresentation.h"

#include "DataBlocks.h"
#include "DistributedView.h"
#include "VolumeGaussians.h"
#include "vtkSurfelMapper.h"
#include "vtkSurfelSplatter.h"
#include "vtkSurfelSplattingPass.h"
#include "vtkSurfelViewActor.h"

#include <vtkAlgorithm.h>
#include <vtkBoundingBox.h>
#include <vtkCompositeDataDisplayAttributes.h>
#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkInformationVector.h>
#include <vtkMultiBlockDataSet.h>
#include <vtkMultiProcessController.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkPVLODActor.h>
#include <vtkPVRenderView.h>
#include <vtkPartitionedDataSet.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>
#include <vtkScalarsToColors.h>
#include <vtkSequencePass.h>
#include <vtkSmartPointer.h>
#include <vtkUnsignedCharArray.h>
#include <vtkVersionMacros.h>
#include <vtkWeakPointer.h>

#include <algorithm>
#include <vector>

// ParaView's mapper for composite data.
#if VTK_MAJOR_VERSION > 9 || (VTK_MAJOR_VERSION == 9 && VTK_MINOR_VERSION >= 3)
#include <vtkCompositePolyDataMapper.h>
using CompositeMapper = vtkCompositePolyDataMapper;
#else
#include <vtkCompositePolyDataMapper2.h>
using CompositeMapper = vtkCompositePolyDataMapper2;
#endif

namespace
{
/// Whether a mapper's array, of these points, has colours. Their magnitude tells nothing, so that a
/// colour map is for a single component of them only.
bool AreColors(vtkPolyData* points, vtkMapper* mapper)
{
  int isOfCells = 0;
  vtkDataArray* array = points
    ? vtkAbstractMapper::GetScalars(points, mapper->GetScalarMode(), mapper->GetArrayAccessMode(),
        mapper->GetArrayId(), mapper->GetArrayName(), isOfCells)
    : nullptr;
  vtkScalarsToColors* table = mapper->GetLookupTable();
  return vtkUnsignedCharArray::SafeDownCast(array) && array->GetNumberOfComponents() >= 3 &&
    array->GetNumberOfComponents() <= 4 &&
    !(table && table->GetVectorMode() == vtkScalarsToColors::COMPONENT);
}

/// A block as it is drawn.
struct Cloud
{
  vtkNew<vtkSurfelViewActor> Actor;
  vtkNew<vtkSurfelMapper> Mapper;
  vtkNew<vtkProperty> Property; // used where the block has its own colour or opacity

  Cloud() { this->Actor->SetMapper(this->Mapper); }

  /// Returns whether the points are others than before.
  bool UpdateSource(const SurfelViews::Block& block)
  {
    vtkMTimeType time = 0;
    for (vtkPolyData* piece : block.Pieces)
    {
      time = std::max(time, piece->GetMTime());
    }
    const bool changed = time != this->SourceTime ||
      !std::equal(
        this->Source.begin(), this->Source.end(), block.Pieces.begin(), block.Pieces.end());
    this->Source.assign(block.Pieces.begin(), block.Pieces.end());
    this->SourceTime = time;
    return changed;
  }

  void SetSurfels(vtkPolyData* surfels)
  {
    const auto nameIn = [surfels](const char* array) {
      return surfels && surfels->GetPointData()->HasArray(array) ? array : nullptr;
    };
    this->Mapper->SetInputData(surfels);
    this->Mapper->SetPointIdArrayName(nameIn(SurfelViews::PointIdArray));
    this->Mapper->SetCompositeIdArrayName(nameIn(SurfelViews::CompositeIndexArray));
  }

  /// Colours by the data's array, unless the block has its own colour.
  void UpdateMapper(const SurfelViews::Block& block, vtkMapper* mapper)
  {
    const bool isOfVolume = SurfelViews::IsOfVolume(this->Mapper->GetInput());
    const bool areColors = AreColors(this->Mapper->GetInput(), mapper);
    if (this->SettingsTime != mapper->GetMTime() || this->HasColor != block.HasColor ||
      this->IsOfVolume != isOfVolume || this->ScalarsAreColors != areColors)
    {
      this->SettingsTime = mapper->GetMTime();
      this->HasColor = block.HasColor;
      this->IsOfVolume = isOfVolume;
      this->ScalarsAreColors = areColors;
      this->Mapper->vtkMapper::ShallowCopy(mapper);
      this->Mapper->SetScalarVisibility(!block.HasColor && mapper->GetScalarVisibility());
      if (isOfVolume)
      {
        this->Mapper->SetScalarModeToUsePointData();
      }
      if (isOfVolume || areColors)
      {
        this->Mapper->SetColorModeToDefault();
      }
    }
  }

  /// The representation's property, with the block's own colour and opacity.
  void UpdateProperty(const SurfelViews::Block& block, vtkProperty* property)
  {
    if (!block.HasColor && !block.HasOpacity)
    {
      this->Actor->SetProperty(property);
      return;
    }
    // Copied only if it differs: a copy counts as a change, and the frame would be drawn again.
    vtkNew<vtkProperty> combined;
    combined->DeepCopy(property);
    combined->SetOpacity(block.HasOpacity ? block.Opacity : property->GetOpacity());
    if (block.HasColor)
    {
      combined->SetColor(block.Color[0], block.Color[1], block.Color[2]);
    }
    const vtkMTimeType time = property->GetMTime();
    if (time != this->PropertyTime || combined->GetOpacity() != this->Property->GetOpacity() ||
      !std::equal(combined->GetDiffuseColor(), combined->GetDiffuseColor() + 3,
        this->Property->GetDiffuseColor()))
    {
      this->Property->DeepCopy(combined);
      this->PropertyTime = time;
    }
    this->Actor->SetProperty(this->Property);
  }

private:
  std::vector<vtkSmartPointer<vtkPolyData>> Source;
  vtkMTimeType SourceTime = 0;
  vtkMTimeType PropertyTime = 0, SettingsTime = 0;
  bool HasColor = false, IsOfVolume = false, ScalarsAreColors = false;
};
}

struct vtkSurfelRepresentation::Internals
{
  vtkNew<vtkSurfelSplattingPass> Pass;
  SurfelViews::Focus Focus;
  vtkNew<vtkSurfelViewActor> EmptyActor; // has the pass drawn on processes without surfels, too
  std::vector<std::unique_ptr<Cloud>> Clouds;
  vtkWeakPointer<vtkPVRenderView> View;
  bool IsPartitioned = false;                        // the input is a partitioned data set
  std::unique_ptr<SurfelViews::VolumeColors> Colors; // those of the volume that is shown
  bool ShowBacks = false;
  bool Shade = false;
};

vtkStandardNewMacro(vtkSurfelRepresentation);

vtkSurfelRepresentation::vtkSurfelRepresentation()
  : Internal(new Internals)
{
  // All other props have been drawn before.
  vtkNew<vtkSequencePass> nothing;
  this->Internal->Pass->SetDelegatePass(nothing);
  this->Internal->Pass->OtherPropsThroughLensOff();
  this->Internal->EmptyActor->SetPass(this->Internal->Pass);
  this->HidePolygons();
  this->SetSuppressLOD(true);
}

vtkSurfelRepresentation::~vtkSurfelRepresentation() = default;

bool vtkSurfelRepresentation::AddToView(vtkView* view)
{
  auto* renderView = vtkPVRenderView::SafeDownCast(view);
  if (!renderView)
  {
    return false;
  }
  this->Internal->View = renderView;
  renderView->GetRenderer()->AddActor(this->Internal->EmptyActor);
  return this->Superclass::AddToView(view);
}

bool vtkSurfelRepresentation::RemoveFromView(vtkView* view)
{
  auto* renderView = vtkPVRenderView::SafeDownCast(view);
  if (!renderView)
  {
    return false;
  }
  this->SetNumberOfClouds(0);
  renderView->GetRenderer()->RemoveActor(this->Internal->EmptyActor);
  this->Internal->View = nullptr;
  return this->Superclass::RemoveFromView(view);
}

void vtkSurfelRepresentation::SetNumberOfClouds(std::size_t count)
{
  auto& clouds = this->Internal->Clouds;
  vtkPVRenderView* view = this->Internal->View;
  while (clouds.size() > count)
  {
    if (view)
    {
      view->GetRenderer()->RemoveActor(clouds.back()->Actor);
      view->UnRegisterPropForHardwareSelection(this, clouds.back()->Actor);
    }
    clouds.pop_back();
  }
  while (clouds.size() < count)
  {
    clouds.emplace_back(new Cloud);
    clouds.back()->Actor->SetPass(this->Internal->Pass);
    if (view)
    {
      view->GetRenderer()->AddActor(clouds.back()->Actor);
      view->RegisterPropForHardwareSelection(this, clouds.back()->Actor);
    }
  }
}

void vtkSurfelRepresentation::SetVisibility(bool visible)
{
  this->Superclass::SetVisibility(visible);
  this->HidePolygons();
  this->Internal->EmptyActor->SetVisibility(visible ? 1 : 0);
  for (const auto& cloud : this->Internal->Clouds)
  {
    cloud->Actor->SetVisibility(visible ? 1 : 0);
  }
}

/// The geometry's own actors are never drawn.
void vtkSurfelRepresentation::HidePolygons()
{
  this->Actor->SetVisibility(0);
  this->BackfaceActor->SetVisibility(0);
}

bool vtkSurfelRepresentation::NeedsOrderedCompositing()
{
  return false; // the pass composites the translucent surfels of all processes
}

int vtkSurfelRepresentation::ProcessViewRequest(
  vtkInformationRequestKey* request, vtkInformation* inInfo, vtkInformation* outInfo)
{
  // Other colours and opacities make other Gaussians of a volume.
  if (request == vtkPVView::REQUEST_UPDATE() && this->Internal->Colors &&
    !(*this->Internal->Colors == this->FindVolumeColors()))
  {
    this->MarkModified();
  }
  const int done = this->Superclass::ProcessViewRequest(request, inInfo, outInfo);
  if (!done)
  {
    return done;
  }
  auto* view = vtkPVRenderView::SafeDownCast(inInfo->Get(vtkPVView::VIEW()));
  if (request == vtkPVView::REQUEST_UPDATE())
  {
    // Every process takes part in a picture, even if it has nothing in view. Surfels stay on their
    // processes: compositing them needs no order of processes.
    outInfo->Set(vtkPVRenderView::RENDER_EMPTY_IMAGES(), 1);
    this->UpdateBounds(inInfo);
    vtkPVRenderView::SetOrderedCompositingConfiguration(inInfo, this, 0);
    this->Internal->EmptyActor->SetCoversView(false);
  }
  else if (request == vtkPVView::REQUEST_UPDATE_LOD())
  {
    // There is no decimated copy that the client could draw.
    vtkPVRenderView::SetRequiresDistributedRenderingLOD(
      inInfo, this, view && view->GetUseDistributedRenderingForRender());
  }
  else if (request == vtkPVView::REQUEST_RENDER() && view)
  {
    this->HidePolygons();
    // Depth peeling draws volumes, and with them the surfels, once per layer.
    view->GetRenderer()->SetUseDepthPeelingForVolumes(false);
    vtkMultiProcessController* controller =
      SurfelViews::RenderController(view, inInfo->Has(vtkPVRenderView::USE_LOD()) != 0);
    this->Internal->Pass->GetSplatter()->SetController(controller);
    this->Internal->EmptyActor->SetCoversView(controller != nullptr);
    this->Internal->Focus.Apply(
      SurfelViews::SynchronizeLens(view, inInfo->Has(vtkPVRenderView::USE_LOD()) != 0),
      this->Internal->Pass->GetSplatter());
    this->UpdateClouds(vtkPVView::GetDeliveredPiece(inInfo, this), controller);
  }
  return done;
}

void vtkSurfelRepresentation::UpdateBounds(vtkInformation* info)
{
  vtkBoundingBox box;
  for (const SurfelViews::Block& block :
    this->FindBlocks(this->MultiBlockMaker->GetOutputDataObject(0)))
  {
    if (block.Visible)
    {
      SurfelViews::AddBounds(block, box);
    }
  }
  if (box.IsValid())
  {
    double bounds[6];
    box.GetBounds(bounds);
    vtkPVRenderView::SetGeometryBounds(info, this, bounds, this->Actor->GetMatrix());
  }
}

int vtkSurfelRepresentation::RequestData(
  vtkInformation* request, vtkInformationVector** inputVector, vtkInformationVector* outputVector)
{
  this->Internal->IsPartitioned = inputVector[0]->GetNumberOfInformationObjects() == 1 &&
    vtkPartitionedDataSet::GetData(inputVector[0]) != nullptr;
  const int done = this->Superclass::RequestData(request, inputVector, outputVector);
  this->ShowVolume(inputVector[0]);
  return done;
}

SurfelViews::VolumeColors vtkSurfelRepresentation::FindVolumeColors()
{
  return SurfelViews::VolumeColors(this->GetInputArrayInformation(0), this->Mapper);
}

void vtkSurfelRepresentation::ShowVolume(vtkInformationVector* input)
{
  const SurfelViews::VolumeColors colors = this->FindVolumeColors();
  vtkSmartPointer<vtkPolyData> gaussians;
  this->Internal->Colors.reset();
  if (input->GetNumberOfInformationObjects() == 1 && vtkImageData::GetData(input))
  {
    this->Internal->Colors.reset(new SurfelViews::VolumeColors(colors));
    gaussians = SurfelViews::MakeVolumeGaussians(
      input->GetInformationObject(0), colors, this->Internal->Shade);
  }
  if (gaussians)
  {
    this->MultiBlockMaker->SetInputDataObject(gaussians);
  }
  else
  {
    this->MultiBlockMaker->SetInputConnection(this->GeometryFilter->GetOutputPort());
  }
  this->MultiBlockMaker->Update();
}

std::vector<SurfelViews::Block> vtkSurfelRepresentation::FindBlocks(vtkDataObject* data)
{
  auto* composite = CompositeMapper::SafeDownCast(this->Mapper);
  // ParaView 5.11 makes blocks of the partitions.
  auto* partitions = vtkMultiBlockDataSet::SafeDownCast(data);
  vtkNew<vtkPartitionedDataSet> set;
  if (this->Internal->IsPartitioned && partitions)
  {
    for (unsigned int i = 0; i < partitions->GetNumberOfBlocks(); ++i)
    {
      set->SetPartition(i, partitions->GetBlock(i));
    }
    data = set;
  }
  return SurfelViews::FindBlocks(
    data, composite ? composite->GetCompositeDataDisplayAttributes() : nullptr);
}

void vtkSurfelRepresentation::UpdateClouds(
  vtkDataObject* delivered, vtkMultiProcessController* controller)
{
  std::vector<SurfelViews::Block> blocks = this->FindBlocks(delivered);
  // The same number on all processes, even if some have no data.
  blocks.resize(SurfelViews::MaximumOfAll(blocks.size(), controller));
  this->SetNumberOfClouds(blocks.size());
  for (std::size_t i = 0; i < blocks.size(); ++i)
  {
    const SurfelViews::Block& block = blocks[i];
    Cloud& cloud = *this->Internal->Clouds[i];
    if (SurfelViews::MaximumOfAll(cloud.UpdateSource(block) ? 1 : 0, controller) != 0)
    {
      cloud.SetSurfels(SurfelViews::MakeSurfels(block.Pieces, controller));
    }
    cloud.UpdateMapper(block, this->Mapper);
    cloud.Mapper->SetShowBacks(this->Internal->ShowBacks);
    cloud.Actor->SetCompositeIndex(block.Pieces.size() > 1 ? 0 : block.CompositeIndex);
    cloud.Actor->SetUserMatrix(this->Actor->GetMatrix());
    cloud.Actor->SetVisibility(this->GetVisibility() && block.Visible ? 1 : 0);
    cloud.Actor->SetPickable(this->Actor->GetPickable());
    cloud.UpdateProperty(block, this->Property);
  }
}

void vtkSurfelRepresentation::SetLensMode(int mode)
{
  this->Internal->Pass->GetSplatter()->SetLensMode(mode);
}

void vtkSurfelRepresentation::SetFocusMode(int mode)
{
  this->Internal->Focus.Mode = mode;
}

void vtkSurfelRepresentation::SetFocusPoint(double x, double y, double z)
{
  const double point[3] = { x, y, z };
  std::copy_n(point, 3, this->Internal->Focus.Point);
}

void vtkSurfelRepresentation::SetCircleOfConfusion(double radius)
{
  this->Internal->Pass->GetSplatter()->SetCircleOfConfusion(radius);
}

void vtkSurfelRepresentation::SetLensCells(int cells)
{
  this->Internal->Pass->GetSplatter()->SetLensCells(cells);
}

void vtkSurfelRepresentation::SetKernel(int kernel)
{
  this->Internal->Pass->GetSplatter()->SetKernel(kernel);
}

void vtkSurfelRepresentation::SetLODMode(int mode)
{
  this->Internal->Pass->GetSplatter()->SetLODMode(mode);
}

void vtkSurfelRepresentation::SetLODError(double error)
{
  this->Internal->Pass->GetSplatter()->SetLODError(error);
}

void vtkSurfelRepresentation::SetColorByLevel(int byLevel)
{
  this->Internal->Pass->GetSplatter()->SetColorByLevel(byLevel);
}

void vtkSurfelRepresentation::SetShowBacks(bool show)
{
  this->Internal->ShowBacks = show;
  for (const auto& cloud : this->Internal->Clouds)
  {
    cloud->Mapper->SetShowBacks(show);
  }
}

void vtkSurfelRepresentation::SetShade(bool shade)
{
  if (this->Internal->Shade != shade)
  {
    this->Internal->Shade = shade;
    if (this->Internal->Colors) // else no volume is shown, and surfels would be estimated anew
    {
      this->MarkModified();
    }
  }
}

void vtkSurfelRepresentation::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "FocusMode: " << this->Internal->Focus.Mode << "\n";
  os << indent << "ShowBacks: " << this->Internal->ShowBacks << "\n";
  os << indent << "Shade: " << this->Internal->Shade << "\n";
  os << indent << "Clouds: " << this->Internal->Clouds.size() << "\n";
  os << indent << "Pass:\n";
  this->Internal->Pass->PrintSelf(os, indent.GetNextIndent());
}
