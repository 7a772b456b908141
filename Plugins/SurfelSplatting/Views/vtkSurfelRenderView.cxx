// SPDX-License-Identifier: BSD-3-Clause
#include "vtkSurfelRenderView.h"

#include "DistributedView.h"
#include "vtkSurfelSplatter.h"
#include "vtkSurfelSplattingPass.h"
#include "vtkSurfelViewActor.h"

#include <vtkObjectFactory.h>
#include <vtkPVSynchronizedRenderer.h>
#include <vtkRenderer.h>

#include <algorithm>

vtkStandardNewMacro(vtkSurfelRenderView);

vtkSurfelRenderView::vtkSurfelRenderView()
  : Focus(new SurfelViews::Focus)
{
  this->SynchronizedRenderers->SetRenderPass(this->Pass);
  this->GetRenderer()->AddActor(this->EmptyActor);
}

vtkSurfelRenderView::~vtkSurfelRenderView() = default;

void vtkSurfelRenderView::Update()
{
  this->EmptyActor->SetCoversView(false);
  this->Superclass::Update();
  // Every process takes part in a picture, even if it has nothing in view.
  this->RenderEmptyImages = true;
}

void vtkSurfelRenderView::AboutToRenderOnLocalProcess(bool interactive)
{
  this->Superclass::AboutToRenderOnLocalProcess(interactive);
  vtkMultiProcessController* controller =
    SurfelViews::RenderController(this, interactive && this->GetUseLODForInteractiveRender());
  this->Pass->GetSplatter()->SetController(controller);
  this->EmptyActor->SetCoversView(controller != nullptr);
  this->Focus->Apply(
    SurfelViews::SynchronizeLens(this, interactive && this->GetUseLODForInteractiveRender()),
    this->Pass->GetSplatter());
}

void vtkSurfelRenderView::SetLensMode(int mode)
{
  this->Pass->GetSplatter()->SetLensMode(mode);
}

void vtkSurfelRenderView::SetFocusMode(int mode)
{
  this->Focus->Mode = mode;
}

void vtkSurfelRenderView::SetFocusPoint(double x, double y, double z)
{
  const double point[3] = { x, y, z };
  std::copy_n(point, 3, this->Focus->Point);
}

void vtkSurfelRenderView::SetCircleOfConfusion(double radius)
{
  this->Pass->GetSplatter()->SetCircleOfConfusion(radius);
}

void vtkSurfelRenderView::SetLensCells(int cells)
{
  this->Pass->GetSplatter()->SetLensCells(cells);
}

void vtkSurfelRenderView::SetLinearLight(int linear)
{
  this->Pass->GetSplatter()->SetLinearLight(linear);
}

void vtkSurfelRenderView::SetOtherPropsThroughLens(int through)
{
  this->Pass->SetOtherPropsThroughLens(through);
}

void vtkSurfelRenderView::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "FocusMode: " << this->Focus->Mode << "\n";
  os << indent << "Pass:\n";
  this->Pass->PrintSelf(os, indent.GetNextIndent());
}
