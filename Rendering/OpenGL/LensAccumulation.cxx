// SPDX-License-Identifier: BSD-3-Clause
#include "Rendering/OpenGL/LensAccumulation.h"

#include "LensAccumulationFS.h"
#include "Rendering/OpenGL/CameraChanges.h"
#include "Rendering/Scene/SceneAdapter.h"

#include <vtk_glew.h>

#include <vtkCamera.h>
#include <vtkMath.h>
#include <vtkOpenGLFramebufferObject.h>
#include <vtkOpenGLQuadHelper.h>
#include <vtkOpenGLRenderWindow.h>
#include <vtkOpenGLShaderCache.h>
#include <vtkOpenGLState.h>
#include <vtkRenderPass.h>
#include <vtkRenderState.h>
#include <vtkRenderer.h>
#include <vtkShaderProgram.h>
#include <vtkTextureObject.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace SurfelSplatting
{
namespace
{
/// Offset of the i-th view for the pixel filter, in standard deviations: a Gaussian of the
/// low-discrepancy sequence of Roberts (2018).
ApertureSample PixelOffset(int i)
{
  constexpr double plastic = 1.32471795724474602596;
  const double a = std::fmod(0.5 + (i + 1) / plastic, 1.0);
  const double b = std::fmod(0.5 + (i + 1) / (plastic * plastic), 1.0);
  const double radius = std::sqrt(-2.0 * std::log(std::max(a, 1e-12)));
  return { radius * std::cos(2.0 * vtkMath::Pi() * b), radius * std::sin(2.0 * vtkMath::Pi() * b) };
}

vtkOpenGLRenderWindow* WindowOf(const vtkRenderState* state)
{
  return vtkOpenGLRenderWindow::SafeDownCast(state->GetRenderer()->GetRenderWindow());
}
}

LensViews::LensViews(vtkCamera* camera, const int size[2], double aspect, const Lens& lens,
  const ApertureSampling& sampling)
  : Camera(camera)
  , Aspect(aspect)
  , Middle(MakeView(camera, size, aspect))
  , Optics(lens)
  , Cells(DivideLens(this->Middle, lens, sampling))
  , Count(sampling.Count)
{
}

LensAccumulation::LensAccumulation() = default;
LensAccumulation::~LensAccumulation() = default;

bool LensAccumulation::Prepare(vtkOpenGLRenderWindow* window, int width, int height)
{
  this->Sum->SetContext(window);
  if (!FitTexture(window, this->FirstDepth, TextureKind::Depth, width, height) ||
    !FitTexture(window, this->SumColor, TextureKind::Color, width, height))
  {
    return false;
  }
  if (!this->Quad || this->QuadWindow != window || !this->Quad->Program)
  {
    this->Quad.reset(new vtkOpenGLQuadHelper(window, nullptr, LensAccumulationFS, nullptr));
    this->QuadWindow = window;
  }
  return this->Quad->Program && this->Quad->Program->GetCompiled();
}

/// Draws a picture over all of the current viewport.
void LensAccumulation::Draw(vtkOpenGLRenderWindow* window, vtkTextureObject* color,
  vtkTextureObject* depth, double share, Blending blending, Code code, vtkTextureObject* below,
  double deepest)
{
  vtkOpenGLState* state = window->GetState();
  const QuadState quad(state);
  const GLenum under = blending == Blending::Replace ? GL_ZERO
    : blending == Blending::Add                      ? GL_ONE
                                                     : GL_ONE_MINUS_SRC_ALPHA;
  state->vtkglBlendFuncSeparate(GL_ONE, under, GL_ONE, under);
  window->GetShaderCache()->ReadyShaderProgram(this->Quad->Program);
  color->Activate();
  depth->Activate();
  this->Quad->Program->SetUniformi("viewColor", color->GetTextureUnit());
  this->Quad->Program->SetUniformi("viewDepth", depth->GetTextureUnit());
  this->Quad->Program->SetUniformf("share", static_cast<float>(share));
  this->Quad->Program->SetUniformf("deepest", static_cast<float>(deepest));
  this->Quad->Program->SetUniformi("toLight", code == Code::ToLight ? 1 : 0);
  this->Quad->Program->SetUniformi("toCodes", code == Code::ToCodes ? 1 : 0);
  this->Quad->Program->SetUniformi("overBelow", below ? 1 : 0);
  below = below ? below : color; // a sampler needs some texture
  below->Activate();
  this->Quad->Program->SetUniformi("belowColor", below->GetTextureUnit());
  this->Quad->Render();
  below->Deactivate();
  depth->Deactivate();
  color->Deactivate();
}

/// Adds the view's picture to the sum; of the first one the depth is kept, too.
void LensAccumulation::AddView(
  vtkOpenGLRenderWindow* window, const PixelRectangle& rectangle, bool first, bool toLight)
{
  vtkOpenGLState* state = window->GetState();
  vtkOpenGLState::ScopedglViewport viewport(state);
  vtkOpenGLState::ScopedglScissor scissor(state);
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
  this->Sum->StartNonOrtho(rectangle.Width, rectangle.Height);
  state->vtkglViewport(0, 0, rectangle.Width, rectangle.Height);
  state->vtkglScissor(0, 0, rectangle.Width, rectangle.Height);
  this->Draw(window, this->Frame.Color(), this->Frame.Depth(), 1.0,
    first ? Blending::Replace : Blending::Add, toLight ? Code::ToLight : Code::Keep);
  state->PopFramebufferBindings();
}

/// What layers below have left in the frame: their depth, which hides what is behind, and their
/// colours, where light is to be mixed with theirs, which blending knows nothing of.
void LensAccumulation::KeepBelow(
  vtkOpenGLRenderWindow* window, const PixelRectangle& rectangle, bool depth, bool color)
{
  std::vector<float> values;
  this->HasDepthBelow = depth && this->Blit.ReadDepth(window, rectangle, values) &&
    Upload(window, this->DepthBelow, rectangle, 1, values.data());
  this->HasColorBelow = color && this->Blit.ReadColor(window, rectangle, values) &&
    Upload(window, this->ColorBelow, rectangle, 4, values.data());
}

bool LensAccumulation::RenderView(const vtkRenderState* state, const LensViews& views, int index,
  const PixelRectangle& rectangle, vtkRenderPass* delegate)
{
  const SubAperture& cell = views.Cells[views.Cells.size() == 1 ? 0 : index];
  const ApertureSample jitter = PixelOffset(index);
  const double u =
    2.0 * (cell.Camera.Cx - views.Middle.Cx + views.PixelFilter * jitter.X) / rectangle.Width;
  const double v =
    2.0 * (cell.Camera.Cy - views.Middle.Cy + views.PixelFilter * jitter.Y) / rectangle.Height;
  const vtkSmartPointer<vtkCamera> moved = CopyCamera(views.Camera, views.Aspect);
  moved->SetFocalDistance(views.Optics.FocalDistance);
  moved->SetFocalDisk(2.0 * cell.Optics.Radius);
  ShiftCamera(moved, cell.Center[0], cell.Center[1], u, v);

  vtkRenderer* renderer = state->GetRenderer();
  vtkOpenGLRenderWindow* window = WindowOf(state);
  const int samples = CurrentSamples();
  const bool begun = this->Frame.Begin(window, rectangle.Width, rectangle.Height, samples);
  if (views.All ? !views.All(begun) : !begun)
  {
    if (begun)
    {
      this->Frame.End(false);
    }
    return false;
  }
  if (renderer->Transparent()) // which does not clear what it draws over
  {
    window->GetState()->vtkglClearColor(0.0f, 0.0f, 0.0f, 0.0f);
    window->GetState()->vtkglClear(GL_COLOR_BUFFER_BIT);
  }
  if (this->HasDepthBelow)
  {
    this->Draw(window, this->DepthBelow, this->DepthBelow, 0.0, Blending::Add, Code::Keep);
  }
  RenderThrough(state, moved, this->Frame.Framebuffer(), delegate);
  this->Frame.End();
  return true;
}

bool LensAccumulation::Render(const vtkRenderState* state, const PixelRectangle& rectangle,
  const LensViews& views, vtkRenderPass* delegate)
{
  vtkOpenGLRenderWindow* window = WindowOf(state);
  const auto all = [&views](bool mine) { return views.All ? views.All(mine) : mine; };
  if (!all(this->Prepare(window, rectangle.Width, rectangle.Height)))
  {
    return false;
  }
  vtkRenderer* renderer = state->GetRenderer();
  this->KeepBelow(window, rectangle, renderer->GetPreserveDepthBuffer() != 0,
    renderer->Transparent() && views.LinearLight);
  int done = 0;
  for (; done < views.Count && (done == 0 || all(!window->GetAbortRender())); ++done)
  {
    if (!this->RenderView(state, views, done, rectangle, delegate))
    {
      return false;
    }
    this->AddView(window, rectangle, done == 0, views.LinearLight);
  }
  vtkOpenGLState* glState = window->GetState();
  vtkOpenGLState::ScopedglViewport viewport(glState);
  vtkOpenGLState::ScopedglScissor scissor(glState);
  glState->vtkglViewport(rectangle.X, rectangle.Y, rectangle.Width, rectangle.Height);
  glState->vtkglScissor(rectangle.X, rectangle.Y, rectangle.Width, rectangle.Height);
  this->Draw(window, this->SumColor, this->FirstDepth, 1.0 / done,
    renderer->Transparent() && !this->HasColorBelow ? Blending::Over : Blending::Replace,
    views.LinearLight ? Code::ToCodes : Code::Keep,
    this->HasColorBelow ? this->ColorBelow.Get() : nullptr, views.Deepest);
  return true;
}

void LensAccumulation::ReleaseGraphicsResources(vtkWindow* window)
{
  this->Quad.reset();
  this->Frame.ReleaseGraphicsResources(window);
  this->Sum->ReleaseGraphicsResources(window);
  this->FirstDepth->ReleaseGraphicsResources(window);
  this->SumColor->ReleaseGraphicsResources(window);
  this->DepthBelow->ReleaseGraphicsResources(window);
  this->ColorBelow->ReleaseGraphicsResources(window);
  this->Blit.ReleaseGraphicsResources(window);
}
}
