// SPDX-License-Identifier: BSD-3-Clause
#include "vtkLensAccumulationPass.h"

#include "LensAccumulationFS.h"
#include "LensCells.h"
#include "SurfelFrameBlit.h"
#include "SurfelSceneAdapter.h"
#include "vtkSurfelSplattingPass.h"

#include <vtk_glew.h>

#include <vtkCamera.h>
#include <vtkFrameBufferObjectBase.h>
#include <vtkMath.h>
#include <vtkMatrix4x4.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkOpenGLFramebufferObject.h>
#include <vtkOpenGLQuadHelper.h>
#include <vtkOpenGLRenderWindow.h>
#include <vtkOpenGLShaderCache.h>
#include <vtkOpenGLState.h>
#include <vtkRenderState.h>
#include <vtkRenderer.h>
#include <vtkShaderProgram.h>
#include <vtkTextureObject.h>
#include <vtkWeakPointer.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace
{
using SurfelSplatting::LensPoint;

/// Moves a camera by (x, y) world units within the plane of its lens and shifts its picture by
/// (u, v) in normalised device coordinates.
void ShiftCamera(vtkCamera* camera, double x, double y, double u, double v)
{
  vtkMatrix4x4* toView = camera->GetViewTransformMatrix();
  double position[3], focalPoint[3];
  camera->GetPosition(position);
  camera->GetFocalPoint(focalPoint);
  for (int i = 0; i < 3; ++i)
  {
    const double d = x * toView->GetElement(0, i) + y * toView->GetElement(1, i);
    position[i] += d;
    focalPoint[i] += d;
  }
  camera->SetPosition(position);
  camera->SetFocalPoint(focalPoint);
  if (camera->GetUseExplicitProjectionTransformMatrix())
  {
    vtkMatrix4x4* explicitMatrix = camera->GetExplicitProjectionTransformMatrix();
    vtkNew<vtkMatrix4x4> shifted;
    shifted->DeepCopy(explicitMatrix);
    // Coordinates behind the projection are divided by -z (perspective) or by 1.
    const int column = camera->GetParallelProjection() ? 3 : 2;
    const double sign = column == 3 ? 1.0 : -1.0;
    shifted->SetElement(0, column, shifted->GetElement(0, column) + sign * u);
    shifted->SetElement(1, column, shifted->GetElement(1, column) + sign * v);
    camera->SetExplicitProjectionTransformMatrix(shifted);
    return;
  }
  const double* center = camera->GetWindowCenter();
  camera->SetWindowCenter(center[0] - u, center[1] - v);
}

/// Offset of the i-th view for the pixel filter, in standard deviations: a Gaussian of the
/// low-discrepancy sequence of Roberts (2018).
LensPoint PixelOffset(int i)
{
  constexpr double plastic = 1.32471795724474602596;
  const double a = std::fmod(0.5 + (i + 1) / plastic, 1.0);
  const double b = std::fmod(0.5 + (i + 1) / (plastic * plastic), 1.0);
  const double radius = std::sqrt(-2.0 * std::log(std::max(a, 1e-12)));
  return { radius * std::cos(2.0 * vtkMath::Pi() * b), radius * std::sin(2.0 * vtkMath::Pi() * b) };
}

/// Gives a renderer another camera for as long as it lives.
class CameraSwap
{
public:
  CameraSwap(vtkRenderer* renderer, vtkCamera* camera)
    : Renderer(renderer)
    , Own(renderer->GetActiveCamera())
  {
    renderer->SetActiveCamera(camera);
  }
  ~CameraSwap() { this->Renderer->SetActiveCamera(this->Own); }

private:
  vtkRenderer* Renderer;
  vtkSmartPointer<vtkCamera> Own;
};
}

struct vtkLensAccumulationPass::Internals
{
  vtkNew<vtkOpenGLFramebufferObject> View, Sum;
  vtkNew<vtkTextureObject> ViewColor, ViewDepth, FirstDepth, SumColor;
  std::unique_ptr<vtkOpenGLQuadHelper> Quad;
  vtkWeakPointer<vtkOpenGLRenderWindow> QuadWindow;

  bool Prepare(vtkOpenGLRenderWindow* window, int width, int height);
  void Draw(vtkOpenGLRenderWindow* window, vtkTextureObject* color, vtkTextureObject* depth,
    double share, bool add);
  void AddView(vtkOpenGLRenderWindow* window, int width, int height, bool first);
};

