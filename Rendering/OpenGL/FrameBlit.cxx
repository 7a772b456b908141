// SPDX-License-Identifier: BSD-3-Clause
#include "Rendering/OpenGL/FrameBlit.h"

#include "Rendering/OpenGL/Functions.h"
#include "Rendering/OpenGL/PixelTexture.h"
#include "SurfelData/SMPExecutor.h"

#include <vtkOpenGLRenderWindow.h>
#include <vtkOpenGLState.h>
#include <vtkTextureObject.h>

#include <algorithm>
#include <cstddef>

namespace SurfelSplatting
{
namespace
{
/// Format of the depth attachment of the bound draw framebuffer: a depth blit needs the same format
/// on both sides.
GLint DepthFormat(int framebuffer)
{
  GLint format = GL_DEPTH_COMPONENT24;
  if (framebuffer == 0)
  {
    GLint bits = 24, stencil = 0;
    glGetFramebufferAttachmentParameteriv(
      GL_DRAW_FRAMEBUFFER, GL_DEPTH, GL_FRAMEBUFFER_ATTACHMENT_DEPTH_SIZE, &bits);
    glGetFramebufferAttachmentParameteriv(
      GL_DRAW_FRAMEBUFFER, GL_STENCIL, GL_FRAMEBUFFER_ATTACHMENT_OBJECT_TYPE, &stencil);
    return bits == 32 ? GL_DEPTH_COMPONENT32 : stencil ? GL_DEPTH24_STENCIL8 : GL_DEPTH_COMPONENT24;
  }
  GLint type = GL_NONE, name = 0;
  glGetFramebufferAttachmentParameteriv(
    GL_DRAW_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_FRAMEBUFFER_ATTACHMENT_OBJECT_TYPE, &type);
  glGetFramebufferAttachmentParameteriv(
    GL_DRAW_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_FRAMEBUFFER_ATTACHMENT_OBJECT_NAME, &name);
  if (type == GL_RENDERBUFFER)
  {
    GLint bound = 0;
    glGetIntegerv(GL_RENDERBUFFER_BINDING, &bound);
    glBindRenderbuffer(GL_RENDERBUFFER, name);
    glGetRenderbufferParameteriv(GL_RENDERBUFFER, GL_RENDERBUFFER_INTERNAL_FORMAT, &format);
    glBindRenderbuffer(GL_RENDERBUFFER, bound);
  }
  else if (type == GL_TEXTURE)
  {
    GLint bound = 0;
    glGetIntegerv(GL_TEXTURE_BINDING_2D_MULTISAMPLE, &bound);
    glBindTexture(GL_TEXTURE_2D_MULTISAMPLE, name);
    glGetTexLevelParameteriv(GL_TEXTURE_2D_MULTISAMPLE, 0, GL_TEXTURE_INTERNAL_FORMAT, &format);
    glBindTexture(GL_TEXTURE_2D_MULTISAMPLE, bound);
  }
  return format;
}

/// How rows of main memory are packed.
class PackState
{
public:
  explicit PackState(int rowLength)
  {
    glGetIntegerv(GL_PACK_ALIGNMENT, &this->Alignment);
    glGetIntegerv(GL_PACK_ROW_LENGTH, &this->RowLength);
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    glPixelStorei(GL_PACK_ROW_LENGTH, rowLength);
  }
  ~PackState()
  {
    glPixelStorei(GL_PACK_ALIGNMENT, this->Alignment);
    glPixelStorei(GL_PACK_ROW_LENGTH, this->RowLength);
  }
  PackState(const PackState&) = delete;
  PackState& operator=(const PackState&) = delete;

private:
  GLint Alignment = 4, RowLength = 0;
};

/// Whether the colours of the bound draw framebuffer, which is not the window's own, are four
/// bytes. Mesa reads them as floats one by one.
bool HasByteColors()
{
  GLint buffer = GL_NONE;
  glGetIntegerv(GL_DRAW_BUFFER0, &buffer);
  if (buffer != GL_COLOR_ATTACHMENT0)
  {
    return false;
  }
  const auto ask = [](GLenum what) {
    GLint value = 0;
    glGetFramebufferAttachmentParameteriv(GL_DRAW_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, what, &value);
    return value;
  };
  const GLint type = ask(GL_FRAMEBUFFER_ATTACHMENT_OBJECT_TYPE);
  return (type == GL_TEXTURE || type == GL_RENDERBUFFER) &&
    ask(GL_FRAMEBUFFER_ATTACHMENT_COMPONENT_TYPE) == GL_UNSIGNED_NORMALIZED &&
    ask(GL_FRAMEBUFFER_ATTACHMENT_RED_SIZE) == 8 && ask(GL_FRAMEBUFFER_ATTACHMENT_ALPHA_SIZE) == 8;
}
}

FrameBlit::FrameBlit() = default;
FrameBlit::~FrameBlit() = default;

bool FrameBlit::ReadDepth(
  vtkOpenGLRenderWindow* window, const PixelRectangle& rectangle, std::vector<float>& depth)
{
  depth.resize(static_cast<std::size_t>(rectangle.Width) * rectangle.Height);
  return this->Read(window, rectangle, Plane::Depth, { depth.data(), rectangle.Width });
}

bool FrameBlit::ReadColor(
  vtkOpenGLRenderWindow* window, const PixelRectangle& rectangle, std::vector<float>& color)
{
  color.resize(4 * static_cast<std::size_t>(rectangle.Width) * rectangle.Height);
  return this->Read(window, rectangle, Plane::Color, { color.data(), rectangle.Width });
}

bool FrameBlit::ReadPart(vtkOpenGLRenderWindow* window, const PixelRectangle& rectangle, int width,
  std::vector<float>& color, std::vector<float>& depth)
{
  const std::size_t first = static_cast<std::size_t>(rectangle.Y) * width + rectangle.X;
  return this->Read(window, rectangle, Plane::Color, { color.data() + 4 * first, width }) &&
    this->Read(window, rectangle, Plane::Depth, { depth.data() + first, width });
}

/// Reads bytes and makes floats of them with all threads.
bool FrameBlit::ReadBytes(const PixelRectangle& r, const Target& target)
{
  const std::size_t row = 4 * static_cast<std::size_t>(r.Width);
  this->Bytes.resize(row * r.Height);
  {
    const PackState state(r.Width);
    glReadPixels(r.X, r.Y, r.Width, r.Height, GL_RGBA, GL_UNSIGNED_BYTE, this->Bytes.data());
  }
  SMPExecutor().For(
    static_cast<std::size_t>(r.Height), 16, [&](std::size_t begin, std::size_t end) {
      for (std::size_t y = begin; y < end; ++y)
      {
        const unsigned char* from = this->Bytes.data() + y * row;
        std::transform(from, from + row, target.Values + 4 * y * target.Stride,
          [](unsigned char byte) { return static_cast<float>(byte) / 255.0f; });
      }
    });
  return glGetError() == GL_NO_ERROR;
}

bool FrameBlit::Read(
  vtkOpenGLRenderWindow* window, const PixelRectangle& rectangle, Plane plane, const Target& target)
{
  // Forget earlier errors. A lost context reports one for ever, hence the limit.
  for (int i = 0; i < 16 && glGetError() != GL_NO_ERROR; ++i)
  {
  }
  GLint drawFramebuffer = 0, samples = 0;
  glGetIntegerv(GL_DRAW_FRAMEBUFFER_BINDING, &drawFramebuffer);
  glGetIntegerv(GL_SAMPLES, &samples);
  vtkOpenGLState* state = window->GetState();
  state->PushReadFramebufferBinding();
  bool isRead = true;
  if (samples > 0)
  {
    isRead = this->Resolve(state, rectangle, drawFramebuffer, plane, target);
  }
  else
  {
    glBindFramebuffer(GL_READ_FRAMEBUFFER, drawFramebuffer);
    if (plane == Plane::Color && HasByteColors())
    {
      isRead = this->ReadBytes(rectangle, target);
    }
    else
    {
      const PackState packing(target.Stride);
      glReadPixels(rectangle.X, rectangle.Y, rectangle.Width, rectangle.Height,
        plane == Plane::Color ? GL_RGBA : GL_DEPTH_COMPONENT, GL_FLOAT, target.Values);
    }
  }
  isRead = glGetError() == GL_NO_ERROR && isRead;
  state->PopReadFramebufferBinding();
  return isRead;
}

/// Blits the plane of a multisampled framebuffer into a buffer with one sample and reads that.
bool FrameBlit::Resolve(vtkOpenGLState* state, const PixelRectangle& r, int framebuffer,
  Plane plane, const Target& target)
{
  // A blit obeys the scissor, which is set for the rectangle in the window, not in this buffer.
  vtkOpenGLState::ScopedglEnableDisable scissor(state, GL_SCISSOR_TEST);
  state->vtkglDisable(GL_SCISSOR_TEST);
  GLuint resolved = 0, buffer = 0;
  GLint boundRenderbuffer = 0;
  const bool isColor = plane == Plane::Color;
  const GLint format = isColor ? GL_RGBA16F : DepthFormat(framebuffer);
  const bool stencil = format == GL_DEPTH24_STENCIL8 || format == GL_DEPTH32F_STENCIL8;
  glGetIntegerv(GL_RENDERBUFFER_BINDING, &boundRenderbuffer);
  glGenRenderbuffers(1, &buffer);
  glBindRenderbuffer(GL_RENDERBUFFER, buffer);
  glRenderbufferStorage(GL_RENDERBUFFER, format, r.Width, r.Height);
  glBindRenderbuffer(GL_RENDERBUFFER, boundRenderbuffer);

  glGenFramebuffers(1, &resolved);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer);
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, resolved);
  glFramebufferRenderbuffer(GL_DRAW_FRAMEBUFFER,
    isColor     ? GL_COLOR_ATTACHMENT0
      : stencil ? GL_DEPTH_STENCIL_ATTACHMENT
                : GL_DEPTH_ATTACHMENT,
    GL_RENDERBUFFER, buffer);
  const bool complete = glCheckFramebufferStatus(GL_DRAW_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;
  if (complete)
  {
    glBlitFramebuffer(r.X, r.Y, r.X + r.Width, r.Y + r.Height, 0, 0, r.Width, r.Height,
      isColor ? GL_COLOR_BUFFER_BIT : GL_DEPTH_BUFFER_BIT, GL_NEAREST);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, resolved);
    const PackState packing(target.Stride);
    glReadPixels(
      0, 0, r.Width, r.Height, isColor ? GL_RGBA : GL_DEPTH_COMPONENT, GL_FLOAT, target.Values);
  }
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, framebuffer);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer);
  glDeleteFramebuffers(1, &resolved);
  glDeleteRenderbuffers(1, &buffer);
  return complete;
}

