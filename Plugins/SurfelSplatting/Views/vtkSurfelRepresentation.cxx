// SPDX-License-Identifier: BSD-3-Clause
#include "vtkSurfelRepresentation.h"

#include "vtkSurfelEstimation.h"
#include "vtkSurfelHierarchy.h"
#include "vtkSurfelMapper.h"
#include "vtkSurfelNormalization.h"
#include "vtkSurfelSplatter.h"
#include "vtkSurfelViewActor.h"

#include <vtkAlgorithm.h>
#include <vtkAlgorithmOutput.h>
#include <vtkCompositeDataIterator.h>
#include <vtkCompositeDataSet.h>
#include <vtkDataObject.h>
#include <vtkLogger.h>
#include <vtkObjectFactory.h>
#include <vtkPVLODActor.h>
#include <vtkPVRenderView.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkRenderer.h>

namespace
{
/// The first leaf that has points.
vtkPolyData* FindPoints(vtkDataObject* data)
{
  auto* composite = vtkCompositeDataSet::SafeDownCast(data);
  if (!composite)
  {
    return vtkPolyData::SafeDownCast(data);
  }
  vtkSmartPointer<vtkCompositeDataIterator> it;
  it.TakeReference(composite->NewIterator());
  for (it->InitTraversal(); !it->IsDoneWithTraversal(); it->GoToNextItem())
  {
    auto* leaf = vtkPolyData::SafeDownCast(it->GetCurrentDataObject());
    if (leaf && leaf->GetNumberOfPoints() > 0)
    {
      return leaf;
    }
  }
  return nullptr;
}
}

vtkStandardNewMacro(vtkSurfelRepresentation);

vtkSurfelRepresentation::vtkSurfelRepresentation()
{
  this->SurfelActor->SetMapper(this->SurfelMapper);
  this->SurfelActor->SetProperty(this->Property);
  // Polygons of the geometry's own actor are never drawn.
  this->Actor->SetVisibility(0);
}

vtkSurfelRepresentation::~vtkSurfelRepresentation() = default;

bool vtkSurfelRepresentation::AddToView(vtkView* view)
{
  auto* renderView = vtkPVRenderView::SafeDownCast(view);
  if (!renderView)
  {
    return false;
  }
  renderView->GetRenderer()->AddActor(this->SurfelActor);
  renderView->RegisterPropForHardwareSelection(this, this->SurfelActor);
  return this->Superclass::AddToView(view);
}

bool vtkSurfelRepresentation::RemoveFromView(vtkView* view)
{
  auto* renderView = vtkPVRenderView::SafeDownCast(view);
  if (!renderView)
  {
    return false;
  }
  renderView->GetRenderer()->RemoveActor(this->SurfelActor);
  renderView->UnRegisterPropForHardwareSelection(this, this->SurfelActor);
  return this->Superclass::RemoveFromView(view);
}

void vtkSurfelRepresentation::SetVisibility(bool visible)
{
  this->Superclass::SetVisibility(visible);
  this->Actor->SetVisibility(0);
  this->SurfelActor->SetVisibility(visible ? 1 : 0);
}

int vtkSurfelRepresentation::ProcessViewRequest(
  vtkInformationRequestKey* request, vtkInformation* inInfo, vtkInformation* outInfo)
{
  const int done = this->Superclass::ProcessViewRequest(request, inInfo, outInfo);
  if (done && request == vtkPVView::REQUEST_RENDER())
  {
    vtkAlgorithmOutput* port = vtkPVRenderView::GetPieceProducer(inInfo, this);
    if (port)
    {
      this->UpdateSurfels(port->GetProducer()->GetOutputDataObject(port->GetIndex()));
    }
  }
  return done;
}

void vtkSurfelRepresentation::UpdateSurfels(vtkDataObject* delivered)
{
  this->SurfelMapper->vtkMapper::ShallowCopy(this->Mapper);
  this->SurfelActor->SetUserMatrix(this->Actor->GetMatrix());
  vtkPolyData* points = FindPoints(delivered);
  const vtkMTimeType time = points ? points->GetMTime() : 0;
  if (points == this->Source && time == this->SourceTime)
  {
    return;
  }
  this->Source = points;
  this->SourceTime = time;
  const bool isSurfels = !points || points->GetPointData()->GetArray("SurfelCovariance") != nullptr;
  this->SurfelMapper->SetInputData(isSurfels ? points : this->EstimateSurfels(points).GetPointer());
}

vtkSmartPointer<vtkPolyData> vtkSurfelRepresentation::EstimateSurfels(vtkPolyData* points)
{
  vtkLogF(INFO,
    "Surfel Splats: %lld points have no surfel arrays; surfels are estimated. The filters "
    "under Point Cloud do the same with settings.",
    static_cast<long long>(points->GetNumberOfPoints()));
  vtkNew<vtkSurfelEstimation> estimation;
  estimation->SetInputData(points);
  vtkNew<vtkSurfelNormalization> normalization;
  normalization->SetInputConnection(estimation->GetOutputPort());
  vtkNew<vtkSurfelHierarchy> hierarchy;
  hierarchy->SetInputConnection(normalization->GetOutputPort());
  hierarchy->Update();
  return hierarchy->GetOutput();
}

void vtkSurfelRepresentation::SetLensMode(int mode)
{
  this->SurfelActor->GetSplatter()->SetLensMode(mode);
}

void vtkSurfelRepresentation::SetCircleOfConfusion(double radius)
{
  this->SurfelActor->GetSplatter()->SetCircleOfConfusion(radius);
}

void vtkSurfelRepresentation::SetLensCells(int cells)
{
  this->SurfelActor->GetSplatter()->SetLensCells(cells);
}

void vtkSurfelRepresentation::SetLensSectors(int sectors)
{
  this->SurfelActor->GetSplatter()->SetLensSectors(sectors);
}

void vtkSurfelRepresentation::SetKernel(int kernel)
{
  this->SurfelActor->GetSplatter()->SetKernel(kernel);
}

void vtkSurfelRepresentation::SetLODMode(int mode)
{
  this->SurfelActor->GetSplatter()->SetLODMode(mode);
}

void vtkSurfelRepresentation::SetLODError(double error)
{
  this->SurfelActor->GetSplatter()->SetLODError(error);
}

void vtkSurfelRepresentation::SetColorByLevel(int byLevel)
{
  this->SurfelActor->GetSplatter()->SetColorByLevel(byLevel);
}

void vtkSurfelRepresentation::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "SurfelActor:\n";
  this->SurfelActor->PrintSelf(os, indent.GetNextIndent());
}
