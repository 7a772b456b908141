// SPDX-License-Identifier: BSD-3-Clause
#include "vtkSurfelRepresentation.h"

#include "SurfelParts.h"
#include "SurfelViewProcesses.h"
#include "vtkSurfelMapper.h"
#include "vtkSurfelSplatter.h"
#include "vtkSurfelSplattingPass.h"
#include "vtkSurfelViewActor.h"

#include <vtkCompositeDataDisplayAttributes.h>
#include <vtkInformation.h>
#include <vtkMultiProcessController.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkPVLODActor.h>
#include <vtkPVRenderView.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>
#include <vtkSequencePass.h>
#include <vtkSmartPointer.h>
#include <vtkVersionMacros.h>
#include <vtkWeakPointer.h>

#include <algorithm>
#include <vector>

// ParaView's mapper of composite data.
#if VTK_MAJOR_VERSION > 9 || (VTK_MAJOR_VERSION == 9 && VTK_MINOR_VERSION >= 3)
#include <vtkCompositePolyDataMapper.h>
using CompositeMapper = vtkCompositePolyDataMapper;
#else
#include <vtkCompositePolyDataMapper2.h>
using CompositeMapper = vtkCompositePolyDataMapper2;
#endif

namespace
{
/// One leaf of the data on the screen.
struct Cloud
{
  vtkNew<vtkSurfelViewActor> Actor;
  vtkNew<vtkSurfelMapper> Mapper;
  vtkNew<vtkProperty> Property; // where the block has a colour or opacity of its own
  vtkSmartPointer<vtkPolyData> Source;
  vtkMTimeType SourceTime = 0;

  Cloud() { this->Actor->SetMapper(this->Mapper); }

  /// By the data's array, but where the block has a colour of its own.
  void Color(const SurfelViews::Part& part, vtkMapper* mapper)
  {
    if (this->SettingsTime != mapper->GetMTime() || this->HasColor != part.HasColor)
    {
      this->SettingsTime = mapper->GetMTime();
      this->HasColor = part.HasColor;
      this->Mapper->vtkMapper::ShallowCopy(mapper);
      this->Mapper->SetScalarVisibility(!part.HasColor && mapper->GetScalarVisibility());
    }
  }

  /// As all of the data are, but for what the block has of its own.
  void Show(const SurfelViews::Part& part, vtkProperty* property)
  {
    if (!part.HasColor && !part.HasOpacity)
    {
      this->Actor->SetProperty(property);
      return;
    }
    // Compared before: copying would make the picture look new in every frame.
    vtkNew<vtkProperty> wanted;
    wanted->DeepCopy(property);
    wanted->SetOpacity(part.HasOpacity ? part.Opacity : property->GetOpacity());
    if (part.HasColor)
    {
      wanted->SetColor(part.Color[0], part.Color[1], part.Color[2]);
    }
    const vtkMTimeType time = property->GetMTime();
    if (time != this->PropertyTime || wanted->GetOpacity() != this->Property->GetOpacity() ||
      !std::equal(wanted->GetDiffuseColor(), wanted->GetDiffuseColor() + 3,
        this->Property->GetDiffuseColor()))
    {
      this->Property->DeepCopy(wanted);
      this->PropertyTime = time;
    }
    this->Actor->SetProperty(this->Property);
  }

private:
  vtkMTimeType PropertyTime = 0, SettingsTime = 0;
  bool HasColor = false;
};
}

struct vtkSurfelRepresentation::Internals
{
  vtkNew<vtkSurfelSplattingPass> Pass;
  SurfelViews::Focus Sharp;
  vtkNew<vtkSurfelViewActor> Leader; // has no surfels, but is there on every process
  vtkNew<vtkSurfelMapper> NoSurfels;
  std::vector<std::unique_ptr<Cloud>> Clouds;
  vtkWeakPointer<vtkPVRenderView> View;
};

vtkStandardNewMacro(vtkSurfelRepresentation);

vtkSurfelRepresentation::vtkSurfelRepresentation()
  : Internal(new Internals)
{
  // All other props have been drawn when surfels are.
  vtkNew<vtkSequencePass> nothing;
  this->Internal->Pass->SetDelegatePass(nothing);
  this->Internal->Pass->OtherPropsThroughLensOff();
  this->Internal->Leader->SetMapper(this->Internal->NoSurfels);
  this->Internal->Leader->SetPass(this->Internal->Pass);
  // Polygons of the geometry's own actors are never drawn.
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
  renderView->GetRenderer()->AddActor(this->Internal->Leader);
  return this->Superclass::AddToView(view);
}

bool vtkSurfelRepresentation::RemoveFromView(vtkView* view)
{
  auto* renderView = vtkPVRenderView::SafeDownCast(view);
  if (!renderView)
  {
    return false;
  }
  this->ShowClouds(0);
  renderView->GetRenderer()->RemoveActor(this->Internal->Leader);
  this->Internal->View = nullptr;
  return this->Superclass::RemoveFromView(view);
}

/// Has so many clouds in the view.
void vtkSurfelRepresentation::ShowClouds(std::size_t count)
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
  this->Internal->Leader->SetVisibility(visible ? 1 : 0);
  for (const auto& cloud : this->Internal->Clouds)
  {
    cloud->Actor->SetVisibility(visible ? 1 : 0);
  }
}

void vtkSurfelRepresentation::HidePolygons()
{
  this->Actor->SetVisibility(0);
  this->BackfaceActor->SetVisibility(0);
}

