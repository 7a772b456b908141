// SPDX-License-Identifier: BSD-3-Clause
#include "Rendering/OpenGL/LensAccumulation.h"

#include "LensAccumulationFS.h"
#include "Rendering/OpenGL/CameraChanges.h"
#include "Rendering/OpenGL/Functions.h"
#include "Rendering/OpenGL/PixelTexture.h"

#include <vtkCamera.h>
#include <vtkMath.h>
#include <vtkOpenGLFramebufferObject.h>
#include <vtkOpenGLRenderWindow.h>
#include <vtkOpenGLState.h>
#include <vtkRenderPass.h>
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
/// Offset of the i-th view for the pixel filter, in standard deviations: the low-discrepancy
/// sequence of Roberts (2018), transformed to a Gaussian.
ApertureSample PixelOffset(int i)
{
  constexpr double plastic = 1.32471795724474602596;
  const double a = std::fmod(0.5 + (i + 1) / plastic, 1.0);
  const double b = std::fmod(0.5 + (i + 1) / (plastic * plastic), 1.0);
  const double radius = std::sqrt(-2.0 * std::log(std::max(a, 1e-12)));
  return { radius * std::cos(2.0 * vtkMath::Pi() * b), radius * std::sin(2.0 * vtkMath::Pi() * b) };
}
}

LensViews::LensViews(const View& view, const Lens& lens, const ApertureSampling& sampling)
  : Whole(view)
  , Optics(lens)
  , Cells(DivideLens(view, lens, sampling))
  , Count(sampling.Count)
{
}

LensAccumulation::LensAccumulation()
  : Quad(LensAccumulationFS)
{
}

LensAccumulation::~LensAccumulation() = default;

bool LensAccumulation::Prepare(const PassFrame& frame)
{
  const PixelRectangle& r = frame.Rectangle;
  this->Owner.ChangeTo(
    frame.Window, [this](vtkWindow* before) { this->Sum->ReleaseGraphicsResources(before); });
  this->Sum->SetContext(frame.Window);
  return FitTexture(frame.Window, this->FirstDepth, TextureKind::Depth, r.Width, r.Height) &&
    FitTexture(frame.Window, this->SumColor, TextureKind::Color, r.Width, r.Height) &&
    this->Quad.Use(frame.Window);
}

void LensAccumulation::Draw(vtkOpenGLRenderWindow* window, const Drawing& drawing)
{
  vtkOpenGLState* state = window->GetState();
  const QuadState quad(state);
  const GLenum under = drawing.Blend == Blending::Replace ? GL_ZERO
    : drawing.Blend == Blending::Add                      ? GL_ONE
                                                          : GL_ONE_MINUS_SRC_ALPHA;
  state->vtkglBlendFuncSeparate(GL_ONE, under, GL_ONE, under);
  vtkShaderProgram* program = this->Quad.Use(window);
  // A sampler needs a texture even if the shader does not read it.
  vtkTextureObject* below = drawing.Below ? drawing.Below : drawing.Color;
  drawing.Color->Activate();
  drawing.Depth->Activate();
  program->SetUniformi("viewColor", drawing.Color->GetTextureUnit());
  program->SetUniformi("viewDepth", drawing.Depth->GetTextureUnit());
  program->SetUniformf("share", static_cast<float>(drawing.Share));
  program->SetUniformf("deepest", static_cast<float>(drawing.Deepest));
  program->SetUniformi("toLight", drawing.Convert == Conversion::ToLight ? 1 : 0);
  program->SetUniformi("toCodes", drawing.Convert == Conversion::ToCodes ? 1 : 0);
  program->SetUniformi("overBelow", drawing.Below ? 1 : 0);
  below->Activate();
  program->SetUniformi("belowColor", below->GetTextureUnit());
  this->Quad.Draw();
  below->Deactivate();
  drawing.Depth->Deactivate();
  drawing.Color->Deactivate();
}

/// Adds the picture of the view to the sum. Keeps the depth of the first one.
void LensAccumulation::AddView(const PassFrame& frame, bool first, bool toLight)
{
  const PixelRectangle& rectangle = frame.Rectangle;
  vtkOpenGLState* state = frame.Window->GetState();
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
  this->Draw(frame.Window,
    { this->Frame.Color(), this->Frame.Depth(), first ? Blending::Replace : Blending::Add,
      toLight ? Conversion::ToLight : Conversion::None });
  state->PopFramebufferBindings();
}