bool FrameBlit::Draw(vtkOpenGLRenderWindow* window, const PixelRectangle& rectangle,
  const float* color, const float* windowDepth, bool replace)
{
  return Upload(window, this->Color, PixelValues{ rectangle.Width, rectangle.Height, 4, color }) &&
    Upload(window, this->Depth, PixelValues{ rectangle.Width, rectangle.Height, 1, windowDepth }) &&
    this->Quad.Draw(window, rectangle, { this->Color, this->Depth }, replace);
}

void FrameBlit::Clear(vtkOpenGLRenderWindow* window, const PixelRectangle& rectangle)
{
  vtkOpenGLState* state = window->GetState();
  vtkOpenGLState::ScopedglScissor scissor(state);
  vtkOpenGLState::ScopedglEnableDisable test(state, GL_SCISSOR_TEST);
  vtkOpenGLState::ScopedglDepthMask mask(state);
  state->vtkglEnable(GL_SCISSOR_TEST);
  state->vtkglScissor(rectangle.X, rectangle.Y, rectangle.Width, rectangle.Height);
  state->vtkglDepthMask(GL_TRUE);
  state->vtkglClearColor(0.0f, 0.0f, 0.0f, 0.0f);
  state->vtkglClearDepth(1.0);
  state->vtkglClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
}

void FrameBlit::ReleaseGraphicsResources(vtkWindow* window)
{
  this->Quad.ReleaseGraphicsResources();
  this->Color->ReleaseGraphicsResources(window);
  this->Depth->ReleaseGraphicsResources(window);
}
}