bool vtkSurfelRepresentation::NeedsOrderedCompositing()
{
  return false; // translucent surfels of all processes are put together by their pass
}

int vtkSurfelRepresentation::ProcessViewRequest(
  vtkInformationRequestKey* request, vtkInformation* inInfo, vtkInformation* outInfo)
{
  const int done = this->Superclass::ProcessViewRequest(request, inInfo, outInfo);
  if (!done)
  {
    return done;
  }
  auto* view = vtkPVRenderView::SafeDownCast(inInfo->Get(vtkPVView::VIEW()));
  if (request == vtkPVView::REQUEST_UPDATE())
  {
    // Every process takes part in a picture, also one that has nothing in sight. Surfels stay where
    // they are: what mixes them needs no order of processes.
    outInfo->Set(vtkPVRenderView::RENDER_EMPTY_IMAGES(), 1);
    vtkPVRenderView::SetOrderedCompositingConfiguration(inInfo, this, 0);
    this->Internal->Leader->SetCoversView(false);
  }
  else if (request == vtkPVView::REQUEST_UPDATE_LOD())
  {
    // There is no smaller piece that could be drawn elsewhere.
    vtkPVRenderView::SetRequiresDistributedRenderingLOD(
      inInfo, this, view && view->GetUseDistributedRenderingForRender());
  }
  else if (request == vtkPVView::REQUEST_RENDER() && view)
  {
    this->HidePolygons();
    // Depth peeling would have the surfels drawn with volumes in each of its layers.
    view->GetRenderer()->SetUseDepthPeelingForVolumes(false);
    vtkMultiProcessController* controller =
      SurfelViews::ProcessesOf(view, inInfo->Has(vtkPVRenderView::USE_LOD()) != 0);
    this->Internal->Pass->GetSplatter()->SetController(controller);
    this->Internal->Leader->SetCoversView(controller != nullptr);
    this->Internal->Sharp.Apply(
      SurfelViews::ShareLens(view, inInfo->Has(vtkPVRenderView::USE_LOD()) != 0),
      this->Internal->Pass->GetSplatter());
    this->UpdateClouds(vtkPVView::GetDeliveredPiece(inInfo, this), controller);
  }
  return done;
}

void vtkSurfelRepresentation::UpdateClouds(
  vtkDataObject* delivered, vtkMultiProcessController* controller)
{
  auto* composite = CompositeMapper::SafeDownCast(this->Mapper);
  std::vector<SurfelViews::Part> parts = SurfelViews::FindParts(
    delivered, composite ? composite->GetCompositeDataDisplayAttributes() : nullptr);
  // The same number on all processes, whatever they have of it.
  parts.resize(SurfelViews::Largest(parts.size(), controller));
  this->ShowClouds(parts.size());
  for (std::size_t i = 0; i < parts.size(); ++i)
  {
    const SurfelViews::Part& part = parts[i];
    Cloud& cloud = *this->Internal->Clouds[i];
    const vtkMTimeType time = part.Points ? part.Points->GetMTime() : 0;
    const bool changed = part.Points != cloud.Source || time != cloud.SourceTime;
    if (SurfelViews::Largest(changed ? 1 : 0, controller) != 0)
    {
      cloud.Source = part.Points;
      cloud.SourceTime = time;
      const vtkSmartPointer<vtkPolyData> surfels =
        SurfelViews::MakeSurfels(part.Points, controller);
      cloud.Mapper->SetInputData(surfels);
      const bool numbered = surfels && surfels->GetPointData()->HasArray(SurfelViews::PointIdArray);
      cloud.Mapper->SetPointIdArrayName(numbered ? SurfelViews::PointIdArray : nullptr);
    }
    cloud.Color(part, this->Mapper);
    cloud.Actor->SetCompositeIndex(part.CompositeIndex);
    cloud.Actor->SetUserMatrix(this->Actor->GetMatrix());
    cloud.Actor->SetVisibility(this->GetVisibility() && part.Visible ? 1 : 0);
    cloud.Actor->SetPickable(this->Actor->GetPickable());
    cloud.Show(part, this->Property);
  }
}

void vtkSurfelRepresentation::SetLensMode(int mode)
{
  this->Internal->Pass->GetSplatter()->SetLensMode(mode);
}

void vtkSurfelRepresentation::SetFocusMode(int mode)
{
  this->Internal->Sharp.Mode = mode;
}

void vtkSurfelRepresentation::SetFocusPoint(double x, double y, double z)
{
  const double point[3] = { x, y, z };
  std::copy_n(point, 3, this->Internal->Sharp.Point);
}

void vtkSurfelRepresentation::SetCircleOfConfusion(double radius)
{
  this->Internal->Pass->GetSplatter()->SetCircleOfConfusion(radius);
}

void vtkSurfelRepresentation::SetLensCells(int cells)
{
  this->Internal->Pass->GetSplatter()->SetLensCells(cells);
}

void vtkSurfelRepresentation::SetLensSectors(int sectors)
{
  this->Internal->Pass->GetSplatter()->SetLensSectors(sectors);
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

void vtkSurfelRepresentation::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "FocusMode: " << this->Internal->Sharp.Mode << "\n";
  os << indent << "Clouds: " << this->Internal->Clouds.size() << "\n";
  os << indent << "Pass:\n";
  this->Internal->Pass->PrintSelf(os, indent.GetNextIndent());
}
