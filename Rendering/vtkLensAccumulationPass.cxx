// SPDX-License-Identifier: BSD-3-Clause
#include "vtkLensAccumulationPass.h"

#include "Rendering/OpenGL/CameraChanges.h"
#include "Rendering/OpenGL/LensAccumulation.h"
#include "Rendering/OpenGL/PassFrame.h"
#include "Rendering/Scene/CameraAdapter.h"
#include "vtkSurfelSplattingPass.h"

#include <vtkCamera.h>
#include <vtkObjectFactory.h>
#include <vtkOpenGLRenderWindow.h>
#include <vtkRenderState.h>
#include <vtkRenderer.h>

#include <algorithm>

struct vtkLensAccumulationPass::Internals
{
  SurfelSplatting::LensAccumulation Accumulation;
};

vtkStandardNewMacro(vtkLensAccumulationPass);

vtkLensAccumulationPass::vtkLensAccumulationPass()
  : Internal(new Internals)
{
  this->DelegatePass = vtkSmartPointer<vtkSurfelSplattingPass>::New();
}

vtkLensAccumulationPass::~vtkLensAccumulationPass() = default;

void vtkLensAccumulationPass::SetDelegatePass(vtkRenderPass* pass)
{
  if (this->DelegatePass != pass)
  {
    this->DelegatePass = pass;
    this->Modified();
  }
}

vtkRenderPass* vtkLensAccumulationPass::GetDelegatePass()
{
  return this->DelegatePass;
}

vtkMTimeType vtkLensAccumulationPass::GetMTime()
{
  const vtkMTimeType time = this->Superclass::GetMTime();
  return this->DelegatePass ? std::max(time, this->DelegatePass->GetMTime()) : time;
}

void vtkLensAccumulationPass::Render(const vtkRenderState* state)
{
  this->NumberOfRenderedProps = 0;
  if (!this->DelegatePass)
  {
    vtkErrorMacro("There is no delegate pass to render the views: call SetDelegatePass().");
    return;
  }
  const SurfelSplatting::PassFrame frame(state);
  if (!frame.CanBeDrawn())
  {
    return;
  }
  SurfelSplatting::UpdateStereo(frame.Renderer);
  vtkCamera* camera = frame.Renderer->GetActiveCamera();
  const int size[2] = { frame.Rectangle.Width, frame.Rectangle.Height };
  SurfelSplatting::LensViews views(SurfelSplatting::MakeView(camera, size, frame.Aspect),
    SurfelSplatting::MakeLens(camera), { this->NumberOfLensPoints, true });
  views.PixelFilter = this->PixelFilter;
  views.LinearLight = this->LinearLight != 0;
  // Hardware selection draws identities of props, which cannot be averaged.
  if (!frame.Renderer->GetSelector() && !views.IsOne())
  {
    if (!this->Internal->Accumulation.Render(frame, views, this->DelegatePass))
    {
      vtkErrorMacro("Float textures of " << size[0] << " x " << size[1]
                                         << " pixels could not be created: nothing is drawn. "
                                            "Try a smaller window.");
      return;
    }
  }
  else
  {
    this->DelegatePass->Render(state);
  }
  this->NumberOfRenderedProps = this->DelegatePass->GetNumberOfRenderedProps();
}

void vtkLensAccumulationPass::ReleaseGraphicsResources(vtkWindow* window)
{
  this->Internal->Accumulation.ReleaseGraphicsResources(window);
  if (this->DelegatePass)
  {
    this->DelegatePass->ReleaseGraphicsResources(window);
  }
}

void vtkLensAccumulationPass::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "NumberOfLensPoints: " << this->NumberOfLensPoints << "\n";
  os << indent << "LinearLight: " << this->LinearLight << "\n";
  os << indent << "PixelFilter: " << this->PixelFilter << " px\n";
  os << indent << "DelegatePass: " << this->DelegatePass.Get() << "\n";
}
