// SPDX-License-Identifier: BSD-3-Clause
#include "Rendering/OpenGL/OffscreenFrame.h"

#include "Rendering/OpenGL/Functions.h"
#include "Rendering/OpenGL/PixelTexture.h"

#include <vtkOpenGLFramebufferObject.h>
#include <vtkOpenGLRenderWindow.h>
#include <vtkOpenGLState.h>
#include <vtkRenderbuffer.h>
#include <vtkTextureObject.h>

namespace SurfelSplatting
{
int CurrentSamples()
{
  GLint samples = 0;
  glGetIntegerv(GL_SAMPLES, &samples);
  return samples;
}

OffscreenFrame::OffscreenFrame()
{
  this->MakeObjects();
}

OffscreenFrame::~OffscreenFrame() = default;

void OffscreenFrame::MakeObjects()
{
  this->Single = vtkSmartPointer<vtkOpenGLFramebufferObject>::New();
  this->Multi = vtkSmartPointer<vtkOpenGLFramebufferObject>::New();
  this->MultiColor = vtkSmartPointer<vtkRenderbuffer>::New();
  this->MultiDepth = vtkSmartPointer<vtkRenderbuffer>::New();
}

bool OffscreenFrame::Allocate(int width, int height, int samples)
{
  if (!FitTexture(this->Window, this->SingleColor, TextureKind::Color, width, height) ||
    !FitTexture(this->Window, this->SingleDepth, TextureKind::Depth, width, height))
  {
    return false;
  }
  const bool fits = this->MultiColor->GetHandle() && this->Samples == samples &&
    this->Size[0] == width && this->Size[1] == height;
  this->Samples = 0;
  if (samples > 0 && !fits)
  {
    this->MultiColor->SetContext(this->Window);
    this->MultiDepth->SetContext(this->Window);
    const auto w = static_cast<unsigned int>(width), h = static_cast<unsigned int>(height);
    const auto s = static_cast<unsigned int>(samples);
    if (!this->MultiColor->Create(GL_RGBA16F, w, h, s) ||
      !this->MultiDepth->Create(GL_DEPTH_COMPONENT32, w, h, s))
    {
      return false;
    }
  }
  this->Samples = samples;
  this->Size[0] = width;
  this->Size[1] = height;
  return true;
}

bool OffscreenFrame::Begin(vtkOpenGLRenderWindow* window, int width, int height, int samples)
{
  this->Owner.ChangeTo(
    window, [this](vtkWindow* before) { this->ReleaseGraphicsResources(before); });
  this->Window = window;
  this->Single->SetContext(window);
  this->Multi->SetContext(window);
  vtkOpenGLState* state = window->GetState();
  state->vtkglGetIntegerv(GL_VIEWPORT, this->Viewport);
  state->vtkglGetIntegerv(GL_SCISSOR_BOX, this->Scissor);
  state->PushFramebufferBindings();
  if (!this->Allocate(width, height, samples))
  {
    state->PopFramebufferBindings();
    return false;
  }
  vtkOpenGLFramebufferObject* framebuffer = samples > 0 ? this->Multi : this->Single;
  framebuffer->Bind();
  if (samples > 0)
  {
    framebuffer->AddColorAttachment(0, this->MultiColor);
    framebuffer->AddDepthAttachment(this->MultiDepth);
  }
  else
  {
    framebuffer->AddColorAttachment(0, this->SingleColor);
    framebuffer->AddDepthAttachment(this->SingleDepth);
  }
  framebuffer->ActivateDrawBuffer(0);
  framebuffer->StartNonOrtho(width, height);
  state->vtkglViewport(0, 0, width, height);
  state->vtkglScissor(0, 0, width, height);
  return true;
}

vtkFrameBufferObjectBase* OffscreenFrame::Framebuffer()
{
  return this->Samples > 0 ? this->Multi : this->Single;
}

void OffscreenFrame::Resolve()
{
  vtkOpenGLState* state = this->Window->GetState();
  vtkOpenGLState::ScopedglEnableDisable scissor(state, GL_SCISSOR_TEST);
  state->vtkglDisable(GL_SCISSOR_TEST); // it would cut off the blit
  this->Multi->Bind(GL_READ_FRAMEBUFFER);
  this->Multi->ActivateReadBuffer(0);
  this->Single->Bind(GL_DRAW_FRAMEBUFFER);
  this->Single->AddColorAttachment(0, this->SingleColor);
  this->Single->AddDepthAttachment(this->SingleDepth);
  this->Single->ActivateDrawBuffer(0);
  glBlitFramebuffer(0, 0, this->Size[0], this->Size[1], 0, 0, this->Size[0], this->Size[1],
    GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT, GL_NEAREST);
}

void OffscreenFrame::End(bool resolve)
{
  vtkOpenGLState* state = this->Window->GetState();
  if (this->Samples > 0 && resolve)
  {
    this->Resolve();
  }
  state->PopFramebufferBindings();
  state->vtkglViewport(this->Viewport[0], this->Viewport[1], this->Viewport[2], this->Viewport[3]);
  state->vtkglScissor(this->Scissor[0], this->Scissor[1], this->Scissor[2], this->Scissor[3]);
  this->Window = nullptr;
}

vtkTextureObject* OffscreenFrame::Color()
{
  return this->SingleColor;
}

vtkTextureObject* OffscreenFrame::Depth()
{
  return this->SingleDepth;
}

void OffscreenFrame::ReleaseGraphicsResources(vtkWindow* window)
{
  this->Single->ReleaseGraphicsResources(window);
  this->Multi->ReleaseGraphicsResources(window);
  this->SingleColor->ReleaseGraphicsResources(window);
  this->SingleDepth->ReleaseGraphicsResources(window);
  this->MultiColor->ReleaseGraphicsResources(window);
  this->MultiDepth->ReleaseGraphicsResources(window);
  this->MakeObjects(); // released objects keep their context and cannot be used again
}
}
