// SPDX-License-Identifier: BSD-3-Clause
#include "vtkSurfelRenderView.h"

#include "vtkSurfelSplatter.h"
#include "vtkSurfelSplattingPass.h"

#include <vtkObjectFactory.h>
#include <vtkPVSynchronizedRenderer.h>

vtkStandardNewMacro(vtkSurfelRenderView);

vtkSurfelRenderView::vtkSurfelRenderView()
{
  this->SynchronizedRenderers->SetRenderPass(this->Pass);
}

vtkSurfelRenderView::~vtkSurfelRenderView() = default;

void vtkSurfelRenderView::SetLensMode(int mode)
{
  this->Pass->GetSplatter()->SetLensMode(mode);
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
  os << indent << "Pass:\n";
  this->Pass->PrintSelf(os, indent.GetNextIndent());
}