/// Keeps the image of the layers below: their depth, which hides things behind them, and their
/// colours if they are to be mixed as light, which blending cannot do.
void LensAccumulation::KeepBelow(const PassFrame& frame, bool depth, bool color)
{
  const PixelRectangle& r = frame.Rectangle;
  std::vector<float> values;
  this->HasDepthBelow = depth && this->Blit.ReadDepth(frame.Window, r, values) &&
    Upload(frame.Window, this->DepthBelow, { r.Width, r.Height, 1, values.data() });
  this->HasColorBelow = color && this->Blit.ReadColor(frame.Window, r, values) &&
    Upload(frame.Window, this->ColorBelow, { r.Width, r.Height, 4, values.data() });
}

bool LensAccumulation::RenderView(
  const PassFrame& frame, const LensViews& views, int index, vtkRenderPass* delegate)
{
  const int width = frame.Rectangle.Width, height = frame.Rectangle.Height;
  const SubAperture& cell = views.Cells[views.Cells.size() == 1 ? 0 : index];
  const ApertureSample jitter = PixelOffset(index);
  const double u = 2.0 * (cell.Camera.Cx - views.Whole.Cx + views.PixelFilter * jitter.X) / width;
  const double v = 2.0 * (cell.Camera.Cy - views.Whole.Cy + views.PixelFilter * jitter.Y) / height;
  const vtkSmartPointer<vtkCamera> moved =
    CopyCamera(frame.Renderer->GetActiveCamera(), frame.Aspect);
  moved->SetFocalDistance(views.Optics.FocalDistance);
  moved->SetFocalDisk(2.0 * cell.Optics.Radius);
  this->CellShape = cell.Optics.Shape;
  ShiftCamera(moved, cell.Center[0], cell.Center[1], u, v);

  const bool begun = this->Frame.Begin(frame.Window, width, height, CurrentSamples());
  if (views.Group ? !views.Group->All(begun) : !begun)
  {
    if (begun)
    {
      this->Frame.End(false);
    }
    return false;
  }
  if (frame.Renderer->Transparent()) // it does not clear what it draws over
  {
    frame.Window->GetState()->vtkglClearColor(0.0f, 0.0f, 0.0f, 0.0f);
    frame.Window->GetState()->vtkglClear(GL_COLOR_BUFFER_BIT);
  }
  if (this->HasDepthBelow)
  {
    Drawing depthOnly{ this->DepthBelow, this->DepthBelow, Blending::Add };
    depthOnly.Share = 0.0;
    this->Draw(frame.Window, depthOnly);
  }
  RenderThrough(
    frame.State, VisibleProps(frame.Renderer), moved, this->Frame.Framebuffer(), delegate);
  this->Frame.End();
  return true;
}

bool LensAccumulation::Render(
  const PassFrame& frame, const LensViews& views, vtkRenderPass* delegate)
{
  const auto all = [&views](bool own) { return views.Group ? views.Group->All(own) : own; };
  if (!all(this->Prepare(frame)))
  {
    return false;
  }
  vtkRenderer* renderer = frame.Renderer;
  this->KeepBelow(
    frame, renderer->GetPreserveDepthBuffer() != 0, renderer->Transparent() && views.LinearLight);
  int done = 0;
  for (; done < views.Count && (done == 0 || all(!frame.Window->GetAbortRender())); ++done)
  {
    if (!this->RenderView(frame, views, done, delegate))
    {
      return false;
    }
    this->AddView(frame, done == 0, views.LinearLight);
  }
  const PixelRectangle& r = frame.Rectangle;
  vtkOpenGLState* state = frame.Window->GetState();
  vtkOpenGLState::ScopedglViewport viewport(state);
  vtkOpenGLState::ScopedglScissor scissor(state);
  state->vtkglViewport(r.X, r.Y, r.Width, r.Height);
  state->vtkglScissor(r.X, r.Y, r.Width, r.Height);
  Drawing mean{ this->SumColor, this->FirstDepth };
  mean.Blend = renderer->Transparent() && !this->HasColorBelow ? Blending::Over : Blending::Replace;
  mean.Convert = views.LinearLight ? Conversion::ToCodes : Conversion::None;
  mean.Share = 1.0 / done;
  mean.Below = this->HasColorBelow ? this->ColorBelow.Get() : nullptr;
  mean.Deepest = views.Deepest;
  this->Draw(frame.Window, mean);
  return true;
}

void LensAccumulation::ReleaseGraphicsResources(vtkWindow* window)
{
  this->Quad.ReleaseGraphicsResources();
  this->Frame.ReleaseGraphicsResources(window);
  this->Sum->ReleaseGraphicsResources(window);
  this->FirstDepth->ReleaseGraphicsResources(window);
  this->SumColor->ReleaseGraphicsResources(window);
  this->DepthBelow->ReleaseGraphicsResources(window);
  this->ColorBelow->ReleaseGraphicsResources(window);
  this->Blit.ReleaseGraphicsResources(window);
}
}
