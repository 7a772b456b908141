// SPDX-License-Identifier: BSD-3-Clause
#include "Rendering/OpenGL/PassFrame.h"

#include <vtkCamera.h>
#include <vtkFrameBufferObjectBase.h>
#include <vtkMatrix4x4.h>
#include <vtkOpenGLRenderWindow.h>
#include <vtkRenderState.h>
#include <vtkRenderer.h>

namespace SurfelSplatting
{
DepthRange::DepthRange(vtkCamera* camera, double aspect)
{
  vtkMatrix4x4* projection = camera->GetProjectionTransformMatrix(aspect, -1, 1);
  this->P22 = projection->GetElement(2, 2);
  this->P23 = projection->GetElement(2, 3);
  this->Parallel = camera->GetParallelProjection() != 0;
}

PassFrame::PassFrame(const vtkRenderState* state)
  : State(state)
  , Renderer(state->GetRenderer())
  , Window(vtkOpenGLRenderWindow::SafeDownCast(this->Renderer->GetRenderWindow()))
{
  PixelRectangle& r = this->Rectangle;
  if (vtkFrameBufferObjectBase* framebuffer = state->GetFrameBuffer())
  {
    int size[2];
    framebuffer->GetLastSize(size);
    r.Width = size[0];
    r.Height = size[1];
  }
  else
  {
    this->Renderer->GetTiledSizeAndOrigin(&r.Width, &r.Height, &r.X, &r.Y);
  }
  if (this->CanBeDrawn())
  {
    this->Aspect = this->Renderer->GetTiledAspectRatio();
    this->Range = DepthRange(this->Renderer->GetActiveCamera(), this->Aspect);
  }
}
}