bool vtkLensAccumulationPass::Internals::Prepare(
  vtkOpenGLRenderWindow* window, int width, int height)
{
  const unsigned int w = static_cast<unsigned int>(width), h = static_cast<unsigned int>(height);
  this->View->SetContext(window);
  this->Sum->SetContext(window);
  for (vtkTextureObject* texture :
    { this->ViewColor.Get(), this->ViewDepth.Get(), this->FirstDepth.Get(), this->SumColor.Get() })
  {
    texture->SetContext(window);
    texture->SetMinificationFilter(vtkTextureObject::Nearest);
    texture->SetMagnificationFilter(vtkTextureObject::Nearest);
    texture->SetWrapS(vtkTextureObject::ClampToEdge);
    texture->SetWrapT(vtkTextureObject::ClampToEdge);
    if (texture->GetHandle() && texture->GetWidth() == w && texture->GetHeight() == h)
    {
      continue;
    }
    const bool isDepth = texture == this->ViewDepth || texture == this->FirstDepth;
    if (!(isDepth ? texture->AllocateDepth(w, h, vtkTextureObject::Float32)
                  : texture->Allocate2D(w, h, 4, VTK_FLOAT)))
    {
      return false;
    }
  }
  if (!this->Quad || this->QuadWindow != window || !this->Quad->Program)
  {
    this->Quad.reset(new vtkOpenGLQuadHelper(window, nullptr, LensAccumulationFS, nullptr));
    this->QuadWindow = window;
  }
  return this->Quad->Program && this->Quad->Program->GetCompiled();
}

/// Draws a picture over all of the current viewport.
void vtkLensAccumulationPass::Internals::Draw(vtkOpenGLRenderWindow* window,
  vtkTextureObject* color, vtkTextureObject* depth, double share, bool add)
{
  vtkOpenGLState* state = window->GetState();
  vtkOpenGLState::ScopedglEnableDisable blend(state, GL_BLEND);
  vtkOpenGLState::ScopedglEnableDisable depthTest(state, GL_DEPTH_TEST);
  vtkOpenGLState::ScopedglEnableDisable cull(state, GL_CULL_FACE);
  vtkOpenGLState::ScopedglBlendFuncSeparate blendFunction(state);
  vtkOpenGLState::ScopedglDepthFunc depthFunction(state);
  vtkOpenGLState::ScopedglDepthMask depthMask(state);
  state->vtkglEnable(GL_BLEND);
  const GLenum under = add ? GL_ONE : GL_ZERO;
  state->vtkglBlendFuncSeparate(GL_ONE, under, GL_ONE, under);
  state->vtkglEnable(GL_DEPTH_TEST);
  state->vtkglDepthFunc(GL_ALWAYS);
  state->vtkglDepthMask(GL_TRUE);
  state->vtkglDisable(GL_CULL_FACE);
  window->GetShaderCache()->ReadyShaderProgram(this->Quad->Program);
  color->Activate();
  depth->Activate();
  this->Quad->Program->SetUniformi("viewColor", color->GetTextureUnit());
  this->Quad->Program->SetUniformi("viewDepth", depth->GetTextureUnit());
  this->Quad->Program->SetUniformf("share", static_cast<float>(share));
  this->Quad->Render();
  depth->Deactivate();
  color->Deactivate();
}

