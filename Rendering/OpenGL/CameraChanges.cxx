// SPDX-License-Identifier: BSD-3-Clause
#include "Rendering/OpenGL/CameraChanges.h"

#include "Rendering/OpenGL/Functions.h"

#include <vtkCamera.h>
#include <vtkFrameBufferObjectBase.h>
#include <vtkMatrix4x4.h>
#include <vtkNew.h>
#include <vtkOpenGLRenderWindow.h>
#include <vtkOpenGLState.h>
#include <vtkPropCollection.h>
#include <vtkRenderPass.h>
#include <vtkRenderState.h>
#include <vtkRenderer.h>

namespace SurfelSplatting
{
void UpdateStereo(vtkRenderer* renderer)
{
  auto* window = vtkOpenGLRenderWindow::SafeDownCast(renderer->GetRenderWindow());
  if (window && (window->GetStereoRender() || renderer->GetActiveCamera()->GetStereo()))
  {
    vtkOpenGLState* state = window->GetState();
    vtkOpenGLState::ScopedglViewport viewport(state);
    vtkOpenGLState::ScopedglScissor scissor(state);
    vtkOpenGLState::ScopedglEnableDisable scissorTest(state, GL_SCISSOR_TEST);
    renderer->GetActiveCamera()->Render(renderer);
  }
}

CameraSwap::CameraSwap(vtkRenderer* renderer, vtkCamera* camera)
  : Renderer(renderer)
  , Own(renderer->GetActiveCamera())
{
  renderer->SetActiveCamera(camera);
}

CameraSwap::~CameraSwap()
{
  this->Renderer->SetActiveCamera(this->Own);
}

vtkSmartPointer<vtkCamera> CopyCamera(vtkCamera* camera, double aspect)
{
  auto copy = vtkSmartPointer<vtkCamera>::New();
  copy->DeepCopy(camera);
  vtkNew<vtkMatrix4x4> projection;
  projection->DeepCopy(camera->GetProjectionTransformMatrix(aspect, -1, 1));
  copy->SetUserTransform(nullptr);
  copy->SetExplicitProjectionTransformMatrix(projection);
  copy->UseExplicitProjectionTransformMatrixOn();
  return copy;
}

namespace
{
/// Replaces row r of a projection by scale times itself plus shift times the row of the divisor.
void ChangeRow(vtkMatrix4x4* projection, int r, double scale, double shift)
{
  for (int c = 0; c < 4; ++c)
  {
    projection->SetElement(
      r, c, scale * projection->GetElement(r, c) + shift * projection->GetElement(3, c));
  }
}
}

void ShiftCamera(vtkCamera* copy, double x, double y, double u, double v)
{
  vtkMatrix4x4* toView = copy->GetViewTransformMatrix();
  double position[3], focalPoint[3];
  copy->GetPosition(position);
  copy->GetFocalPoint(focalPoint);
  for (int i = 0; i < 3; ++i)
  {
    const double d = x * toView->GetElement(0, i) + y * toView->GetElement(1, i);
    position[i] += d;
    focalPoint[i] += d;
  }
  copy->SetPosition(position);
  copy->SetFocalPoint(focalPoint);
  vtkNew<vtkMatrix4x4> projection;
  projection->DeepCopy(copy->GetExplicitProjectionTransformMatrix());
  ChangeRow(projection, 0, 1.0, u);
  ChangeRow(projection, 1, 1.0, v);
  copy->SetExplicitProjectionTransformMatrix(projection);
}

void WidenCamera(vtkCamera* copy, const int size[2], int margin)
{
  vtkNew<vtkMatrix4x4> projection;
  projection->DeepCopy(copy->GetExplicitProjectionTransformMatrix());
  ChangeRow(projection, 0, size[0] / (size[0] + 2.0 * margin), 0.0);
  ChangeRow(projection, 1, size[1] / (size[1] + 2.0 * margin), 0.0);
  copy->SetExplicitProjectionTransformMatrix(projection);
}

std::vector<vtkProp*> VisibleProps(vtkRenderer* renderer)
{
  std::vector<vtkProp*> props;
  vtkCollectionSimpleIterator it;
  renderer->GetViewProps()->InitTraversal(it);
  while (vtkProp* prop = renderer->GetViewProps()->GetNextProp(it))
  {
    if (prop->GetVisibility())
    {
      props.push_back(prop);
    }
  }
  return props;
}

void RenderThrough(const vtkRenderState* state, std::vector<vtkProp*> props, vtkCamera* camera,
  vtkFrameBufferObjectBase* framebuffer, vtkRenderPass* pass)
{
  vtkRenderer* renderer = state->GetRenderer();
  const CameraSwap swap(renderer, camera);
  vtkRenderState inner(renderer);
  inner.SetPropArrayAndCount(props.data(), static_cast<int>(props.size()));
  inner.SetRequiredKeys(state->GetRequiredKeys());
  inner.SetFrameBuffer(framebuffer);
  pass->Render(&inner);
}
}