/// Adds the view's picture to the sum; of the first one the depth is kept, too.
void vtkLensAccumulationPass::Internals::AddView(
  vtkOpenGLRenderWindow* window, int width, int height, bool first)
{
  vtkOpenGLState* state = window->GetState();
  state->PushFramebufferBindings();
  this->Sum->Bind();
  this->Sum->AddColorAttachment(0, this->SumColor);
  this->Sum->ActivateDrawBuffer(0);
  if (first)
  {
    this->Sum->AddDepthAttachment(this->FirstDepth);
  }
  else
  {
    this->Sum->RemoveDepthAttachment();
  }
  this->Sum->StartNonOrtho(width, height);
  state->vtkglViewport(0, 0, width, height);
  state->vtkglScissor(0, 0, width, height);
  this->Draw(window, this->ViewColor, this->ViewDepth, 1.0, !first);
  state->PopFramebufferBindings();
}

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
    vtkErrorMacro("There is no delegate pass that renders a view: call SetDelegatePass().");
    return;
  }
  vtkRenderer* renderer = state->GetRenderer();
  vtkCamera* camera = renderer->GetActiveCamera();
  auto* window = vtkOpenGLRenderWindow::SafeDownCast(renderer->GetRenderWindow());
  const SurfelSplatting::PixelRectangle rectangle = SurfelSplatting::FrameRectangle(state);
  if (!window || rectangle.Width < 1 || rectangle.Height < 1)
  {
    return;
  }
  const int size[2] = { rectangle.Width, rectangle.Height };
  const SurfelSplatting::View view =
    SurfelSplatting::MakeView(camera, size, renderer->GetTiledAspectRatio());
  const SurfelSplatting::Lens lens = SurfelSplatting::MakeLens(camera);
  const std::vector<SurfelSplatting::LensCell> cells =
    SurfelSplatting::DivideLens(view, lens, { this->NumberOfLensPoints, this->DelegateBlurs == 0 });
  const bool oneView =
    cells.size() == 1 && cells[0].Optics.Radius == lens.Radius && this->PixelFilter == 0.0;
  // Hardware selection draws the props' identities, which have no mean.
  if (renderer->GetSelector() || oneView)
  {
    this->DelegatePass->Render(state);
    this->NumberOfRenderedProps = this->DelegatePass->GetNumberOfRenderedProps();
    return;
  }
  if (!this->Internal->Prepare(window, size[0], size[1]))
  {
    vtkErrorMacro("Float textures of " << size[0] << " x " << size[1]
                                       << " pixels could not be made: nothing is drawn.");
    return;
  }
  vtkOpenGLState* glState = window->GetState();
  const int count = cells.size() == 1 ? this->NumberOfLensPoints : static_cast<int>(cells.size());
  int done = 0;
  for (; done < count && (done == 0 || !window->GetAbortRender()); ++done)
  {
    const SurfelSplatting::LensCell& cell = cells[cells.size() == 1 ? 0 : done];
    const LensPoint jitter = PixelOffset(done);
    const double u = 2.0 * (cell.Camera.Cx - view.Cx + this->PixelFilter * jitter.X) / size[0];
    const double v = 2.0 * (cell.Camera.Cy - view.Cy + this->PixelFilter * jitter.Y) / size[1];
    vtkNew<vtkCamera> moved;
    moved->DeepCopy(camera);
    moved->SetFocalDistance(lens.FocalDistance);
    moved->SetFocalDisk(2.0 * cell.Optics.Radius);
    ShiftCamera(moved, cell.Center[0], cell.Center[1], u, v);
    this->RenderView(state, moved);
    this->Internal->AddView(window, size[0], size[1], done == 0);
  }
  vtkOpenGLState::ScopedglViewport viewport(glState);
  vtkOpenGLState::ScopedglScissor scissor(glState);
  glState->vtkglViewport(rectangle.X, rectangle.Y, size[0], size[1]);
  glState->vtkglScissor(rectangle.X, rectangle.Y, size[0], size[1]);
  this->Internal->Draw(
    window, this->Internal->SumColor, this->Internal->FirstDepth, 1.0 / done, false);
}

void vtkLensAccumulationPass::RenderView(const vtkRenderState* state, vtkCamera* camera)
{
  vtkRenderer* renderer = state->GetRenderer();
  auto* window = vtkOpenGLRenderWindow::SafeDownCast(renderer->GetRenderWindow());
  vtkOpenGLState* glState = window->GetState();
  const CameraSwap swap(renderer, camera);
  vtkOpenGLState::ScopedglViewport viewport(glState);
  vtkOpenGLState::ScopedglScissor scissor(glState);
  const int width = static_cast<int>(this->Internal->ViewColor->GetWidth());
  const int height = static_cast<int>(this->Internal->ViewColor->GetHeight());
  glState->PushFramebufferBindings();
  vtkOpenGLFramebufferObject* framebuffer = this->Internal->View;
  framebuffer->Bind();
  framebuffer->AddColorAttachment(0, this->Internal->ViewColor);
  framebuffer->AddDepthAttachment(this->Internal->ViewDepth);
  framebuffer->ActivateDrawBuffer(0);
  framebuffer->StartNonOrtho(width, height);
  glState->vtkglViewport(0, 0, width, height);
  glState->vtkglScissor(0, 0, width, height);
  vtkRenderState inner(renderer);
  inner.SetPropArrayAndCount(state->GetPropArray(), state->GetPropArrayCount());
  inner.SetRequiredKeys(state->GetRequiredKeys());
  inner.SetFrameBuffer(framebuffer);
  this->DelegatePass->Render(&inner);
  this->NumberOfRenderedProps = this->DelegatePass->GetNumberOfRenderedProps();
  glState->PopFramebufferBindings();
}

void vtkLensAccumulationPass::ReleaseGraphicsResources(vtkWindow* window)
{
  Internals& own = *this->Internal;
  own.Quad.reset();
  own.View->ReleaseGraphicsResources(window);
  own.Sum->ReleaseGraphicsResources(window);
  for (vtkTextureObject* texture :
    { own.ViewColor.Get(), own.ViewDepth.Get(), own.FirstDepth.Get(), own.SumColor.Get() })
  {
    texture->ReleaseGraphicsResources(window);
  }
  if (this->DelegatePass)
  {
    this->DelegatePass->ReleaseGraphicsResources(window);
  }
}

void vtkLensAccumulationPass::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "NumberOfLensPoints: " << this->NumberOfLensPoints << "\n";
  os << indent << "DelegateBlurs: " << this->DelegateBlurs << "\n";
  os << indent << "PixelFilter: " << this->PixelFilter << " px\n";
  os << indent << "DelegatePass: " << this->DelegatePass.Get() << "\n";
}
